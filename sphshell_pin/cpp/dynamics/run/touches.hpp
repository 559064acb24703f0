// Where pairs touch at a state, or would, and how they can move there: what a run begins with.
#pragma once

#include "dynamics/scene/multibody.hpp"
#include "dynamics/scene/pair.hpp"

namespace sphshell {

// The gap [m]; what a force along the normal, or across it where that is least, has to move [kg],
// nan where the bodies cannot move; the speed along the normal [m/s]. All nan of a source that
// finds nothing.
struct Touch {
  double gap, mass, slip_mass, speed;
};

std::vector<Touch> touches_at(Multibody& body, const std::vector<Pair>& pairs, const VectorX& q,
                              const VectorX& v);

}  // namespace sphshell
