// Where a cubic side enters and leaves a ball or a half-space: the roots of a polynomial.
#pragma once

#include "contact/query/closest_on_side.hpp"

namespace sphshell {

// Roots nearer than 2^-kMostRootHalvings of a side are none.
inline constexpr int kMostRootHalvings = 14;

// A polynomial of degree 6 by its Bernstein coefficients. Along a cubic side it is the square of
// the distance less that of the ball's radius, or a cubic, the height over a plane.
struct Sextic {
  double f[7];

  Sextic() = default;
  Sextic(double a, double b, double c, double d)
      : f{a,
          (a + b) / 2,
          (a + 3 * b + c) / 5,
          (a + 9 * b + 9 * c + d) / 20,
          (b + 3 * c + d) / 5,
          (c + d) / 2,
          d} {}
  Sextic(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d, double radius2)
      : f{a.dot(a),
          a.dot(b),
          (2 * a.dot(c) + 3 * b.dot(b)) / 5,
          (a.dot(d) + 9 * b.dot(c)) / 10,
          (2 * b.dot(d) + 3 * c.dot(c)) / 5,
          c.dot(d),
          d.dot(d)} {
    for (double& value : f) value -= radius2;
  }

  // The one root between the ends, by Newton's method within what is known to hold it.
  double root() const {
    // In powers of t.
    double c[7];
    std::copy_n(f, 7, c);
    // Forward differences of the Bernstein coefficients, times binomials.
    for (int n = 1; n < 7; ++n)
      for (int i = 6; i >= n; --i) c[i] -= c[i - 1];
    static constexpr double kBinomial[7] = {1, 6, 15, 20, 15, 6, 1};
    for (int i = 0; i < 7; ++i) c[i] *= kBinomial[i];
    const bool begins_inside = f[0] < 0;
    double a = 0, b = 1, t = f[0] / (f[0] - f[6]);
    for (int i = 0; i < 60 && b - a > 1e-15; ++i) {
      // Horner's rule for the value and the slope together.
      double value = c[6], slope = 0;
      for (int k = 5; k >= 0; --k) slope = slope * t + value, value = value * t + c[k];
      if (value == 0) return t;
      ((value < 0) == begins_inside ? a : b) = t;
      double next = t - value / slope;
      if (!(next > a && next < b)) next = (a + b) / 2;
      if (std::abs(next - t) < 1e-15) return next;
      t = next;
    }
    return t;
  }

  // Appends its roots between the ends in their order; at most 6.
  void roots(double begin, double end, int depth, double* out, int& count) const {
    // Descartes: as many roots as sign changes, or fewer by an even number.
    int changes = 0;
    for (int i = 0; i < 6; ++i) changes += (f[i] < 0) != (f[i + 1] < 0);
    if (changes == 0) return;
    if (changes == 1) {
      if (count < 6) out[count++] = begin + root() * (end - begin);
      return;
    }
    if (depth == kMostRootHalvings) return;
    Sextic low, high;
    halve(f, low.f, high.f);
    const double middle = (begin + end) / 2;
    low.roots(begin, middle, depth + 1, out, count);
    high.roots(middle, end, depth + 1, out, count);
  }
};

}  // namespace sphshell
