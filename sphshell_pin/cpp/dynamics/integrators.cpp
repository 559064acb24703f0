#include "dynamics/integrators.hpp"

namespace sphshell {
namespace {

Vec3 rotated_back(const Vec3& angle, const Vec3& x) {
  const double a = angle.norm();
  return a > 0 ? Vec3(Eigen::AngleAxisd(-a, angle / a) * x) : x;
}

using Vector6 = Eigen::Matrix<double, 6, 1>;

int size(const CurvedSegment& s) { return s.group == CurvedSegment::Group::Rigid ? 6 : 3; }

// [u, w] of the group, both in body coordinates; the first 3 components count unless it is rigid.
Vector6 bracket(CurvedSegment::Group group, const Vector6& u, const Vector6& w) {
  Vector6 out = Vector6::Zero();
  switch (group) {
    case CurvedSegment::Group::Rotation:
      out.head<3>() = u.head<3>().cross(w.head<3>());
      break;
    case CurvedSegment::Group::Rigid:
      out.head<3>() = u.tail<3>().cross(w.head<3>()) + u.head<3>().cross(w.tail<3>());
      out.tail<3>() = u.tail<3>().cross(w.tail<3>());
      break;
    case CurvedSegment::Group::Planar:
      out[0] = w[2] * u[1] - u[2] * w[1];
      out[1] = u[2] * w[0] - w[2] * u[0];
      break;
  }
  return out;
}

// Turns the velocity at q exp(u) into the rate of u.
void velocity_to_rate(const Multibody& body, const VectorX& u, VectorX& rate) {
  for (const CurvedSegment& s : body.curved()) {
    const int n = size(s);
    Vector6 x = Vector6::Zero(), w = Vector6::Zero();
    x.head(n) = u.segment(s.index_v, n);
    w.head(n) = rate.segment(s.index_v, n);
    const Vector6 once = bracket(s.group, x, w);
    const Vector6 twice = bracket(s.group, x, once);
    rate.segment(s.index_v, n) += 0.5 * once.head(n) + twice.head(n) / 12;
  }
}

}  // namespace

SemiImplicitEuler::SemiImplicitEuler(Multibody& body)
    : v_(body.model().nv), step_(body.model().nv), q_(body.model().nq) {}

void SemiImplicitEuler::step(Derivative& f, double dt, State& state, Ledger& ledger) {
  Multibody& body = f.scene().body();
  const VectorX& tau = f.torque(state.t, state.q, state.v);
  const VectorX& a = f.scene().acceleration(state.q, state.v, tau);
  v_ = state.v + dt * a;
  // A free body's linear velocity is counted in axes that turn with it. Stepping those components
  // makes it gain speed in proportion to spin^2 dt; stepping the vector itself does not.
  for (const CurvedSegment& s : body.curved()) {
    const int i = s.index_v;
    if (s.group == CurvedSegment::Group::Rigid) {
      const Vec3 spin = state.v.segment<3>(i + 3), linear = state.v.segment<3>(i);
      v_.segment<3>(i) += dt * spin.cross(linear);
    } else if (s.group == CurvedSegment::Group::Planar) {
      v_[i] -= dt * state.v[i + 2] * state.v[i + 1];
      v_[i + 1] += dt * state.v[i + 2] * state.v[i];
    }
  }
  ledger.control += 0.5 * dt * tau.dot(state.v + v_);
  step_ = dt * v_;
  body.integrate(state.q, step_, q_);
  for (const CurvedSegment& s : body.curved()) {
    const int i = s.index_v, k = s.index_q;
    if (s.group == CurvedSegment::Group::Rigid) {
      const Vec3 linear = v_.segment<3>(i), turn = step_.segment<3>(i + 3);
      const Eigen::Quaterniond old(Eigen::Map<const Eigen::Vector4d>(state.q.data() + k + 3));
      q_.segment<3>(k) = state.q.segment<3>(k) + dt * (old * linear);
      v_.segment<3>(i) = rotated_back(turn, linear);
    } else if (s.group == CurvedSegment::Group::Planar) {
      const Eigen::Vector2d linear = v_.segment<2>(i);
      const double cosine = state.q[k + 2], sine = state.q[k + 3];
      q_[k] = state.q[k] + dt * (cosine * linear.x() - sine * linear.y());
      q_[k + 1] = state.q[k + 1] + dt * (sine * linear.x() + cosine * linear.y());
      v_.segment<2>(i) = Eigen::Rotation2Dd(-step_[i + 2]) * linear;
    }
  }
  state.q.swap(q_);
  state.v.swap(v_);
}

RungeKutta4::RungeKutta4(Multibody& body)
    : u_(body.model().nv), q_(body.model().nq), v_(body.model().nv) {
  for (int i = 0; i < 4; ++i) rate_[i] = acceleration_[i] = VectorX::Zero(body.model().nv);
}

void RungeKutta4::step(Derivative& f, double dt, State& state, Ledger& ledger) {
  static constexpr double kNode[4] = {0, 0.5, 0.5, 1};
  static constexpr double kWeight[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
  Multibody& body = f.scene().body();
  for (int i = 0; i < 4; ++i) {
    if (i == 0) {
      q_ = state.q;
      v_ = state.v;
      rate_[0] = state.v;
    } else {
      u_ = kNode[i] * dt * rate_[i - 1];
      body.integrate(state.q, u_, q_);
      v_ = state.v + kNode[i] * dt * acceleration_[i - 1];
      f.contacts(q_, v_);
      rate_[i] = v_;
      velocity_to_rate(body, u_, rate_[i]);
    }
    const VectorX& tau = f.torque(state.t + kNode[i] * dt, q_, v_);
    acceleration_[i] = f.scene().acceleration(q_, v_, tau);
    const Powers& powers = f.scene().powers();
    ledger.damping += kWeight[i] * dt * powers.damping;
    ledger.friction += kWeight[i] * dt * powers.friction;
    ledger.control += kWeight[i] * dt * tau.dot(v_);
  }
  u_.setZero();
  for (int i = 0; i < 4; ++i) {
    u_ += kWeight[i] * dt * rate_[i];
    state.v += kWeight[i] * dt * acceleration_[i];
  }
  body.integrate(state.q, u_, q_);
  state.q.swap(q_);
}

}  // namespace sphshell
