// The regions that contact laws integrate over: the inside of a ball, or below a plane.
#pragma once

#include "contact/laws/sextic.hpp"

namespace sphshell {

// A region is where its value is negative. `plan` says whether a part of an element, as large as
// the square root of size2 and whose bounds are these, is too large for Gauss's rules, and their
// order.
struct Range {
  double low, high;  // of the region's measure of depth: see the regions
};
struct Plan {
  bool too_large;
  int order;
};

// The inside of a ball about the origin. Bounds are on the distance from its center, and its
// square.
struct BallRegion {
  double radius, radius2;

  explicit BallRegion(double r) : radius(r), radius2(r * r) {}
  double size() const { return radius; }
  double value(const Vec3& x) const { return x.squaredNorm() - radius2; }
  const Vec3& half_gradient(const Vec3& x) const { return x; }
  Sextic along(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const {
    return Sextic(a, b, c, d, radius2);
  }
  Sphere probe() const { return {Vec3::Zero(), 0, 0}; }
  Range bounds(const Vec3 (&net)[3][4], const Vec3& middle) const {
    const Vec3 towards = (net[0][0] + net[1][0] + net[2][0]).normalized();
    Range out{middle.dot(towards), middle.squaredNorm()};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) {
        out.low = std::min(out.low, net[k][i].dot(towards));
        out.high = std::max(out.high, net[k][i].squaredNorm());
      }
    return out;
  }
  bool misses(const Range& at) const { return at.low >= radius; }
  bool holds(const Range& at) const { return at.high <= radius2; }
  // Where the pressure is analytic decides on the order.
  Plan plan(const Range& at, double size2) const {
    double size = std::sqrt(size2);
    if (at.low > 0) size = std::min(size, 2 * std::sqrt(radius2 - at.low * at.low));
    const double ratio = size / std::max(at.low, 1e-3 * size);
    return {size > at.low, ratio < 0.1    ? 3
                           : ratio < 0.25 ? 4
                           : ratio < 0.5  ? 5
                           : ratio < 0.8  ? 6
                                          : 7};
  }
};

// Below a plane through the origin. Bounds are on the height over it.
struct HalfSpace {
  Vec3 normal;
  double extent;  // of the shell [m]

  double size() const { return extent; }
  double value(const Vec3& x) const { return 2 * normal.dot(x); }
  const Vec3& half_gradient(const Vec3&) const { return normal; }
  Sextic along(const Vec3& a, const Vec3& b, const Vec3& c, const Vec3& d) const {
    return Sextic(normal.dot(a), normal.dot(b), normal.dot(c), normal.dot(d));
  }
  Plane probe() const { return {normal, 0, extent, 0}; }
  Range bounds(const Vec3 (&net)[3][4], const Vec3& middle) const {
    Range out{normal.dot(middle), normal.dot(middle)};
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 3; ++i) {
        const double height = normal.dot(net[k][i]);
        out.low = std::min(out.low, height), out.high = std::max(out.high, height);
      }
    return out;
  }
  bool misses(const Range& at) const { return at.low >= 0; }
  bool holds(const Range& at) const { return at.high <= 0; }
  // All integrands are polynomials.
  Plan plan(const Range&, double) const { return {false, 3}; }
};

}  // namespace sphshell
