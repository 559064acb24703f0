// Where a sphere touches a shell, without a robot.
#pragma once

#include "sphshell_pin/owned.hpp"
#include "sphshell_pin/shell.hpp"

namespace sphshell_pin {

/// Facets: each true feature of the polyhedron once. Elements: every touched element by itself, as
/// ADAMS's SPHSHL3. Smooth: elements curved to meet the vertex normals, a connected piece of
/// surface inside the sphere once.
enum class Method { Facets = 0, Elements = 1, Smooth = 2 };

enum class Feature { Face = 0, Edge = 1, Vertex = 2, Ring = 3 };

/// A place where the sphere touches, in the shell's frame.
struct Contact {
  Eigen::Vector3d point;  ///< on the shell [m]
  /// Unit, from the shell to the sphere's center: a push along it. Of a ring the mean all around.
  Eigen::Vector3d normal;
  double depth;  ///< radius less distance, > 0 [m]
  int element;   ///< its number in the elements that the shell was made of
  Feature feature;
  double weight;  ///< 1; -1 of a saddle, where two pieces of surface in the sphere merge
};

/// Where the surface is nearest to a point, in the shell's frame.
struct ClosestPoint {
  Eigen::Vector3d point;   ///< [m]
  Eigen::Vector3d normal;  ///< unit, on the outer side by the winding
  double distance;         ///< [m], negative behind the surface
  int element;
};

/// The scratch of queries: one per thread.
class SPHSHELL_PIN_API Query {
 public:
  Query();

  /// Every place where a sphere touches, deepest first; valid until the next call.
  /// @param center of the sphere, in the shell's frame [m]
  /// @param radius of the sphere [m]
  /// @throws InvalidParameter unless the center is finite, the radius positive and the method known
  const std::vector<Contact>& contacts(const Shell& shell, const Eigen::Vector3d& center,
                                       double radius, Method method = Method::Smooth);

  /// Of the last contacts(), those whose forces are to be added: the force on the sphere is the sum
  /// of weight * F(depth) * normal. Contacts that are nearly one are one in contacts(), but several
  /// here. Valid until the next call.
  const std::vector<Contact>& terms() const;

  /// @param point in the shell's frame [m]
  /// @param method Smooth: on the curved elements, else on the flat ones
  /// @throws InvalidParameter unless the point is finite and the method known
  ClosestPoint closest_point(const Shell& shell, const Eigen::Vector3d& point,
                             Method method = Method::Smooth);

 private:
  struct Impl;
  Owned<Impl> impl_;
};

}  // namespace sphshell_pin
