#include "shell/cell_bounds.hpp"

#include "shell/curved.hpp"

namespace sphshell {

CellBounds bounds_of(const Facet& facet, const CubicPatch& patch, double bulge) {
  const FacetAxes axes(facet);
  const Vec3& n = facet.normal;
  static constexpr double kCorner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  double low = std::numeric_limits<double>::infinity(), high = -low, sway = 0;
  // Second derivatives of a cubic are linear: between those at the corners.
  for (const auto& [u, v] : kCorner) {
    Vec3 xx = patch.along_uu(u, v), xy = patch.along_uv(u, v), yy = patch.along_vv(u, v);
    axes.second(xx, xy, yy);
    const Eigenvalues bend(n.dot(xx), n.dot(xy), n.dot(yy));
    low = std::min(low, bend.low), high = std::max(high, bend.high);
    const auto flat = [&](const Vec3& d) { return d.squaredNorm() - n.dot(d) * n.dot(d); };
    sway = std::max(sway, flat(xx) + 2 * flat(xy) + flat(yy));
  }
  // First derivatives are quadratic: in the hull of their control points, which are the values at
  // the corners and, on the sides, twice those in the middle less the mean of those at the ends.
  Vec3 along[6][2];
  for (int i = 0; i < 6; ++i) {
    const double* p = kCorner[i % 3];
    const double* q = kCorner[(i + (i < 3 ? 0 : 1)) % 3];
    const double u = (p[0] + q[0]) / 2, v = (p[1] + q[1]) / 2;
    along[i][0] = patch.along_u(u, v), along[i][1] = patch.along_v(u, v);
  }
  double stretch2 = 0, slope2 = 0;
  for (int i = 0; i < 6; ++i) {
    Vec3 d[2];
    for (int k = 0; k < 2; ++k)
      d[k] = i < 3 ? along[i][k]
                   : Vec3(2 * along[i][k] - (along[i % 3][k] + along[(i + 1) % 3][k]) / 2);
    axes.first(d[0], d[1]);
    const double up[2] = {n.dot(d[0]), n.dot(d[1])};
    slope2 = std::max(slope2, up[0] * up[0] + up[1] * up[1]);
    const double xx = axes.x.dot(d[0]) - 1, yx = axes.y.dot(d[0]);
    const double xy = axes.x.dot(d[1]), yy = axes.y.dot(d[1]) - 1;
    stretch2 = std::max(stretch2, xx * xx + yx * yx + (xy * xy + yy * yy));
  }
  constexpr double kThird = 1.0 / 3;
  Vec3 x = patch.along_u(kThird, kThird), y = patch.along_v(kThird, kThird);
  axes.first(x, y);
  const Vec3 lean = n.dot(x) * axes.x + n.dot(y) * axes.y;
  const Vec3 flat = (facet.corner[0] + facet.corner[1] + facet.corner[2]) / 3;
  const Vec3 offset = patch.point(kThird, kThird) - flat;
  // Rounded outward.
  const auto up = [](double value) { return static_cast<float>(value + 1e-6 * std::abs(value)); };
  CellBounds out{-up(-low),
                 up(high),
                 up(std::sqrt(std::max(0.0, sway))),
                 up(std::sqrt(stretch2)) + 1e-12f,
                 up(std::sqrt(slope2)),
                 up(bulge),
                 {},
                 {},
                 {}};
  for (int k = 0; k < 3; ++k) {
    out.offset[k] = static_cast<float>(offset[k]);
    out.lean[k] = static_cast<float>(lean[k]);
  }
  return out;
}

}  // namespace sphshell
