// The point of a cubic side nearest to a point, for certain.
#pragma once

#include "contact/query/contact.hpp"
#include "contact/query/tolerances.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

// De Casteljau's halves of a polynomial by its n Bernstein coefficients.
template <std::size_t n>
void halve(const double (&c)[n], double (&low)[n], double (&high)[n]) {
  // Each pass leaves one coefficient of either half at its ends.
  double work[n];
  std::copy_n(c, n, work);
  for (std::size_t i = 0; i < n; ++i) {
    low[i] = work[0];
    high[n - 1 - i] = work[n - 1 - i];
    for (std::size_t j = 0; j + 1 < n - i; ++j) work[j] = (work[j] + work[j + 1]) / 2;
  }
}

// The derivative of half the square of the distance from x along a cubic side has degree 5; here by
// its Bernstein coefficients.
struct Quintic {
  double q[6];

  Quintic() = default;
  Quintic(const CubicCurve& side, const Vec3& x) {
    // b_i: Bernstein control points of the cubic x(t) - x; d_i: those of its derivative, degree 2.
    // The product of both has degree 5 and these six coefficients, weighted by binomials.
    const Vec3 b0 = side.c0 - x, d0 = side.c1, d1 = side.c1 + side.c2;
    const Vec3 d2 = side.c1 + 2 * side.c2 + 3 * side.c3;
    const Vec3 b1 = b0 + d0 / 3, b2 = b1 + d1 / 3, b3 = b2 + d2 / 3;
    q[0] = b0.dot(d0);
    q[1] = (2 * b0.dot(d1) + 3 * b1.dot(d0)) / 5;
    q[2] = (b0.dot(d2) + 6 * b1.dot(d1) + 3 * b2.dot(d0)) / 10;
    q[3] = (3 * b1.dot(d2) + 6 * b2.dot(d1) + b3.dot(d0)) / 10;
    q[4] = (3 * b2.dot(d2) + 2 * b3.dot(d1)) / 5;
    q[5] = b3.dot(d2);
    // What is round-off has no sign: a side whose end is as near as its neighborhood has many.
    const double from2 = std::max(b0.squaredNorm(), b3.squaredNorm());
    const double along2 = std::max({d0.squaredNorm(), d1.squaredNorm(), d2.squaredNorm()});
    for (double& value : q)
      // Set to zero, so that sign_changes() does not count it.
      if (value * value < kQuinticRoundOff * kQuinticRoundOff * from2 * along2) value = 0;
  }

  // At least the number of roots between the ends (Descartes), and whether the last one rises.
  std::pair<int, bool> sign_changes() const {
    int count = -1;
    bool was = false;
    for (double value : q)
      if (value != 0 && (count < 0 || (value > 0) != was)) ++count, was = value > 0;
    return {std::max(count, 0), was};
  }

  // Bernstein's form, grouped: C(5, i) s^(5 - i) t^i q_i.
  double at(double t) const {
    const double s = 1 - t, t2 = t * t, s2 = s * s;
    return s2 * s2 * (s * q[0] + 5 * t * q[1]) + 10 * s2 * t2 * (s * q[2] + t * q[3]) +
           t2 * t2 * (5 * s * q[4] + t * q[5]);
  }

  // Degree 4, of the differences of neighboring coefficients.
  double slope(double t) const {
    const double s = 1 - t, t2 = t * t, s2 = s * s;
    return 5 *
           (s2 * s2 * (q[1] - q[0]) + 4 * s2 * s * t * (q[2] - q[1]) + 6 * s2 * t2 * (q[3] - q[2]) +
            4 * s * t2 * t * (q[4] - q[3]) + t2 * t2 * (q[5] - q[4]));
  }

  // The one root of a quintic that rises through zero between the ends: Newton's method, halved
  // where it leaves the bracket.
  double rising_root() const {
    double low = 0, high = 1, t = q[0] < 0 && q[5] > 0 ? q[0] / (q[0] - q[5]) : 0.5;
    for (int i = 0; i < 60; ++i) {
      const double value = at(t), rise = slope(t);
      const double step = rise > 0 ? -value / rise : 1.0;
      if (std::abs(step) < 1e-9) return std::clamp(t + step, 0.0, 1.0);  // errors square
      (value < 0 ? low : high) = t;
      t += step;
      if (!(t > low && t < high)) t = (low + high) / 2;
    }
    return t;
  }
};

// Where on a side the distance from x is least, its ends included. Descartes' rule of signs tells
// where the derivative has no root or one; parts with more are halved until theirs are apart, or
// the distance varies by round-off only.
inline double nearest_on_side(const CubicCurve& side, const Vec3& x) {
  // A straight side: the projection, clamped.
  if (side.c2.isZero(0) && side.c3.isZero(0))
    return std::clamp((x - side.c0).dot(side.c1) / side.c1.squaredNorm(), 0.0, 1.0);
  const Quintic whole(side, x);
  const auto [changes, rises] = whole.sign_changes();
  // Falls at first and rises after one root: that is the minimum, and no end is nearer.
  if (changes == 1 && rises) return whole.rising_root();
  const auto distance2 = [&](double t) { return (side.point(t) - x).squaredNorm(); };
  double best = 0, least = distance2(0);
  const auto try_at = [&](double t) {
    const double value = distance2(t);
    if (value < least) best = t, least = value;
  };
  try_at(1);
  if (changes < 2) return best;
  struct Part {
    Quintic quintic;
    double from, width;
  };
  // A stack of parts, without heap. Each division pops one part and pushes two.
  constexpr int kMost = 64;
  Part parts[kMost];
  int count = 1;
  parts[0] = {whole, 0.0, 1.0};
  while (count > 0) {
    const Part part = parts[--count];
    const auto [roots, up] = part.quintic.sign_changes();
    if (roots == 0) continue;  // least at an end: that of the side, or of a part beside it
    if (roots == 1) {
      if (up) try_at(part.from + part.width * part.quintic.rising_root());
      continue;
    }
    // The derivative is below its largest coefficient: with that, and the part's width, the
    // distance cannot vary by more than a share of what is known.
    double steepest = 0;
    for (double value : part.quintic.q) steepest = std::max(steepest, std::abs(value));
    try_at(part.from + part.width / 2);
    if (steepest * part.width < kLevelSide * least || count + 2 > kMost || part.width < 1e-9)
      continue;
    Quintic first, second;
    halve(part.quintic.q, first.q, second.q);
    parts[count++] = {second, part.from + part.width / 2, part.width / 2};
    parts[count++] = {first, part.from, part.width / 2};
  }
  return best;
}

inline double nearest_on_side(const CubicCurve& side, const Sphere& sphere) {
  return nearest_on_side(side, sphere.center);
}

// Where it is lowest over a plane: h' rises through zero in one place, if at all.
inline double nearest_on_side(const CubicCurve& side, const Plane& plane) {
  const Vec3& n = plane.normal;
  const double h1 = n.dot(side.c1), h2 = n.dot(side.c2), h3 = n.dot(side.c3);
  const auto height = [&](double t) { return t * (h1 + t * (h2 + t * h3)); };
  const double best = height(1) < 0 ? 1 : 0, quarter = h2 * h2 - 3 * h1 * h3;
  if (!(quarter > 0)) return best;
  // Of the two forms of the root of h1 + 2 h2 t + 3 h3 t^2 that which does not cancel.
  const double root = std::sqrt(quarter), t = h2 > 0 ? -h1 / (h2 + root) : (root - h2) / (3 * h3);
  return t > 0 && t < 1 && height(t) < height(best) ? t : best;
}

}  // namespace sphshell
