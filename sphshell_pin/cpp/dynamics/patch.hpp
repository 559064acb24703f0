// The ellipse in which two bodies touch, by Hertz's geometry (Johnson, Contact Mechanics, 4.2).
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "dynamics/contact_row.hpp"

namespace sphshell {

// Of a sphere of `radius` [m] on a plane; 0: nothing is known of the bodies. `normal`: unit.
inline PatchRow hertz_patch(double radius, const Vec3& normal, double depth, double force) {
  constexpr double kPi = 3.14159265358979323846;
  const double a =
      radius > 0 ? std::sqrt(radius * depth) : std::numeric_limits<double>::quiet_NaN();
  const Vec3 axis = normal.unitOrthogonal();
  const double mean = force / (kPi * a * a);
  PatchRow out{{a, a}, {}, 1.5 * mean, mean, depth};
  std::copy_n(axis.data(), 3, out.axis);
  return out;
}

}  // namespace sphshell
