// What is certain of a curved element, wherever it is seen from.
#pragma once

#include "shell/shell.hpp"

namespace sphshell {

struct CubicPatch;

// Right-angled axes in the plane of a facet, in which lengths are those of the facet.
struct FacetAxes {
  Vec3 x, y;
  double a, b, c;  // corner 1 is at (a, 0), corner 2 at (b, c)

  // x along side 0, y into the facet.
  explicit FacetAxes(const Facet& facet) {
    const Vec3 first = facet.corner[1] - facet.corner[0];
    const Vec3 last = facet.corner[2] - facet.corner[0];
    a = first.norm();
    x = first / a;
    y = facet.normal.cross(x);
    b = last.dot(x), c = last.dot(y);
  }

  // From derivatives with respect to the parameters u, v.
  template <class T>
  void first(T& du, T& dv) const {
    du = du / a;
    dv = (dv - b * du) / c;
  }
  template <class T>
  void second(T& uu, T& uv, T& vv) const {
    const double p = b / a;
    vv = (vv - 2 * p * uv + p * p * uu) / (c * c);
    uv = (uv - p * uu) / (a * c);
    uu = uu / (a * a);
  }
};

// The two eigenvalues of a symmetric matrix.
struct Eigenvalues {
  double low, high;
  Eigenvalues(double xx, double xy, double yy) {
    // Mohr's circle.
    const double middle = (xx + yy) / 2, away = std::hypot((xx - yy) / 2, xy);
    low = middle - away, high = middle + away;
  }
};

// What a query reads of most cells: one cache line. Bounds on the derivatives of an element x(p)
// over its flat facet, p in its plane, with normal n; from control points, so they hold all over
// it.
struct alignas(64) CellBounds {
  float low, high;  // n . x'' along any direction [1/m]
  float sway;       // size of the part of x'' in the plane [1/m]
  float stretch;    // size of the part of x' - p' in the plane
  float slope;      // size of n . x'
  float bulge;      // the element is at most this far from its flat facet [m]
  // In the middle: x less the flat facet's, and the direction in the plane in which n . x rises.
  float offset[3], lean[3];

  // Across side k: the half-edge (3 facet + side) of the one facet there, or a code of Owned, with
  // kNotOwned where there are several.
  int beyond[3];

  // Of the second derivative of |x - c|^2 / 2, seen from a center at `height` above the plane and
  // at most `aside` from the flat facet along it.
  Eigenvalues curvature(double height, double aside) const {
    // Hessian = x'^T x' + (x - c) . x'': bounds of the metric, and of the curvature term over all
    // heights that the element may have below the center.
    const double above = height + bulge, below = height - bulge;
    const auto [least, most] = std::minmax({above * low, above * high, below * low, below * high});
    const double shortest = std::max(0.0, 1 - double(stretch));
    Eigenvalues out(0, 0, 0);
    out.low = shortest * shortest - most - (aside + bulge) * sway;
    out.high = (1 + double(stretch)) * (1 + double(stretch)) + double(slope) * slope - least +
               (aside + bulge) * sway;
    return out;
  }
};

static_assert(sizeof(CellBounds) == 64);

// From control points, in double precision, then rounded outward.
CellBounds bounds_of(const Facet& facet, const CubicPatch& patch, double bulge);

}  // namespace sphshell
