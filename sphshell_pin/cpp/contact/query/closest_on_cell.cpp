#include "contact/query/closest_on_cell.hpp"

#include <Eigen/Dense>

#include "contact/query/closest_on_side.hpp"

namespace sphshell {
namespace {

using Vec2 = Eigen::Vector2d;

// Derivatives of f = |x(u, v) - c|^2 / 2 at a point of a patch (of a Plane, of the height, scaled):
// f_u = (x - c) . x_u and f_uv = x_u . x_v + (x - c) . x_uv. The fuu, fuv, fvv are the first term
// alone, the metric of the surface; huu, huv, hvv are the Hessian.
struct Expansion {
  Vec3 from;  // x - c
  double gu, gv, fuu, fuv, fvv;
  double huu, huv, hvv;

  template <class Probe>
  Expansion(const CubicPatch& patch, double u, double v, const Probe& probe)
      : from(-probe.pull(patch.point(u, v))) {
    const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v);
    gu = from.dot(xu), gv = from.dot(xv);
    fuu = xu.dot(xu), fuv = xu.dot(xv), fvv = xv.dot(xv);
    huu = Probe::kMetric * fuu + from.dot(patch.along_uu(u, v));
    huv = Probe::kMetric * fuv + from.dot(patch.along_uv(u, v));
    hvv = Probe::kMetric * fvv + from.dot(patch.along_vv(u, v));
  }

  // Positive definite, with a margin against round-off relative to the area element.
  bool convex() const { return huu > 0 && huu * hvv - huv * huv > 1e-9 * fuu * fvv; }

