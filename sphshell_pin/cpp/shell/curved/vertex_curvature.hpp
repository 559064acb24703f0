// Curvature of a smooth surface at a vertex, from positions and normals around it.
#pragma once

#include "shell/topology.hpp"

namespace sphshell {

// The surface about a vertex.
struct VertexCurvature {
  static constexpr int kTerms = 17;
  using Terms = Eigen::Matrix<double, kTerms, 1>;

  Vec3 origin, east, north, normal;  // an orthonormal frame
  double scale[3];                   // of its coordinates [m]
  Terms terms;                       // of z by powers of scaled x, y and z
  // Derivatives of the height over the tangent plane: xx, xy, yy [1/m]; xxx, xxy, xyy, yyy [1/m^2].
  double second[3], third[4];

  // The curvature tensor, positive where the surface bends away from its normal, and how it changes
  // along a tangent [1/m, 1/m per unit].
  Eigen::Matrix3d tensor() const;
  Eigen::Matrix3d change(const Vec3& along) const;
  // How far the surface lies beyond a point near it, along a unit direction [m].
  double beyond(const Vec3& point, const Vec3& direction) const;
};

// A vertex around, with its normal.
struct OrientedPoint {
  Vec3 point, normal;
};

// Least squares of an implicit quadric with cubic and quartic corrections; these are held small, so
// that quadrics are exact and few neighbors suffice. Zero where nothing is around. `exact`: the
// normals are the surface's own; else only the positions count, and those beyond the nearest
// neighbors are needed as well.
VertexCurvature fit_curvature(const Vec3& origin, const Vec3& normal,
                              const std::vector<OrientedPoint>& around, bool exact);

}  // namespace sphshell
