// The elastic foundation over one flat facet, in closed form.
#pragma once

#include <cmath>

#include "contact/query/contact.hpp"

namespace sphshell {

// Integrals over a piece of the shell inside the ball, for a foundation of 1 Pa/m, with n the
// normal by winding, x relative to the ball's center, rho = |x| and p = (R^2 - rho^2) / (2 rho).
struct FoundationSum {
  Vec3 force = Vec3::Zero();  // of p n
  double energy = 0;          // of (R^2 - rho^2)^2 / 8 (-x . n) / rho^3
  double pressure = 0;        // of p
  Vec3 first = Vec3::Zero();  // of p x
  Mat3 slope = Mat3::Zero();  // derivative of the force with respect to the center

  void add(const FoundationSum& other) {
    force += other.force, energy += other.energy, pressure += other.pressure;
    first += other.first, slope += other.slope;
  }
};

// Sectors round the foot of the center over the facet's plane, one for each side and with its sign:
// along a radius rho d(rho) = r dr, so that p r dr is a polynomial in rho; what is left is a line
// integral along the part of the side inside the ball, and an angle for what is outside. P and Q
// are the radial integrals of p and of the energy from rho to R. False where the ball misses it.
inline bool add_flat_facet(const Vec3 (&corner)[3], const Vec3& n, double radius,
                           FoundationSum& sum) {
  const double R = radius, R2 = R * R, R3 = R2 * R, R4 = R2 * R2;
  // The center is at the origin, at the signed height h over the plane.
  const double h = -n.dot(corner[0]), H = std::abs(h), side = h < 0 ? -1.0 : 1.0;
  // The plane does not meet the ball.
  if (!(H < R)) return false;
  double around = 0, round_in = 0, t_in = 0, i1 = 0, i3 = 0;
  Vec3 first = Vec3::Zero(), slope = Vec3::Zero();
  bool meets = false;
  for (int k = 0; k < 3; ++k) {
    const Vec3 &p = corner[k], &q = corner[k == 2 ? 0 : k + 1];
    // In the plane, from the foot of the center: e, distance of the side's line, positive with the
    // foot inside; begin and end, places along it.
    const Vec3 along = (q - p).normalized();
    const Vec3 inward = n.cross(along);
    const double e = -p.dot(inward), begin = p.dot(along), end = q.dot(along);
    // The angle that a piece of the side is seen under from the foot, with its sign.
    const auto angle = [&](double a, double b) {
      return e == 0 ? 0.0 : std::atan2(e * (b - a), e * e + a * b);
    };
    around += angle(begin, end);
    // Half the chord that the ball cuts from the line: sqrt(R^2 - k2), k2 the square of its
    // distance from the center.
    const double k2 = H * H + e * e, reach2 = R2 - k2;
    if (!(reach2 > 0)) continue;
    // From a to b the side is inside the ball.
    const double reach = std::sqrt(reach2);
    const double a = std::max(begin, -reach), b = std::min(end, reach);
    if (!(a < b)) continue;
    meets = true;
    // Along the side y: rho = sqrt(k2 + y^2). l0, l1, l3: the integrals of dy / rho, rho dy, rho^3
    // dy; t: the solid-angle term of the same piece; one: of rho dphi, i3: of rho^3 dphi.
    const double rho_a = std::sqrt(k2 + a * a), rho_b = std::sqrt(k2 + b * b);
    const double root = std::sqrt(k2);
    const double l0 = root > 0 ? std::asinh(b / root) - std::asinh(a / root) : 0;  // of dy / rho
    const double l1 = (b * rho_b - a * rho_a + k2 * l0) / 2;                       // of rho dy
    const double l3 = (b * rho_b * rho_b * rho_b - a * rho_a * rho_a * rho_a) / 4 + 0.75 * k2 * l1;
    const double t =
        e == 0 ? 0.0
               : std::atan2(H * e * (b * rho_a - a * rho_b), e * e * rho_a * rho_b + H * H * a * b);
    const double one = e * l0 + H * t;
    round_in += angle(a, b);
    t_in += t;
    i1 += one;
    i3 += e * l1 + H * H * one;
    first += inward * ((2 * R3 * (b - a) / 3 - R2 * l1 + l3 / 3) / 2);
    slope += inward * ((R2 * l0 - l1) / 2);
  }
  // The foot is inside the facet where the angles make a turn.
  if (!meets && !(around > M_PI)) return false;
  // Twice the integral of p r dr from the foot to the ball's circle, per angle.
  const double P = (R - H) * (R - H) * (2 * R + H) / 3;
  const double hQ = side * (R - H) * (R - H) * (R - H) * (3 * R + H) / 3;
  // Sectors out to the ball's circle, less what is beyond the pieces of the sides in the ball.
  const double pressure = (P * around - (2 * R3 * round_in / 3 - R2 * i1 + i3 / 3)) / 2;
  const double stiffness = side * (R2 * t_in - (R2 - H * H) * around) - h * i1;
  sum.force += pressure * n;
  sum.energy +=
      (hQ * around - side * R4 * t_in + h * (8 * R3 * round_in / 3 - 2 * R2 * i1 + i3 / 3)) / 8;
  sum.pressure += pressure;
  sum.first += first - h * pressure * n;
  sum.slope += n * (slope + stiffness / 2 * n).transpose();
  return true;
}

}  // namespace sphshell