  // Newton's step. Where the distance is not convex, its first-order part is: it leads downhill
  // all the same.
  Vec2 step() const {
    const bool second = convex();
    const double a = second ? huu : fuu, b = second ? huv : fuv, c = second ? hvv : fvv;
    // Cramer's rule for the 2 by 2 system.
    const double determinant = a * c - b * b;
    return {-(c * gu - b * gv) / determinant, -(a * gv - b * gu) / determinant};
  }
};

const Sphere kOrigin{Vec3::Zero(), 0, 0};

// How far a parameter point is outside the triangle u, v >= 0, u + v <= 1; negative within.
double outside(double u, double v) { return std::max({-u, -v, u + v - 1}); }

// A lower bound of |x|^2 over a part of a patch: the least of its 28 coefficients in Bernstein's
// form, of degree 6.
double least2_of(const CubicPatch& patch, const Corners& corner) {
  // The square of a polynomial of degree 3 has degree 6. Its Bernstein coefficients are the
  // products of the control points, weighted by multinomial coefficients; the polynomial lies in
  // their convex hull, so the least coefficient bounds it from below. The control points of the
  // part come from the polar form (blossom) of the patch at the part's corners.
  static constexpr double kWeight3[4][4] = {{1, 3, 3, 1}, {3, 6, 3, 0}, {3, 3, 0, 0}, {1}};
  static constexpr double kFactorial[7] = {1, 1, 2, 6, 24, 120, 720};
  Vec3 net[4][4];
  double sum[7][7] = {};
  for (int i = 0; i < 4; ++i)
    for (int j = 0; i + j < 4; ++j) {
      const auto pick = [&](int n) { return corner[n < i ? 1 : n < i + j ? 2 : 0]; };
      net[i][j] = kWeight3[i][j] * patch.polar(pick(0), pick(1), pick(2));
    }
  for (int i = 0; i < 4; ++i)
    for (int j = 0; i + j < 4; ++j)
      for (int k = 0; k < 4; ++k)
        for (int l = 0; k + l < 4; ++l) sum[i + k][j + l] += net[i][j].dot(net[k][l]);
  double least = sum[0][0];
  for (int i = 0; i < 7; ++i)
    for (int j = 0; i + j < 7; ++j)
      least = std::min(
          least, sum[i][j] * kFactorial[i] * kFactorial[j] * kFactorial[6 - i - j] / kFactorial[6]);
  return least;
}

// Round-off of squares of distances, as a share.
constexpr double kSame = 4e-15;

// Global minimum of the distance over one cell by branch and bound. Bounds of the second
// derivatives over the cell (CellBounds) decide for each part whether the distance falls all over
// it (no minimum within), is convex on it (one minimum: descend) or neither (divide into four).
class CellSearch {
 public:
  CellSearch(const Facet& facet, const CurvedFacet& curved, const CellBounds& bounds, const Vec3& x,
             double radius, Nearest& out)
      : axes_(facet), patch_(curved.patch(facet)), radius_(radius), out_(out) {
    const Vec3 from = x - facet.corner[0];
    const double height = facet.normal.dot(from), side = axes_.a + std::abs(axes_.b) + axes_.c;
    // Bounds on the eigenvalues of the Hessian over the whole cell, with the farthest that a point
    // of the facet is from the center's projection.
    whole_ = bounds.curvature(height, (from - height * facet.normal).norm() + side);
    // From here on x is the origin, for the sake of round-off.
    patch_.c00 -= x;
    least_ = radius * radius;
    // Bound on the first derivatives of x by the coordinates in the facet's plane; a flat facet has
    // 1.
    steepest_ = 1 + double(bounds.stretch) + double(bounds.slope);
    bend_ = std::hypot(std::max(std::abs(bounds.low), std::abs(bounds.high)), bounds.sway);
    Vec3 uuu = 6 * patch_.c30, uuv = 2 * patch_.c21, uvv = 2 * patch_.c12, vvv = 6 * patch_.c03;
    // Third derivatives of a cubic are constant.
    twist_ = third(uuu, uuv, uvv, vvv);
    // Corners, then sides: upper bounds that are certain and spare most of the search.
    static constexpr double kCorner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    for (int k = 0; k < 3; ++k) {
      const Vec3 point = facet.corner[k] - x;
      if (point.squaredNorm() >= least_) continue;
      least_ = point.squaredNorm();
      out_ = {Feature::Vertex, k, 0.0, {kCorner[k][0], kCorner[k][1], point}};
    }
    whole2_ = least2_of(patch_, kWhole);
    level_ = nothing_below(whole2_);
    for (int k = 0; k < 3 && !level_; ++k) {
      CubicCurve side = curved.side(facet, k);
      side.c0 -= x;
      const double t = nearest_on_side(side, Vec3::Zero());
      const Vec3 point = side.point(t);
      if (point.squaredNorm() >= least_) continue;
      least_ = point.squaredNorm();
      const auto [u, v] = on_side(k, t);
      out_ = {Feature::Edge, k, t, {u, v, point}};
    }
  }

  bool run() {
    if (!level_) look_into(kWhole, 0);
    return least_ < radius_ * radius_;
  }

 private:
  // Bound on the size of the third derivatives, over the facet: the Frobenius norm, with each mixed
  // derivative counted as often as it occurs.
  double third(const Vec3& uuu, const Vec3& uuv, const Vec3& uvv, const Vec3& vvv) const {
    // d/dx = d/du / a; d/dy = (d/dv - (b / a) d/du) / c.
    const double p = axes_.b / axes_.a, a = axes_.a, c = axes_.c;
    const Vec3 yuu = (uuv - p * uuu) / c, yuv = (uvv - p * uuv) / c, yvv = (vvv - p * uvv) / c;
    const Vec3 xyy = (yuv - p * yuu) / (a * c), yyy = (yvv - 2 * p * yuv + p * p * yuu) / (c * c);
    return std::sqrt((uuu / (a * a * a)).squaredNorm() + 3 * (yuu / (a * a)).squaredNorm() +
                     3 * xyy.squaredNorm() + yyy.squaredNorm());
  }

