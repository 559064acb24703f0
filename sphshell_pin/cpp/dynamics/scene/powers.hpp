// What the forces of a scene do at one state.
#pragma once

namespace sphshell {

// Of all contacts and joints: power lost in damping and friction, and energy stored.
struct Powers {
  double damping = 0, friction = 0;  // [W]
  double elastic = 0, bristles = 0;  // [J]
};

}  // namespace sphshell
