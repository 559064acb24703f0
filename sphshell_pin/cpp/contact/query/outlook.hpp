// Which features of a curved element may hold a minimum of the distance, from bounds alone.
#pragma once

#include "contact/query/contact.hpp"
#include "contact/query/tolerances.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

// Where a cell may hold a minimum, by the center's position over its facet and the slope of the
// distance in its middle.
struct Outlook {
  int facet;
  double height = 0;    // of the center above the facet's plane [m]
  bool within = false;  // the distance may be stationary within the cell,
  bool side[3] = {};    // ... least on side k,
  bool corner[3] = {};  // ... or in corner k
  bool convex = false;  // it is convex all over the cell

  // What is left out is certain to hold no minimum, by two tests: by the cone of normals the
  // projection of the center must be near the feature; by the gradient at the middle and bounds of
  // the second derivatives the distance must be able to stop falling there.
  Outlook(int f, const Facet& at, const NormalCone& cone, const CellBounds& bounds,
          const Sphere& sphere)
      : facet(f), height(at.normal.dot(sphere.center - at.corner[0])) {
    const double bulge = bounds.bulge;
    // The center stands over a minimum along a normal that leans at most by the opening, so its
    // projection falls within `lean` of the feature that holds the minimum.
    const double lean =
        cone.tan_opening >= kAnyOpening
            ? std::numeric_limits<double>::infinity()
            : bulge + sphere.tolerance + (std::abs(height) + bulge) * cone.tan_opening;
    Vec3 edge[3];
    double length2[3], across[3];  // across: of the center, from side k inward, times its length
    bool near_side[3];
    for (int k = 0; k < 3; ++k) {
      edge[k] = at.side(k);
      across[k] = at.normal.dot(edge[k].cross(sphere.center - at.corner[k]));
      length2[k] = edge[k].squaredNorm();
      // Beyond side k by more than the lean: the element holds no minimum at all.
      const bool far = across[k] * across[k] > lean * lean * length2[k];
      if (far && across[k] < 0) return;
      near_side[k] = !far || across[k] < 0;
    }
    // Half the square of the distance falls towards `descent` in the middle, and elsewhere by
    // what differs from it no more than its second derivative makes of the way there.
    const Vec3 aside = sphere.center - at.middle() - height * at.normal;
    // How far the element's middle is from that of its flat facet.
    const Vec3 offset(bounds.offset[0], bounds.offset[1], bounds.offset[2]);
    const double raised = offset.dot(at.normal), size = aside.norm(), reach = cone.reach;
    const Vec3 descent = aside - (offset - raised * at.normal) +
                         (height - raised) * Vec3(bounds.lean[0], bounds.lean[1], bounds.lean[2]);
    const Eigenvalues bend = bounds.curvature(height, size + reach);
    convex = bend.low > kConvex;
    // Half a unit in the last place of the numbers in single precision.
    constexpr double kSingle = 1e-7;
    const double differs = std::max(bend.high, -bend.low) * reach +
                           bounds.stretch * (size + bulge) + kSingle * (std::abs(height) + bulge) +
                           sphere.tolerance;
    within = descent.squaredNorm() <= differs * differs;
    bool forward[3], backward[3];  // along side k the distance may not fall; nor back along it
    for (int k = 0; k < 3; ++k) {
      // Compared with products that hold the side's length, squared.
      const double limit2 = differs * differs * length2[k];
      const double along = descent.dot(edge[k]), inward = at.normal.dot(edge[k].cross(descent));
      const bool steep = along * along > limit2;
      forward[k] = !steep || along < 0, backward[k] = !steep || along > 0;
      side[k] = near_side[k] && !steep && (inward < 0 || inward * inward <= limit2);
    }
    for (int k = 0; k < 3; ++k)
      corner[k] = near_side[k] && near_side[previous_corner(k)] && forward[k] &&
                  backward[previous_corner(k)];
  }

  // The same over a plane, where the height is a cubic: Bernstein's coefficients of its slopes
  // bound them, and its second derivatives, which are linear, are positive all over where they
  // are at the corners. By `slack`, a slope, regions of features overlap.
  Outlook(int f, const CubicPatch& p, const Plane& plane, double slack) : facet(f), convex(true) {
    const Vec3& n = plane.normal;
    const double a = n.dot(p.c10), b = n.dot(p.c01), aa = n.dot(p.c20), ab = n.dot(p.c11) / 2;
    const double bb = n.dot(p.c02), aaa = n.dot(p.c30), aab = n.dot(p.c21), abb = n.dot(p.c12);
    const double bbb = n.dot(p.c03);
    // By u and by v: at the corners, and between corner k and the next.
    const double u[3] = {a, a + 2 * aa + 3 * aaa, a + 2 * ab + abb};
    const double v[3] = {b, b + 2 * ab + aab, b + 2 * bb + 3 * bbb};
    const double mid_u[3] = {a + aa, a + aa + ab + aab, a + ab};
    const double mid_v[3] = {b + ab, b + bb + ab + abb, b + bb};
    const double uu[3] = {aa, aa + 3 * aaa, aa + aab}, vv[3] = {bb, bb + abb, bb + 3 * bbb};
    const double uv[3] = {ab, ab + aab, ab + abb};
    static constexpr double kAlong[3][2] = {{1, 0}, {-1, 1}, {0, -1}};
    double down_u = 0, down_v = 0, least = 1, first[3], last[3];
    for (int k = 0; k < 3; ++k) down_u += u[k] + 2 * mid_u[k], down_v += v[k] + 2 * mid_v[k];
    for (int k = 0; k < 3; ++k) {
      const auto [x, y] = kAlong[k];
      const int next = next_corner(k);
      const double between = x * mid_u[k] + y * mid_v[k];
      first[k] = x * u[k] + y * v[k], last[k] = x * u[next] + y * v[next];
      side[k] = std::min(first[k], between) < slack && std::max(between, last[k]) > -slack;
      convex = convex && uu[k] > 0 && uu[k] * vv[k] > uv[k] * uv[k];
      least =
          std::min({least, down_u * u[k] + down_v * v[k], down_u * mid_u[k] + down_v * mid_v[k]});
    }
    within = !(least > 0);
    for (int k = 0; k < 3; ++k) corner[k] = first[k] > -slack && last[previous_corner(k)] < slack;
  }

  bool empty() const {
    return !(within || side[0] || side[1] || side[2] || corner[0] || corner[1] || corner[2]);
  }
};

}  // namespace sphshell