  // One part, a triangle in parameters. All derivatives are taken in the facet's plane in meters,
  // where the bounds hold.
  void look_into(const Corners& corner, int halvings) {
    const Vec2 middle = (corner[0] + corner[1] + corner[2]) / 3;
    Expansion here(patch_, middle.x(), middle.y(), kOrigin);
    axes_.first(here.gu, here.gv);
    axes_.second(here.huu, here.huv, here.hvv);
    double reach = 0;
    for (const Vec2& p : corner) {
      const Vec2 d = p - middle;
      reach = std::max(reach, std::hypot(axes_.a * d.x() + axes_.b * d.y(), axes_.c * d.y()));
    }
    const double distance2 = here.from.squaredNorm(), distance = std::sqrt(distance2);
    const Eigenvalues bend(here.huu, here.huv, here.hvv);
    // The second derivative is x' . x' + x . x'': how much it may differ within reach.
    const double differs = (3 * steepest_ * bend_ + distance * twist_) * reach +
                           (bend_ * bend_ + steepest_ * twist_) * reach * reach;
    const double low = std::max(bend.low - differs, whole_.low);
    const double high = std::min(bend.high + differs, whole_.high);
    // By Taylor: the gradient differs from that of the middle by at most max |eigenvalue| x reach.
    const double slope = std::hypot(here.gu, here.gv);
    if (slope > std::max(high, -low) * reach) return;  // falls all over it
    // Second-order lower bound of the square of the distance on the part.
    const double bound = distance2 - 2 * slope * reach + std::min(low, 0.0) * reach * reach;
    if (bound >= least_ * (1 - kSame)) return;
    // Convex: one descent finds the minimum. At the last division what a descent finds is taken.
    if (low > 0 || halvings == kMostHalvings) return descend(middle);
    if (halvings == 0) descend(middle);  // what it finds spares parts
    if (nothing_below(halvings == 0 ? whole2_ : least2_of(patch_, corner))) return;
    // What the part in the middle finds spares the others.
    for (const Corners& part : quarters(corner)) look_into(part, halvings + 1);
  }

  // Whether nothing in a part is nearer than what is known by more than a share kLevel of the
  // depth, which changes the force by as little.
  bool nothing_below(double bound2) const {
    const double distance = std::sqrt(least_), depth = std::max(0.0, radius_ - distance);
    return bound2 >= least_ - 2 * kLevel * distance * depth;
  }

  // Damped Newton: the step is halved until the distance does not grow and the point stays inside
  // the cell. Then plain Newton refines to round-off, and is taken if it found the same minimum.
  void descend(const Vec2& start) {
    double u = start.x(), v = start.y(), now = patch_.point(u, v).squaredNorm();
    for (int i = 0; i < 3 * kMostIterations; ++i) {
      const Vec2 step = Expansion(patch_, u, v, kOrigin).step();
      double share = 1;
      for (; share > 1e-6; share /= 2) {
        const double a = u + share * step.x(), b = v + share * step.y();
        if (outside(a, b) > kOverlap) continue;
        const double there = patch_.point(a, b).squaredNorm();
        if (there > now * (1 + kSame / 10)) continue;
        u = a, v = b, now = std::min(now, there);
        break;
      }
      if (share <= 1e-6 || step.cwiseAbs().maxCoeff() < 1e-4) break;
    }
    // The last steps change the distance by less than round-off.
    CellPoint found{u, v, patch_.point(u, v)}, exact;
    if (find_minimum(patch_, kOrigin, {u, v}, exact) &&
        exact.point.squaredNorm() < now * (1 + 1e-12))
      found = exact;
    const double distance2 = found.point.squaredNorm();
    if (distance2 >= least_ * (1 - kSame)) return;
    least_ = distance2;
    out_ = {Feature::Face, 0, 0.0, found};
  }

  const Corners kWhole = {Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)};
  const FacetAxes axes_;
  CubicPatch patch_;
  Eigenvalues whole_{0, 0, 0};      // bounds on the second derivative of |x|^2 / 2
  double radius_, least_;           // least: square of the distance of out_
  double steepest_, bend_, twist_;  // bounds on the derivatives of x, over the facet
  double whole2_;                   // least2_of the whole cell
  bool level_;                      // all of it is as near as its nearest corner
  Nearest& out_;
};

}  // namespace

