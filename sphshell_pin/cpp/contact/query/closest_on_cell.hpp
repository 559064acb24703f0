// The point of a curved element, a cell, nearest to a point, and how it follows that point.
#pragma once

#include "contact/query/contact.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

// A point of a cell by its parameters.
struct CellPoint {
  double u, v;
  Vec3 point;
};

// The closest point of a cell: within it, on a side or in a corner.
struct Nearest {
  Feature feature;
  int index;  // of the side or corner
  double t;   // along the side
  CellPoint at;
};

// A triangle in the parameters, divided into four similar ones by the middles of its sides: the
// part in the middle first.
using Corners = std::array<Eigen::Vector2d, 3>;
inline std::array<Corners, 4> quarters(const Corners& c) {
  const Eigen::Vector2d a = (c[0] + c[1]) / 2, b = (c[1] + c[2]) / 2, d = (c[2] + c[0]) / 2;
  return {Corners{a, b, d}, Corners{c[0], a, d}, Corners{a, c[1], b}, Corners{d, b, c[2]}};
}

// The parameters u, v at t on side k.
std::pair<double, double> on_side(int k, double t);

// The closest point on the flat facet, moved into it, as parameters.
std::pair<double, double> closest_on_facet(const Facet& facet, const Vec3& x);

// The minimum of the distance from a Sphere's center, or of the height over a Plane, that Newton's
// method finds from `start`. False where it lies outside the cell, or where there is none.
template <class Probe>
bool find_minimum(const CubicPatch& patch, const Probe& probe, std::pair<double, double> start,
                  CellPoint& out);

// The closest point of a cell whatever its shape: least on its sides, for certain, and within it,
// where it is divided until the distance is convex on a part, or no point of a part can be closest.
// False where none is nearer than `radius`.
bool find_nearest(const Facet& facet, const CurvedFacet& curved, const CellBounds& bounds,
                  const Vec3& x, double radius, Nearest& out);

// How the closest point follows the center (3, 3), or the lowest one the plane's normal: the second
// derivatives of the distance decide. Zero where they do not. u, v and t are those of that point.
template <class Probe>
Mat3 dx_dc_of(const CubicPatch& patch, double u, double v, const Probe& probe);
template <class Probe>
Mat3 dx_dc_of(const CubicCurve& side, double t, const Probe& probe);

}  // namespace sphshell
