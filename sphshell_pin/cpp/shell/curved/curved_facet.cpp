// One curved element: how its control points are stored, and the polynomials they make.
#include <cstring>

#include "shell/curved/curved.hpp"

namespace sphshell {

// Towards the opposite corner, so that it is tangential to the surface and leaves the side:
// derivatives of the patch by u and v, combined.
Vec3 CubicPatch::inward(int k, double t) const {
  switch (k) {
    case 0:
      return along_v(t, 0) - t * along_u(t, 0);
    case 1:
      // From side 1 (w = 0) towards corner 0: minus u and v in proportion to where one stands.
      return -((1 - t) * along_u(1 - t, t) + t * along_v(1 - t, t));
    default:
      return along_u(0, 1 - t) - (1 - t) * along_v(0, 1 - t);
  }
}

// The blossom: symmetric, affine in each argument, and the patch itself where all three are one
// (Ramshaw). Control points of any part of the patch are its values at that part's corners.
Vec3 CubicPatch::polar(const Eigen::Vector2d& p, const Eigen::Vector2d& q,
                       const Eigen::Vector2d& r) const {
  const double u = p.x(), v = p.y(), a = q.x(), b = q.y(), x = r.x(), y = r.y();
  return c00 + ((u + a + x) * c10 + (v + b + y) * c01) / 3 +
         ((u * a + u * x + a * x) * c20 + (v * b + v * y + b * y) * c02) / 3 +
         (u * (b + y) + a * (v + y) + x * (v + b)) / 6 * c11 + u * a * x * c30 + v * b * y * c03 +
         (u * a * y + u * b * x + v * a * x) / 3 * c21 +
         (u * b * y + v * a * y + v * b * x) / 3 * c12;
}

Vec3 CurvedFacet::control_offset(int k, int i) const {
  // 2^exponent, by its bits: it is far from the ends of the range.
  const std::uint64_t bits = static_cast<std::uint64_t>(exponent_[k] + 1023) << 52;
  double unit;
  std::memcpy(&unit, &bits, sizeof unit);
  Vec3 out;
  for (int axis = 0; axis < 3; ++axis) {
    const int at = 3 * i + axis;
    // The high 16 and the low 32 bits of a signed integer, times a power of two: exact.
    const std::int64_t number = std::int64_t(high_[k][at]) * (std::int64_t(1) << 32) + low_[k][at];
    out[axis] = static_cast<double>(number) * unit;
  }
  return out;
}

// Rounded to the nearest multiple of a power of two, symmetrically about zero, so that both
// directions of a side give the same numbers.
void CurvedFacet::set_side(int k, const Vec3& first, const Vec3& last) {
  const double largest = std::max(first.cwiseAbs().maxCoeff(), last.cwiseAbs().maxCoeff());
  int exponent = 0;
  if (largest > 0) std::frexp(largest, &exponent);
  exponent = std::max(exponent - 47, -1000);  // 47 bits and a sign; below, all is zero
  exponent_[k] = static_cast<std::int16_t>(exponent);
  constexpr std::int64_t kMost = (std::int64_t(1) << 47) - 1;
  const double units = std::ldexp(1.0, -exponent);  // of one meter
  for (int at = 0; at < 6; ++at) {
    const double units_off = units * (at < 3 ? first[at] : last[at - 3]);
    const auto nearest = static_cast<std::int64_t>(units_off + std::copysign(0.5, units_off));
    const std::int64_t number = std::clamp(nearest, -kMost, kMost);
    high_[k][at] = static_cast<std::int16_t>(number >> 32);
    low_[k][at] = static_cast<std::uint32_t>(number);
  }
}

// Over the six of the sides.
double CurvedFacet::largest_offset() const {
  double largest = 0;
  for (int i = 0; i < 6; ++i) largest = std::max(largest, control_offset(i / 2, i % 2).norm());
  return largest;
}

// As of a PN triangle (Vlachos et al., I3D 2001): a quarter of the sum of the side offsets; plus
// the rise.
Vec3 CurvedFacet::middle(const Facet& f) const {
  Vec3 sum = Vec3::Zero();
  for (int i = 0; i < 6; ++i) sum += 0.25 * control_offset(i / 2, i % 2);
  return sum + rise * f.normal;
}

// From Bernstein's polynomials to powers.
CubicPatch CurvedFacet::patch(const Facet& f) const {
  const Vec3 a = control_offset(0, 0), b = control_offset(0, 1);  // side 0, from corner 0 to 1
  const Vec3 c = control_offset(1, 0), d = control_offset(1, 1);
  const Vec3 e = control_offset(2, 1),
             g = control_offset(2, 0);  // side 2, seen from corner 0 as well
  const Vec3 middle =
      0.25 * a + 0.25 * b + 0.25 * c + 0.25 * d + 0.25 * g + 0.25 * e + rise * f.normal;
  CubicPatch out;
  // Offsets are from the flat element's control points, so what is linear in u and v stands apart.
  out.c00 = f.corner[0];
  out.c10 = f.corner[1] - f.corner[0] + 3 * a;
  out.c01 = f.corner[2] - f.corner[0] + 3 * e;
  out.c20 = 3 * b - 6 * a;
  out.c02 = 3 * g - 6 * e;
  out.c11 = 6 * (middle - a - e);
  out.c30 = 3 * (a - b);
  out.c03 = 3 * (e - g);
  out.c21 = 3 * (2 * a - b + c + e - 2 * middle);
  out.c12 = 3 * (2 * e - g + d + a - 2 * middle);
  return out;
}

// The four control points of the side, as powers of t.
CubicCurve CurvedFacet::side(const Facet& f, int k) const {
  const Vec3 a = control_offset(k, 0), b = control_offset(k, 1);
  return {f.corner[k], f.side(k) + 3 * a, 3 * b - 6 * a, 3 * (a - b)};
}

// The derivative of the side at its end, pointing away from the vertex: three times the first
// control vector.
Vec3 Tangents::operator[](int i) const {
  const int h = spoke_[i] / 2, f = triangle_of(h), k = side_of(h);
  const Facet& facet = (*flat_)[f];
  const CurvedFacet& curved = (*curved_)[f];
  const Vec3 d = facet.side(k);
  if (spoke_[i] % 2 == 0) return d + 3 * curved.control_offset(k, 0);
  return 3 * curved.control_offset(k, 1) - d;
}

}  // namespace sphshell
