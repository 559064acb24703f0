#include "dynamics/derivatives/coordinate_derivatives.hpp"

#include <Eigen/LU>

namespace sphshell {
namespace {

// c of u' = w + [u, w] / 2 + c [u, [u, w]], and its derivative by the square of |u|.
struct Curve {
  double c, slope;
  // 1/12 + a^2/720 + ...: the series where the closed form would cancel. Derivative of the
  // exponential map of SO(3) and its inverse.
  explicit Curve(double a2) : c(1.0 / 12 + a2 / 720), slope(1.0 / 720) {
    if (a2 < 1e-6) return;
    const double half = 0.5 * std::sqrt(a2), cot = 1 / std::tan(half), sine = std::sin(half);
    c = (1 - half * cot) / a2;
    slope = ((half / (sine * sine) - cot) / (8 * half) - c) / a2;
  }
};

}  // namespace

MatrixX applied(const Eigen::Ref<const MatrixX>& slopes, const MatrixX& by,
                const Eigen::Ref<const MatrixX>& own) {
  MatrixX out = slopes.leftCols(by.rows()) * by;
  out.leftCols(own.cols()) += own;
  return out;
}

void ChartSlopes::begin(Chart& chart, const VectorX& y) {
  segments_.clear();
  nv_ = chart.nv();
  for (const CurvedSegment& one : chart.scene().body().curved()) {
    const Vec3 u = one.angular_of(y), w = one.angular_of(y, nv_), once = u.cross(w);
    const Curve curve(u.squaredNorm());
    const Mat3 cross = cross_matrix(u), turn = rotation_of(u);
    // u' = (I + [u] / 2 + c [u]^2) w, and its derivative by u.
    const Mat3 rate_by_w = Mat3::Identity() + 0.5 * cross + curve.c * cross * cross;
    const Mat3 rate_by_u = -0.5 * cross_matrix(w) -
                           curve.c * (cross_matrix(once) + cross * cross_matrix(w)) +
                           2 * curve.slope * u.cross(once) * u.transpose();
    segments_.push_back({one, turn, rate_by_w.inverse(), rate_by_w, rate_by_u, one.linear_of(y),
                         turn.transpose() * one.linear_of(y, nv_)});
  }
}

MatrixX ChartSlopes::place(const MatrixX& origin, const MatrixX& by) const {
  MatrixX out = by;
  out.topRows(nv_) += origin.topRows(nv_);
  for (const Segment& s : segments_) {
    // Changes of body frames: the chart's axes turn with the origin's change, and the body's with
    // u.
    const int n = s.linear, m = s.angular, i = s.index_v, a = i + n;
    const Mat3 back = s.turn.transpose();
    const MatrixX turned = s.angle.bottomRightCorner(m, m) * by.middleRows(a, m);
    out.middleRows(i, n) =
        (back.topLeftCorner(n, n) *
         (out.middleRows(i, n) - cross_matrix(s.u).topRightCorner(n, m) * origin.middleRows(a, m)))
            .eval();
    out.middleRows(a, m) = back.bottomRightCorner(m, m) * origin.middleRows(a, m) + turned;
    out.middleRows(nv_ + i, n) = back.topLeftCorner(n, n) * by.middleRows(nv_ + i, n) +
                                 cross_matrix(s.velocity).topRightCorner(n, m) * turned;
  }
  return out;
}

void ChartSlopes::rates(const VectorX& acceleration, const VectorX& v, const MatrixX& by,
                        const MatrixX& state, MatrixX& out) const {
  out.topRows(nv_) = by.middleRows(nv_, nv_);
  for (const Segment& s : segments_) {
    const int n = s.linear, m = s.angular, i = s.index_v, a = i + n, w = nv_ + i;
    out.middleRows(a, m) = s.rate_by_u.bottomRightCorner(m, m) * by.middleRows(a, m) +
                           s.rate_by_w.bottomRightCorner(m, m) * by.middleRows(nv_ + a, m);
    // turn (a + spin x v)
    const Vec3 linear = s.linear_of(v), spin = s.angular_of(v);
    // Product rule over turn, acceleration, spin and velocity.
    const Mat3 all = cross_matrix(s.linear_of(acceleration) + spin.cross(linear)) * s.angle;
    out.middleRows(w, n) =
        (s.turn.topLeftCorner(n, n) *
         (out.middleRows(w, n) -
          cross_matrix(linear).topRightCorner(n, m) * state.middleRows(nv_ + a, m) +
          cross_matrix(spin).topLeftCorner(n, n) * state.middleRows(w, n) -
          all.topRightCorner(n, m) * by.middleRows(a, m)))
            .eval();
  }
}

// The Lie bracket of each group: rotation v x x; rigid motion both parts.
void add_turning(const Multibody& body, const VectorX& v, MatrixX& matrix) {
  for (const CurvedSegment& s : body.curved()) {
    const int n = s.linear, m = s.angular, i = s.index_v, a = i + n;
    const Mat3 spin = cross_matrix(s.angular_of(v));
    matrix.block(i, i, n, n) -= spin.topLeftCorner(n, n);
    matrix.block(a, a, m, m) -= spin.bottomRightCorner(m, m);
    matrix.block(i, a, n, m) -= cross_matrix(s.linear_of(v)).topRightCorner(n, m);
  }
}

}  // namespace sphshell
