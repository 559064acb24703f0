#include "contact/laws/hertz.hpp"

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

namespace sphshell {
namespace {

// Complete elliptic integrals K and E by their complementary modulus k', 0 < k' <= 1, and D =
// (K - E) / (1 - k'^2), by the arithmetic-geometric mean.
struct Elliptic {
  double k, e, d;

  explicit Elliptic(double complement) {
    // Abramowitz and Stegun 17.6: K = pi / (2 M(1, k')), and E = K (1 - sum of 2^(n-1) c_n^2).
    double a = 1, b = complement, c2 = (1 - b) * (1 + b), power = 0.5, sum = 0, sum_over = 0;
    const double m = c2;
    // The first term is m / 2, so that its share of (K - E) / m is exact for m = 0 as well.
    sum = power * c2, sum_over = power;
    for (int i = 0; i < 40 && std::abs(a - b) > 1e-16 * a; ++i) {
      const double c = 0.5 * (a - b), next = 0.5 * (a + b);
      b = std::sqrt(a * b);
      // c = (a - b) / 2 = m / (4 next) of the first step, ...: its square over m stays finite.
      power *= 2;
      c2 = c * c;
      sum += power * c2;
      sum_over += m > 0 ? power * c2 / m : 0;
      a = next;
    }
    k = M_PI / (2 * a);
    e = k * (1 - sum);
    d = k * sum_over;
  }
};

// Half axes 1 and k' at peak pressure 1 and E* = 1.
struct Ellipse {
  double A, B, depth, load;

  explicit Ellipse(double complement) {
    const Elliptic of(complement);
    // Johnson 4.26 in the form that has no cancellation as k' goes to 1, the circle.
    A = complement * of.d;
    // ((a/b)^2 E - K) / e^2 = (E - k'^2 K) / (k'^2 e^2), and E - k'^2 K = e^2 (K - D).
    B = (of.k - of.d) / complement;
    depth = complement * of.k;
    load = 2 * M_PI / 3 * complement;
  }
  // 0 for the sphere, growing with the ratio of the curvatures.
  double s() const { return std::log((A + B) * (A + B) / (4 * A * B)); }
  // From force = 4/3 (A + B)^-1/2 e^f depth^3/2 with load and depth of this ellipse.
  double f() const { return std::log(0.75 * load / (depth * std::sqrt(depth)) * std::sqrt(A + B)); }
  // From a^2 / depth, see Hertz.
  double slope() const { return (1 / (4 * depth) - 0.25 / (A + B)) / (0.5 / A - 1 / (A + B)); }
};

// f and its slope at equal steps of s; between them the cubic that has both.
struct Table {
  static constexpr double kStep = 1.0 / 16;
  static constexpr int kRows = 16 * 24 + 1;  // to B / A = 1e11
  std::array<double, kRows> f, slope;

  Table() {
    double x = 0;  // -ln k'
    for (int i = 0; i < kRows; ++i) {
      const double s = kStep * i;
      if (i == 0) {
        f[0] = 0, slope[0] = kSlopeOfSphere;
        continue;
      }
      // s rises with -ln k', so bisection inverts it; 80 halvings are below round-off.
      double low = x, high = x + 2;
      for (int n = 0; n < 80; ++n) {
        x = 0.5 * (low + high);
        (Ellipse(std::exp(-x)).s() < s ? low : high) = x;
      }
      const Ellipse at(std::exp(-x));
      f[i] = at.f(), slope[i] = at.slope();
    }
  }
  // Limit of slope() for k' = 1.
  static constexpr double kSlopeOfSphere = 1.0 / 3;
};

// Made at the first use; thread-safe by the language.
const Table& table() {
  static const Table made;
  return made;
}

}  // namespace

// Beyond the table's end, at needles of B / A = 1e11, the last row holds.
Hertz::Hertz(double trace, double determinant) {
  const Table& t = table();
  // trace = 2 (A + B), determinant = 4 A B: trace^2 / (4 determinant) = (A + B)^2 / (4 A B).
  const double s = std::max(0.0, std::log(trace * trace / (4 * determinant)));
  const double at = std::min(s / Table::kStep, Table::kRows - 1.0);
  const int i = std::min(static_cast<int>(at), Table::kRows - 2);
  // Cubic Hermite interpolation with the exact slopes: its error is of the order of the step to the
  // fourth.
  const double x = at - i, h = Table::kStep;
  const double rise = t.f[i + 1] - t.f[i], m0 = h * t.slope[i], m1 = h * t.slope[i + 1];
  const double c2 = 3 * rise - 2 * m0 - m1, c3 = m0 + m1 - 2 * rise;
  scale = 4.0 / 3 * std::sqrt(2 / trace) * std::exp(t.f[i] + x * (m0 + x * (c2 + x * c3)));
  slope = (m0 + x * (2 * c2 + 3 * x * c3)) / h;
}

// A circle of that radius on a plane has the area of the ellipse.
double ContactShape::disc_radius() const { return std::sqrt(half_axis2[0] * half_axis2[1]); }

// Both grow with the root of the depth.
Eigen::Vector2d ContactShape::half_axes(double depth) const {
  return {std::sqrt(half_axis2[0] * depth), std::sqrt(half_axis2[1] * depth)};
}

ContactShape shape_of_gap(const Eigen::Matrix3d& gap, const Eigen::Vector3d& normal, double radius,
                          Eigen::Matrix3d* slope) {
  const Eigen::Vector3d east = normal.unitOrthogonal(), north = normal.cross(east);
  const double xx = east.dot(gap * east), xy = east.dot(gap * north), yy = north.dot(gap * north);
  // Eigenvalues of a symmetric 2 by 2 matrix (Mohr's circle): mean -+ spread.
  const double mean = 0.5 * (xx + yy), half = 0.5 * (xx - yy), spread = std::hypot(half, xy);
  ContactShape out;
  out.gradient.setZero(), out.second.setZero();
  out.conformity = 1 - radius * (mean - spread);
  // A gap that hardly opens would have an infinite ellipse.
  const double least = (1 - kMostConformal) / radius;
  const double curvature[2] = {std::max(mean - spread, least), std::max(mean + spread, least)};
  const double trace = curvature[0] + curvature[1];
  const Hertz hertz(trace, curvature[0] * curvature[1]);
  out.scale = hertz.scale;
  const double angle = spread > 0 ? 0.5 * std::atan2(xy, half) : 0;  // of the larger curvature
  const Eigen::Vector3d across = std::cos(angle) * east + std::sin(angle) * north;
  // The longer half axis lies along the smaller curvature.
  out.axis = normal.cross(across);
  if (slope) slope->setZero();
  for (int i = 0; i < 2; ++i) {
    // d ln(scale) / d(curvature) = -a^2 / (4 depth)
    const double by = (2 * hertz.slope - 0.5) / trace - hertz.slope / curvature[i];
    out.half_axis2[i] = -4 * by;
    const Eigen::Vector3d& direction = i == 0 ? out.axis : across;
    // Where the curvature was limited the scale does not change with it.
    if (slope && curvature[i] > least) *slope += out.scale * by * direction * direction.transpose();
  }
  return out;
}

}  // namespace sphshell