std::pair<double, double> on_side(int k, double t) {
  return k == 0 ? std::pair(t, 0.0) : k == 1 ? std::pair(1 - t, t) : std::pair(0.0, 1 - t);
}

// Normal equations of the projection on the plane; clamped one parameter after the other, which is
// a start for Newton's method, not the exact closest point of the triangle.
std::pair<double, double> closest_on_facet(const Facet& facet, const Vec3& x) {
  const Vec3 e1 = facet.corner[1] - facet.corner[0], e2 = facet.corner[2] - facet.corner[0];
  const Vec3 d = x - facet.corner[0];
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2), p = d.dot(e1), q = d.dot(e2);
  const double area2 = a * c - b * b;
  const double u = std::clamp((c * p - b * q) / area2, 0.0, 1.0);
  return {u, std::clamp((a * q - b * p) / area2, 0.0, 1.0 - u)};
}

// Steps are limited to half the parameter range; an iterate that is far outside (by more than the
// cell itself) has left the patch's reach and ends the search.
template <class Probe>
bool find_minimum(const CubicPatch& patch, const Probe& probe, std::pair<double, double> start,
                  CellPoint& out) {
  auto [u, v] = start;
  for (int i = 0; i < kMostIterations; ++i) {
    const Expansion here(patch, u, v, probe);
    Vec2 step = here.step();
    const double length = step.cwiseAbs().maxCoeff();
    if (length > 0.5) step *= 0.5 / length;
    u += step.x(), v += step.y();
    if (outside(u, v) > 1) return false;
    if (length >= kLastStep || !here.convex()) continue;
    if (outside(u, v) > kOverlap) return false;
    out = {u, v, patch.point(u, v)};
    return true;
  }
  return false;
}

bool find_nearest(const Facet& facet, const CurvedFacet& curved, const CellBounds& bounds,
                  const Vec3& x, double radius, Nearest& out) {
  if (!CellSearch(facet, curved, bounds, x, radius, out).run()) return false;
  out.at.point += x;
  return true;
}

// By the implicit function theorem: the closest point solves f_u = f_v = 0, so d(u, v)/dc = H^-1
// [x_u x_v]^T, and dx/dc = [x_u x_v] H^-1 [x_u x_v]^T, with H the Hessian of half the square.
template <class Probe>
Mat3 dx_dc_of(const CubicPatch& patch, double u, double v, const Probe& probe) {
  const Expansion here(patch, u, v, probe);
  Eigen::Matrix<double, 3, 2> along;
  along << patch.along_u(u, v), patch.along_v(u, v);
  Eigen::Matrix2d second;
  second << here.huu, here.huv, here.huv, here.hvv;
  if (second.determinant() == 0) return Mat3::Zero();
  return probe.follow() * (along * second.inverse() * along.transpose());
}

// The same in one dimension: x' x'^T / (|x'|^2 + (x - c) . x'').
template <class Probe>
Mat3 dx_dc_of(const CubicCurve& side, double t, const Probe& probe) {
  const Vec3 along = side.tangent(t);
  const double second =
      Probe::kMetric * along.squaredNorm() - probe.pull(side.point(t)).dot(side.second(t));
  if (second == 0) return Mat3::Zero();
  return probe.follow() * (along * along.transpose() / second);
}

using Start = std::pair<double, double>;
template bool find_minimum(const CubicPatch&, const Sphere&, Start, CellPoint&);
template bool find_minimum(const CubicPatch&, const Plane&, Start, CellPoint&);
template Mat3 dx_dc_of(const CubicPatch&, double, double, const Sphere&);
template Mat3 dx_dc_of(const CubicPatch&, double, double, const Plane&);
template Mat3 dx_dc_of(const CubicCurve&, double, const Sphere&);
template Mat3 dx_dc_of(const CubicCurve&, double, const Plane&);

}  // namespace sphshell
