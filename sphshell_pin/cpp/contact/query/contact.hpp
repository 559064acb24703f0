// One contact of a sphere with a shell.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>

namespace sphshell {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

// [x]: [x] y = x cross y.
inline Mat3 cross_matrix(const Vec3& x) {
  Mat3 out;
  out << 0, -x[2], x[1], x[2], 0, -x[0], -x[1], x[0], 0;
  return out;
}

enum class Method : int { Facets = 0, Elements = 1, Smooth = 2 };
enum class Feature : std::uint8_t { Face = 0, Edge = 1, Vertex = 2, Ring = 3 };

// A minimum of the distance from the sphere's center to the shell, or a saddle between two. The
// elastic energy is the sum of weight * U(depth), the force that of weight * F(depth) * normal.
struct Contact {
  Vec3 point;  // on the shell; of a ring the mean of its points, on its axis
  // From the shell to the sphere's center: a push along it. Unit; of a ring, which pushes along its
  // axis, the mean of the unit normals all around.
  Vec3 normal;
  double depth;  // radius - distance > 0 [m]
  int element;
  Feature feature;
  double weight = 1;  // -1 of a saddle, where two components of the surface in the sphere merge
  // Where asked for: derivative of weight * normal with respect to the sphere's center [1/m]; of a
  // plane, which has one normal, that of weight * point by it [m].
  Mat3 dn_dc = Mat3::Zero();
  bool rim = false;  // on the border of an open sheet: there it has no sides
  // Contacts of one group >= 0 are nearly one and are shown as one, in place of the first of them.
  int group = -1;
  // The facet that holds it, and the number of its side or corner: of shells, but for the method
  // "elements".
  int facet = -1, index = 0;
};

// The ball that a query looks at, in the shell's frame.
struct Sphere {
  Vec3 center;
  double radius;     // [m]
  double tolerance;  // round-off of a coordinate [m]

  bool reaches(const Vec3& point) const { return (center - point).squaredNorm() < radius * radius; }

  // What a Plane answers as well.
  double depth(const Vec3& point) const { return radius - (point - center).norm(); }
  // Where the depth grows, as far as the center is [m].
  Vec3 pull(const Vec3& point) const { return center - point; }
  double scale() const { return radius; }  // that shares of a length are taken of [m]
  // The second derivative of half the square of the distance is this times the metric of the
  // surface, less pull . x''. The closest point follows what moves it by follow() over that.
  static constexpr double kMetric = 1;
  double follow() const { return 1; }
  // An upper bound of the depth of a side that bulges from its chord d from the corner a.
  double bound_along(const Vec3& a, const Vec3& d, double bulge) const {
    const double t = std::clamp((center - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
    return radius + bulge - (a + t * d - center).norm();
  }
  // A sphere whose minima next to a point are about those of the probe.
  const Sphere& near_to(const Vec3&) const { return *this; }
};

// A half-space below a plane, in the shell's frame: the limit of spheres whose radius grows.
struct Plane {
  Vec3 normal;       // unit, out of the half-space; that of contacts
  double offset;     // of the plane along it [m]
  double size;       // of the shell [m]
  double tolerance;  // round-off of a coordinate [m]

  double depth(const Vec3& point) const { return offset - normal.dot(point); }
  bool reaches(const Vec3& point) const { return depth(point) > 0; }
  Vec3 pull(const Vec3&) const { return -size * normal; }  // of a center that far away
  double scale() const { return size; }
  static constexpr double kMetric = 0;
  double follow() const { return -size; }  // the normal turns, and with it the pull
  double bound_along(const Vec3& a, const Vec3& d, double bulge) const {
    return std::max(depth(a), depth(a + d)) + bulge;
  }
  Sphere near_to(const Vec3& point) const {
    const double far = 1000 * size;
    return {point - far * normal, far + depth(point), 0};
  }
};

}  // namespace sphshell
