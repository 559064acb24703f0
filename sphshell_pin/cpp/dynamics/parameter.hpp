// A number of a pair by which forces are differentiated.
#pragma once

#include "dynamics/pair.hpp"

namespace sphshell {

struct Parameter {
  // A field of law or friction, or something else that moves no body; the radius of the sphere, or
  // of the ball; a coordinate of the sphere's center, in its frame; of the shell's placement, a
  // coordinate of the twist that it is moved by, in its own axes, linear part first.
  enum class Kind : int { Field, Radius, Ball, Offset, Placement };

  int pair;
  Kind kind;
  int axis = 0;  // of Offset and Placement
  // Of the others: the pair with the number less and more a step. What follows from it through the
  // law's own formulas is differenced, what follows through the motion of the contact is not.
  Pair less = {}, more = {};
  double step = 0;
};

}  // namespace sphshell
