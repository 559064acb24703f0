// A number of a pair by which forces are differentiated.
#pragma once

#include <utility>

#include "dynamics/scene/pair.hpp"

namespace sphshell {

// One column of derivatives.
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
  double scale = 1;  // size of the number

  // The pair changed by a step of this sign, and that step: `move` where the parameter moves
  // something [m or rad].
  std::pair<Pair, double> changed(const Pair& pair, double sign, double move) const {
    if (kind != Kind::Offset && kind != Kind::Placement) return {sign > 0 ? more : less, step};
    Pair out = pair;
    if (kind == Kind::Offset) {
      out.placement_i.translation() += sign * move * pair.placement_i.rotation().col(axis);
    } else {
      pinocchio::Motion twist = pinocchio::Motion::Zero();
      twist.toVector()[axis] = sign * move;
      out.placement_j = pair.placement_j * exp_of(twist);
    }
    return {out, move};
  }

 private:
  // Of a twist along or about one axis.
  static SE3 exp_of(const pinocchio::Motion& twist) {
    const double angle = twist.angular().norm();
    if (angle == 0) return SE3(Eigen::Matrix3d::Identity(), twist.linear());
    return SE3(Eigen::AngleAxisd(angle, twist.angular() / angle).toRotationMatrix(), Vec3::Zero());
  }
};

}  // namespace sphshell
