#include "dynamics/derivatives/coordinate_derivatives.hpp"

#include <Eigen/LU>

namespace sphshell {
namespace {

using Group = CurvedSegment::Group;
using Vec2 = Eigen::Vector2d;

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

// J x is x turned by a right angle, in the plane.
const Eigen::Matrix2d& right_angle() {
  static const Eigen::Matrix2d turn = (Eigen::Matrix2d() << 0, -1, 1, 0).finished();
  return turn;
}

}  // namespace

MatrixX applied(const MatrixX& slopes, const Tangent& by, const Eigen::Ref<const MatrixX>& own) {
  const Eigen::Index nv = by.q.rows(), nz = by.z.rows();
  MatrixX out = slopes.leftCols(nv) * by.q + slopes.middleCols(nv, nv) * by.v;
  out.noalias() += slopes.middleCols(2 * nv, nz) * by.z;
  out.leftCols(own.cols()) += own;
  return out;
}

void ChartSlopes::begin(Chart& chart, const VectorX& y) {
  segments_.clear();
  const int nv = chart.nv();
  for (const CurvedSegment& one : chart.scene().body().curved()) {
    const int i = one.index_v;
    Segment& s = segments_.emplace_back();
    s.group = one.group;
    s.at = i;
    if (one.group == Group::Planar) {
      s.turn.topLeftCorner<2, 2>() = Eigen::Rotation2Dd(y[i + 2]).toRotationMatrix();
      s.u.head<2>() = y.segment<2>(i);
      s.velocity.head<2>() = s.turn.topLeftCorner<2, 2>().transpose() * y.segment<2>(nv + i);
      continue;
    }
    const int angle = one.group == Group::Rigid ? i + 3 : i;
    const Vec3 u = y.segment<3>(angle), w = y.segment<3>(nv + angle);
    const Curve curve(u.squaredNorm());
    const Mat3 cross = cross_matrix(u);
    const Vec3 once = u.cross(w);
    s.turn = rotation_of(u);
    // u' = (I + [u] / 2 + c [u]^2) w, and its derivative by u.
    s.rate_by_w = Mat3::Identity() + 0.5 * cross + curve.c * cross * cross;
    s.angle = s.rate_by_w.inverse();
    s.rate_by_u = -0.5 * cross_matrix(w) -
                  curve.c * (cross_matrix(once) + cross * cross_matrix(w)) +
                  2 * curve.slope * u.cross(once) * u.transpose();
    if (one.group == Group::Rotation) continue;
    s.u = y.segment<3>(i);
    s.velocity = s.turn.transpose() * y.segment<3>(nv + i);
  }
}

void ChartSlopes::place(const MatrixX& origin, const MatrixX& u, const MatrixX& w, MatrixX& q,
                        MatrixX& v) const {
  q = origin + u;
  v = w;
  for (const Segment& s : segments_) {
    const int i = s.at;
    if (s.group == Group::Planar) {
      const Eigen::Matrix2d back = s.turn.topLeftCorner<2, 2>().transpose();
      const Vec2 across = right_angle() * s.u.head<2>(),
                 aside = right_angle() * s.velocity.head<2>();
      q.middleRows<2>(i) = (back * (q.middleRows<2>(i) + across * origin.row(i + 2))).eval();
      v.middleRows<2>(i) = back * w.middleRows<2>(i) - aside * u.row(i + 2);
      continue;
    }
    // Changes of body frames: the chart's axes turn with the origin's change, and the body's with
    // u.
    const Mat3 back = s.turn.transpose();
    const int angle = s.group == Group::Rigid ? i + 3 : i;
    const MatrixX turned = s.angle * u.middleRows<3>(angle);
    q.middleRows<3>(angle) = back * origin.middleRows<3>(angle) + turned;
    if (s.group == Group::Rotation) continue;
    q.middleRows<3>(i) =
        (back * (q.middleRows<3>(i) - cross_matrix(s.u) * origin.middleRows<3>(i + 3))).eval();
    v.middleRows<3>(i) = back * w.middleRows<3>(i) + cross_matrix(s.velocity) * turned;
  }
}

void ChartSlopes::rates(const VectorX& acceleration, const VectorX& v, const MatrixX& u,
                        const MatrixX& w, const MatrixX& v_by, MatrixX& u_rate,
                        MatrixX& w_rate) const {
  u_rate = w;
  for (const Segment& s : segments_) {
    const int i = s.at;
    if (s.group == Group::Planar) {
      // In the chart's axes the acceleration is turn (a + spin J v).
      const Eigen::Matrix2d turn = s.turn.topLeftCorner<2, 2>(), &j = right_angle();
      const Vec2 aside = j * v.segment<2>(i), all = acceleration.segment<2>(i) + v[i + 2] * aside;
      w_rate.middleRows<2>(i) =
          (turn * (w_rate.middleRows<2>(i) + aside * v_by.row(i + 2) +
                   v[i + 2] * (j * v_by.middleRows<2>(i)) + j * all * u.row(i + 2)))
              .eval();
      continue;
    }
    const int angle = s.group == Group::Rigid ? i + 3 : i;
    u_rate.middleRows<3>(angle) =
        s.rate_by_u * u.middleRows<3>(angle) + s.rate_by_w * w.middleRows<3>(angle);
    if (s.group == Group::Rotation) continue;
    // turn (a + spin x v)
    const Vec3 linear = v.segment<3>(i), spin = v.segment<3>(i + 3);
    // Product rule over turn, acceleration, spin and velocity.
    const Vec3 all = acceleration.segment<3>(i) + spin.cross(linear);
    w_rate.middleRows<3>(i) =
        (s.turn * (w_rate.middleRows<3>(i) - cross_matrix(linear) * v_by.middleRows<3>(i + 3) +
                   cross_matrix(spin) * v_by.middleRows<3>(i) -
                   cross_matrix(all) * (s.angle * u.middleRows<3>(i + 3))))
            .eval();
  }
}

// The Lie bracket of each group: rotation v x x; rigid motion both parts; planar by the right
// angle.
void add_turning(const Multibody& body, const VectorX& v, MatrixX& matrix) {
  for (const CurvedSegment& s : body.curved()) {
    const int i = s.index_v;
    if (s.group == Group::Rotation) {
      matrix.block<3, 3>(i, i) -= cross_matrix(v.segment<3>(i));
    } else if (s.group == Group::Rigid) {
      const Mat3 spin = cross_matrix(v.segment<3>(i + 3));
      matrix.block<3, 3>(i, i) -= spin;
      matrix.block<3, 3>(i + 3, i + 3) -= spin;
      matrix.block<3, 3>(i, i + 3) -= cross_matrix(v.segment<3>(i));
    } else {
      matrix.block<2, 2>(i, i) -= v[i + 2] * right_angle();
      matrix.block<2, 1>(i, i + 2) += right_angle() * v.segment<2>(i);
    }
  }
}

}  // namespace sphshell
