// Where the distance from a point to a curved element, or to its side, is stationary.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "contact/query.hpp"
#include "shell/curved.hpp"

namespace sphshell {

// Newton's iterations end with the step after one below this, in units of the element: errors
// square.
constexpr double kSettled = 1e-7;
constexpr int kMostIterations = 20;
// A foot counts this far outside its element; what two elements claim is then told apart.
constexpr double kOverlap = 1e-9;

// The foot of x on the flat facet, moved into it: far from the element the cubic says nothing about
// the surface.
inline std::pair<double, double> start_on(const Facet& facet, const Vec3& x) {
  const Vec3 e1 = facet.corner[1] - facet.corner[0], e2 = facet.corner[2] - facet.corner[0];
  const Vec3 d = x - facet.corner[0];
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2), p = d.dot(e1), q = d.dot(e2);
  const double area2 = a * c - b * b;
  const double u = std::clamp((c * p - b * q) / area2, 0.0, 1.0);
  return {u, std::clamp((a * q - b * p) / area2, 0.0, 1.0 - u)};
}

// A foot of x on the curved element, by Newton's method on |x - p(u, v)|^2 / 2. False where it lies
// outside, or is of another kind. `convex` tells whether the distance is where the search ended.
inline bool foot_on_patch(const CubicPatch& patch, const Vec3& x, std::pair<double, double> start,
                          Stationary kind, PatchPoint& out, bool& convex) {
  auto [u, v] = start;
  bool settled = false;
  convex = false;
  for (int i = 0; i < kMostIterations && !settled; ++i) {
    const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v);
    const Vec3 r = patch.point(u, v) - x;
    const double gu = r.dot(xu), gv = r.dot(xv);
    double huu = xu.dot(xu), huv = xu.dot(xv), hvv = xv.dot(xv);
    const double fuu = huu + r.dot(patch.along_uu(u, v));
    const double fuv = huv + r.dot(patch.along_uv(u, v));
    const double fvv = hvv + r.dot(patch.along_vv(u, v));
    const double round_off = 1e-9 * huu * hvv, determined = fuu * fvv - fuv * fuv;
    convex = fuu > 0 && determined > round_off;
    // Where the distance is not convex, its first-order part is: it leads downhill all the same.
    if (kind == Stationary::Minimum ? convex : std::abs(determined) > round_off)
      huu = fuu, huv = fuv, hvv = fvv;
    const double determinant = huu * hvv - huv * huv;
    double du = -(hvv * gu - huv * gv) / determinant;
    double dv = -(huu * gv - huv * gu) / determinant;
    const double length = std::max(std::abs(du), std::abs(dv));
    if (length > 0.5) du *= 0.5 / length, dv *= 0.5 / length;
    u += du, v += dv;
    settled = length < kSettled && (convex || determined < -round_off);
    if (std::max({-u, -v, u + v - 1}) > 1) return false;
  }
  if (!settled || convex != (kind == Stationary::Minimum)) return false;
  if (std::max({-u, -v, u + v - 1}) > kOverlap) return false;
  out = {u, v, patch.point(u, v)};
  return true;
}

// The nearest place of a curved element, however ill-determined: from the best of some samples
// downhill until no step within the element leads lower.
inline PatchPoint nearest_on_patch(const CubicPatch& patch, const Vec3& x) {
  constexpr int kParts = 4;
  double u = 0, v = 0, best = (patch.point(0, 0) - x).squaredNorm();
  const auto try_at = [&](double a, double b) {
    const double distance2 = (patch.point(a, b) - x).squaredNorm();
    if (distance2 >= best) return false;
    u = a, v = b, best = distance2;
    return true;
  };
  for (int i = 0; i <= kParts; ++i)
    for (int j = 0; i + j <= kParts; ++j) try_at(double(i) / kParts, double(j) / kParts);
  for (double step = 1.0 / kParts; step > 1e-9; step /= 2)
    for (bool lower = true; lower;) {
      lower = false;
      const double a = u, b = v;
      for (const auto& [du, dv] : {std::pair(1, 0), {-1, 0}, {0, 1}, {0, -1}, {1, -1}, {-1, 1}}) {
        const double p = std::clamp(a + du * step, 0.0, 1.0);
        lower = try_at(p, std::clamp(b + dv * step, 0.0, 1.0 - p)) || lower;
      }
    }
  return {u, v, patch.point(u, v)};
}

// True where the distance from x is convex at a place that it is stationary at.
inline bool is_convex_at(const CubicPatch& patch, double u, double v, const Vec3& x) {
  const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v), r = patch.point(u, v) - x;
  const double huu = xu.dot(xu), hvv = xv.dot(xv);
  const double fuu = huu + r.dot(patch.along_uu(u, v));
  const double fuv = xu.dot(xv) + r.dot(patch.along_uv(u, v));
  const double fvv = hvv + r.dot(patch.along_vv(u, v));
  return fuu > 0 && fuu * fvv - fuv * fuv > 1e-9 * huu * hvv;
}

