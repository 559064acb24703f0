// The ellipse in which two bodies touch, by Hertz's geometry (Johnson, Contact Mechanics, 4.2).
#pragma once

#include <algorithm>
#include <limits>

#include "contact/laws/hertz.hpp"
#include "dynamics/scene/contact_row.hpp"

namespace sphshell {

// Where nothing is known of the bodies.
inline PatchRow unknown_patch(double depth) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {{nan, nan}, {nan, nan, nan}, nan, nan, depth};
}

// Of a gap of this shape; `rotation` is that of the shell in the world.
inline PatchRow hertz_patch(const ContactShape& gap, const Eigen::Matrix3d& rotation, double depth,
                            double force) {
  constexpr double kPi = 3.14159265358979323846;
  const Eigen::Vector2d half = gap.half_axes(depth);
  const Eigen::Vector3d axis = rotation * gap.axis;
  const double mean = force / (kPi * half[0] * half[1]);
  PatchRow out{{half[0], half[1]}, {}, 1.5 * mean, mean, depth};
  std::copy_n(axis.data(), 3, out.axis);
  return out;
}

}  // namespace sphshell
