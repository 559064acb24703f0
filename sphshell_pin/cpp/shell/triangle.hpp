// Closest point on a triangle, with the feature that it is on.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>

namespace sphshell {

using Vec3 = Eigen::Vector3d;

// feature: 0 the face, 1 + k the edge from corner k to the next, 4 + k the corner k.
struct ClosestPoint {
  Vec3 point;
  int feature;
};

// Voronoi regions of a triangle with the unit normal n: the plane's own half-planes decide, which
// stays accurate on needles where barycentric coordinates (Ericson 2005, 5.1.5) lose all digits.
inline ClosestPoint closest_on_triangle(const Vec3& x, const Vec3 corner[3], const Vec3& n) {
  bool inside = true;
  double best = 1e300;
  ClosestPoint out{corner[0], 4};
  for (int k = 0; k < 3; ++k) {
    const Vec3& a = corner[k];
    const Vec3 edge = corner[k == 2 ? 0 : k + 1] - a;
    const Vec3 from = x - a;
    if (n.dot(edge.cross(from)) >= 0) continue;
    inside = false;
    const double length2 = edge.squaredNorm();
    const double t = std::clamp(from.dot(edge) / length2, 0.0, 1.0);
    const Vec3 p = a + t * edge;
    const double d2 = (x - p).squaredNorm();
    if (d2 < best) {
      best = d2;
      out.point = p;
      out.feature = t <= 0 ? 4 + k : t >= 1 ? 4 + (k == 2 ? 0 : k + 1) : 1 + k;
    }
  }
  if (inside) out = {x - (x - corner[0]).dot(n) * n, 0};
  return out;
}

}  // namespace sphshell