// How the foot of x follows it (3, 3): the second derivatives of the distance decide. Zero where
// they do not.
inline Mat3 slide_of(const CubicPatch& patch, double u, double v, const Vec3& x) {
  const Vec3 r = patch.point(u, v) - x;
  Eigen::Matrix<double, 3, 2> along;
  along << patch.along_u(u, v), patch.along_v(u, v);
  Eigen::Matrix2d second = along.transpose() * along;
  second(0, 0) += r.dot(patch.along_uu(u, v));
  second(0, 1) += r.dot(patch.along_uv(u, v));
  second(1, 0) = second(0, 1);
  second(1, 1) += r.dot(patch.along_vv(u, v));
  if (second.determinant() == 0) return Mat3::Zero();
  return along * second.inverse() * along.transpose();
}

inline Mat3 slide_of(const CubicCurve& side, double t, const Vec3& x) {
  const Vec3 along = side.tangent(t);
  const double second = along.squaredNorm() + (side.point(t) - x).dot(side.second(t));
  if (second == 0) return Mat3::Zero();
  return along * along.transpose() / second;
}

// The direction in which the distance from x falls fastest at a saddle of it.
inline Vec3 downhill(const CubicPatch& patch, const PatchPoint& at, const Vec3& x) {
  const Vec3 xu = patch.along_u(at.u, at.v), xv = patch.along_v(at.u, at.v), r = at.point - x;
  const Vec3 e1 = xu.normalized(), e2 = (xv - xv.dot(e1) * e1).normalized();
  // Second derivatives by arc length along e1 and e2.
  const double s = 1 / xu.norm(), t = -xv.dot(e1) / xv.dot(e2) * s, w = 1 / xv.dot(e2);
  const double fuu = xu.dot(xu) + r.dot(patch.along_uu(at.u, at.v));
  const double fuv = xu.dot(xv) + r.dot(patch.along_uv(at.u, at.v));
  const double fvv = xv.dot(xv) + r.dot(patch.along_vv(at.u, at.v));
  const double f11 = s * s * fuu, f12 = s * (t * fuu + w * fuv);
  const double f22 = t * t * fuu + 2 * t * w * fuv + w * w * fvv;
  const double angle = 0.5 * std::atan2(2 * f12, f11 - f22) + M_PI / 2;
  return std::cos(angle) * e1 + std::sin(angle) * e2;
}

// The parameter of a place of a side nearest to x, by Newton's method from t. False where that lies
// beyond the side's ends, or is the farthest.
inline bool foot_on_side(const CubicCurve& side, const Vec3& x, double& t) {
  bool settled = false, convex = false;
  for (int i = 0; i < kMostIterations && !settled; ++i) {
    const Vec3 tangent = side.tangent(t);
    const Vec3 r = side.point(t) - x;
    const double first = tangent.squaredNorm();
    const double full = first + r.dot(side.second(t));
    convex = full > 0;
    double step = -r.dot(tangent) / (full > 1e-3 * first ? full : first);
    settled = std::abs(step) < kSettled;
    step = std::clamp(step, -0.5, 0.5);
    t += step;
    if (t < -1 || t > 2) return false;
  }
  if (!settled || !convex || t < -kOverlap || t > 1 + kOverlap) return false;
  t = std::clamp(t, 0.0, 1.0);
  return true;
}

// The parameter of the place of a side nearest to x, its ends included.
inline double nearest_on_side(const CubicCurve& side, const Vec3& x) {
  constexpr int kParts = 4;
  double best = 0, least = (side.c0 - x).squaredNorm();
  const auto try_at = [&](double t) {
    const double distance2 = (side.point(t) - x).squaredNorm();
    if (distance2 < least) best = t, least = distance2;
  };
  for (int i = 1; i <= kParts; ++i) try_at(double(i) / kParts);
  double t = best;
  for (int i = 0; i < kMostIterations; ++i) {
    const Vec3 tangent = side.tangent(t), r = side.point(t) - x;
    const double first = tangent.squaredNorm(), full = first + r.dot(side.second(t));
    const double step = -r.dot(tangent) / (full > 1e-3 * first ? full : first);
    const double next = std::clamp(t + std::clamp(step, -0.25, 0.25), 0.0, 1.0);
    const bool settled = std::abs(next - t) < kSettled;
    t = next;
    if (settled) break;
  }
  try_at(t);
  return best;
}

}  // namespace sphshell
