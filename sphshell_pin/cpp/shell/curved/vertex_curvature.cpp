#include "shell/curved/vertex_curvature.hpp"

#include <Eigen/Dense>

namespace sphshell {
namespace {

// z = sum of c_i x^m y^n z^k: the quadric, then cubics, quartics, and last a tilt.
constexpr int kTerms = VertexCurvature::kTerms, kQuadric = 6, kCorrections = 9;
constexpr int kPowers[kTerms][3] = {{2, 0, 0}, {1, 1, 0}, {0, 2, 0}, {1, 0, 1}, {0, 1, 1},
                                    {0, 0, 2}, {3, 0, 0}, {2, 1, 0}, {1, 2, 0}, {0, 3, 0},
                                    {4, 0, 0}, {3, 1, 0}, {2, 2, 0}, {1, 3, 0}, {0, 4, 0},
                                    {1, 0, 0}, {0, 1, 0}};
// Weights of the squares of coefficients beside those of residuals, both of points at a unit
// distance: of what is no quadric, and of what the points do not determine.
constexpr double kCorrection = 1e-4, kUndetermined = 1e-12;
// Normals that lean more tell nothing about a height.
constexpr double kMostTilted = 0.2;

using Row = VertexCurvature::Terms;
using Square = Eigen::Matrix<double, kTerms, kTerms>;

// The terms at a point, or their derivatives by one of its coordinates.
Row terms_at(const double (&x)[3], int by = -1) {
  double power[3][5];
  for (int k = 0; k < 3; ++k) {
    power[k][0] = 1;
    for (int n = 1; n < 5; ++n) power[k][n] = power[k][n - 1] * x[k];
  }
  Row out = Row::Ones();
  for (int i = 0; i < kTerms; ++i)
    for (int k = 0; k < 3; ++k) {
      const int n = kPowers[i][k];
      out[i] *= k != by ? power[k][n] : n == 0 ? 0 : n * power[k][n - 1];
    }
  return out;
}

}  // namespace

// The shape operator: minus the second derivatives of the height, as positive curvature bends away
// from the normal.
Eigen::Matrix3d VertexCurvature::tensor() const {
  const Eigen::Matrix3d cross = second[1] * east * north.transpose();
  return -(second[0] * east * east.transpose() + cross + cross.transpose() +
           second[2] * north * north.transpose());
}

Eigen::Matrix3d VertexCurvature::change(const Vec3& along) const {
  const double x = east.dot(along), y = north.dot(along);
  const Eigen::Matrix3d cross = (third[1] * x + third[2] * y) * east * north.transpose();
  // The tangent plane turns: what annihilates the normal goes on to do so.
  const Eigen::Matrix3d bend = tensor();
  const Eigen::Matrix3d turn = normal * (bend * (bend * along)).transpose();
  return -((third[0] * x + third[1] * y) * east * east.transpose() + cross + cross.transpose() +
           (third[2] * x + third[3] * y) * north * north.transpose()) -
         turn - turn.transpose();
}

// Newton's method along the direction for the implicit surface z = terms(x, y, z).
double VertexCurvature::beyond(const Vec3& point, const Vec3& direction) const {
  double way = 0;
  const Vec3 along(east.dot(direction) / scale[0], north.dot(direction) / scale[1],
                   normal.dot(direction) / scale[2]);
  for (int i = 0; i < 3; ++i) {
    const Vec3 d = point + way * direction - origin;
    const double x[3] = {east.dot(d) / scale[0], north.dot(d) / scale[1], normal.dot(d) / scale[2]};
    const Vec3 slope(-terms.dot(terms_at(x, 0)), -terms.dot(terms_at(x, 1)),
                     1 - terms.dot(terms_at(x, 2)));
    const double rise = slope.dot(along);
    if (rise == 0) return way;
    way -= (x[2] - terms.dot(terms_at(x))) / rise;
  }
  return way;
}

VertexCurvature fit_curvature(const Vec3& origin, const Vec3& normal,
                              const std::vector<OrientedPoint>& around, bool exact) {
  VertexCurvature out{
      origin, normal.unitOrthogonal(), {}, normal, {1, 1, 1}, Row::Zero(), {0, 0, 0}, {0, 0, 0, 0}};
  out.north = normal.cross(out.east);
  if (around.empty()) return out;
  // Axes along which the points spread, each with a scale of its own: elements may be long.
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  for (const OrientedPoint& p : around) {
    const Eigen::Vector2d flat(out.east.dot(p.point - origin), out.north.dot(p.point - origin));
    spread += flat * flat.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> axes(spread / double(around.size()));
  if (!(axes.eigenvalues()[1] > 0)) return out;
  const Eigen::Vector2d long_axis = axes.eigenvectors().col(1);
  out.east = (long_axis[0] * out.east + long_axis[1] * out.north).normalized();
  out.north = normal.cross(out.east);
  const double sx = std::sqrt(axes.eigenvalues()[1]);
  const double sy = std::max(std::sqrt(std::max(axes.eigenvalues()[0], 0.0)), 1e-3 * sx);
  const double sz = std::sqrt(sx * sy);

  Square square = Square::Zero();
  Row along = Row::Zero();
  const auto add = [&](const Row& row, double value, double weight) {
    square.selfadjointView<Eigen::Lower>().rankUpdate(row, weight);
    along += weight * value * row;
  };
  for (const OrientedPoint& p : around) {
    const Vec3 d = p.point - origin;
    const double x[3] = {out.east.dot(d) / sx, out.north.dot(d) / sy, normal.dot(d) / sz};
    const double apart2 = x[0] * x[0] + x[1] * x[1];
    if (!(apart2 > 0)) continue;
    // Heights over a quadric grow with the square of the distance: with this weight far points
    // count no more than near ones.
    add(terms_at(x), x[2], 1 / (apart2 * apart2));
    const double up = normal.dot(p.normal);
    if (!exact || up < kMostTilted) continue;
    const double slope[2] = {-out.east.dot(p.normal) / up * sx / sz,
                             -out.north.dot(p.normal) / up * sy / sz};
    for (int k = 0; k < 2; ++k)
      // By implicit differentiation the slope of z is (terms_x) / (1 - terms_z).
      add(terms_at(x, k) + slope[k] * terms_at(x, 2), slope[k], 1 / apart2);
  }
  square = square.selfadjointView<Eigen::Lower>();
  square.diagonal().array() += kUndetermined * square.diagonal().maxCoeff();
  // Tikhonov's regularization: the higher terms are there only where the points ask for them.
  square.diagonal().segment<kCorrections>(kQuadric).array() += kCorrection;
  // A normal that is given is not tilted.
  if (exact) square.diagonal().tail<2>().array() += 1 / kUndetermined;
  const Row c = square.ldlt().solve(along);
  if (!c.allFinite()) return out;
  out.terms = c;
  out.scale[0] = sx, out.scale[1] = sy, out.scale[2] = sz;
  out.second[0] = 2 * c[0] * sz / (sx * sx);
  out.second[1] = c[1] * sz / (sx * sy);
  out.second[2] = 2 * c[2] * sz / (sy * sy);
  // The terms x z and y z are of third order, with z the quadratic form.
  out.third[0] = 6 * (c[6] + c[3] * c[0]) * sz / (sx * sx * sx);
  out.third[1] = 2 * (c[7] + c[3] * c[1] + c[4] * c[0]) * sz / (sx * sx * sy);
  out.third[2] = 2 * (c[8] + c[3] * c[2] + c[4] * c[1]) * sz / (sx * sy * sy);
  out.third[3] = 6 * (c[9] + c[4] * c[2]) * sz / (sy * sy * sy);
  return out;
}

}  // namespace sphshell
