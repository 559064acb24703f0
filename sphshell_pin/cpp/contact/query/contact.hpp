// One contact of a sphere with a shell.
#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace sphshell {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

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
  // Where asked for: derivative of weight * normal with respect to the sphere's center [1/m].
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
};

}  // namespace sphshell
