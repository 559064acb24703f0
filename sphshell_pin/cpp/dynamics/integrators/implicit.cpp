#include "dynamics/integrators/implicit.hpp"

namespace sphshell {

using pinocchio::skew;

// Of a step in a difference quotient.
constexpr double kDifference = 1e-7;

// The Jacobian of (u, w, z) in blocks: u' = w, and (w', z') from Linearization; work is no part of
// it.
void ImplicitStepper::begin(Chart& chart) {
  nv_ = chart.nv();
  nz_ = chart.nz();
  const int n = 2 * nv_ + nz_;
  Stepper::begin(chart);
  const State& from = chart.origin();
  torque_ = chart.torque_at_origin();
  linearization_.rates(from.q, from.v, from.z, torque_, rates_);
  rate_of_time_.setZero(n);
  if (chart.torques().follow_state()) linearize_torques(chart);
  if (chart.torques().follow_time()) add_time(chart);
  jacobian_.setZero(n, n);
  jacobian_.bottomRows(nv_ + nz_) = rates_;
  jacobian_.block(0, nv_, nv_, nv_).setIdentity();
  to_chart(chart);
}

// Torques come from the controller as they are; how they answer the state is differenced.
void ImplicitStepper::linearize_torques(Chart& chart) {
  const State& from = chart.origin();
  Multibody& body = chart.scene().body();
  torque_by_state_.setZero(nv_, 2 * nv_ + nz_);
  u_.setZero(nv_);
  q_.resize(from.q.size());
  for (int k = 0; k < nv_; ++k) {
    u_[k] = kDifference;
    body.integrate(from.q, u_, q_);
    u_[k] = 0;
    body.kinematics(q_, from.v);
    torque_by_state_.col(k) = (chart.torques().torque(from.t, q_, from.v) - torque_) / kDifference;
  }
  v_ = from.v;
  for (int k = 0; k < nv_; ++k) {
    const double change = kDifference * std::max(1.0, std::abs(from.v[k]));
    v_[k] += change;
    body.kinematics(from.q, v_);
    torque_by_state_.col(nv_ + k) = (chart.torques().torque(from.t, from.q, v_) - torque_) / change;
    v_[k] = from.v[k];
  }
  body.kinematics(from.q, from.v);
  // Compensated friction of joints follows the stretches of its springs.
  JointForces& joints = chart.scene().joints();
  for (int i = 0; i < joints.size(); ++i) {
    const double stretch = joints.stretch(i), change = 1e-3 * kDifference;
    joints.stretch(i) += change;
    torque_by_state_.col(2 * nv_ + chart.scene().joint_bristles() + i) =
        (chart.torques().torque(from.t, from.q, from.v) - torque_) / change;
    joints.stretch(i) = stretch;
  }
  rates_.topRows(nv_).noalias() += linearization_.inverse_mass() * torque_by_state_;
}

void ImplicitStepper::add_time(Chart& chart) {
  const State& from = chart.origin();
  const double change = 1e-5;  // forwards, as a kink may lie behind
  column_ = -1.5 * torque_;
  column_ += 2 * chart.torques().torque(from.t + change, from.q, from.v);
  column_ -= 0.5 * chart.torques().torque(from.t + 2 * change, from.q, from.v);
  column_ /= change;
  rate_of_time_.segment(nv_, nv_).noalias() = linearization_.inverse_mass() * column_;
}

// What was found for v and the tangent of q, for the coordinates of the chart.
void ImplicitStepper::to_chart(Chart& chart) {
  const VectorX& v = chart.origin().v;
  for (const CurvedSegment& s : chart.scene().body().curved()) {
    const int n = s.linear, m = s.angular, i = s.index_v, a = i + n, w = nv_ + i;
    const Mat3 spin = skew(s.angular_of(v)), linear = skew(s.linear_of(v));
    // The body sees its linear velocity turn as it turns.
    jacobian_.block(nv_, a, nv_ + nz_, m) +=
        (jacobian_.block(nv_, w, nv_ + nz_, n) * linear.topRightCorner(n, m)).eval();
    // The derivative of (rotation of a + spin x v) at u = 0, where the rotation's derivative is
    // -[ . ]x.
    jacobian_.block(w, a, n, m) +=
        (spin * linear - skew(s.linear_of(rate_, nv_))).topRightCorner(n, m);
    jacobian_.block(w, w, n, n) += spin.topLeftCorner(n, n);
    jacobian_.block(w, nv_ + a, n, m) -= linear.topRightCorner(n, m);
    jacobian_.block(a, a, m, m) = -0.5 * spin.bottomRightCorner(m, m);
  }
}

// I / (gamma h) - J: scaled so that h enters on the diagonal alone.
void ImplicitStepper::factorize(double gamma_h) {
  matrix_ = -jacobian_;
  matrix_.diagonal().array() += 1 / gamma_h;
  lu_.compute(matrix_);
}

// Right-hand sides hold no work: it is integrated by quadrature.
void ImplicitStepper::solve(VectorX& x) {
  const int n = 2 * nv_ + nz_;
  solution_ = lu_.solve(x.head(n));
  x.head(n) = solution_;
  x.tail<Chart::kWork>().setZero();
}

// (I / h - J) k = f(y) + h f_t; y + k is the end. One Newton step of the implicit Euler method.
void LinearlyImplicitEuler::step(Chart& chart, double h, State& out) {
  factorize(h);
  const int n = static_cast<int>(rate_of_time_.size());
  VectorX& change = error_;
  change = rate_;
  change.head(n) += h * rate_of_time_;
  solve(change);
  y_ = start_ + change;
  // The torque acts over the mean of both velocities.
  const int nv = chart.nv();
  y_.tail<Chart::kWork>() = start_.tail<Chart::kWork>();
  y_.tail<1>()[0] +=
      0.5 * h * chart.torque_at_origin().dot(start_.segment(nv, nv) + y_.segment(nv, nv));
  chart.finish(chart.origin().t + h, y_, out);
}

void Rodas::step(Chart& chart, double h, State& out) {
  // Coefficients of RODAS in the transformed form, which needs no product with the Jacobian.
  static constexpr double kGamma = 0.25;
  static constexpr double kNode[kStages] = {0, 0.386, 0.21, 0.63, 1, 1};
  static constexpr double kTime[kStages] = {0.25, -0.1043, 0.1035, -0.0362, 0, 0};
  static constexpr double kA[kStages][5] = {
      {},
      {1.544},
      {0.9466785280815826, 0.2557011698983284},
      {3.314825187068521, 2.896124015972201, 0.9986419139977817},
      {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950},
      {1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950, 1}};
  static constexpr double kC[kStages][5] = {
      {},
      {-5.6688},
      {-2.430093356833875, -0.2063599157091915},
      {-0.1073529058151375, -9.594562251023355, -20.47028614809616},
      {7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160},
      {8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136,
       -6.058818238834054}};
  h_ = h;
  factorize(kGamma * h);
  const double t = chart.origin().t;
  const int n = static_cast<int>(rate_of_time_.size());
  for (int i = 0; i < kStages; ++i) {
    stage_ = start_;
    for (int j = 0; j < i; ++j)
      if (kA[i][j] != 0) stage_ += kA[i][j] * g_[j];
    if (i > 0)
      chart.rate(t + kNode[i] * h, stage_, g_[i]);
    else
      g_[0] = rate_;
    for (int j = 0; j < i; ++j) g_[i] += kC[i][j] / h * g_[j];
    g_[i].head(n) += h * kTime[i] * rate_of_time_;
    solve(g_[i]);
  }
  // Stiffly accurate: the last stage's increment is the estimate of the error.
  error_ = g_[kStages - 1];
  y_ = stage_ + error_;
  chart.finish(t + h, y_, out);
}

// The powers of stiff contacts are smooth on the motion but not at the stages: Simpson's rule.
void Rodas::complete(Chart& chart, State& out) {
  const double t = chart.origin().t;
  // Two evaluations more, at the middle of the dense output and at the end.
  power_[0] = rate_.tail<Chart::kWork>();
  interpolate(0.5, middle_);
  chart.rate(t + 0.5 * h_, middle_, rate_at_stage_);
  power_[1] = rate_at_stage_.tail<Chart::kWork>();
  chart.rate(t + h_, y_, rate_at_stage_);
  power_[2] = rate_at_stage_.tail<Chart::kWork>();
  y_.tail<Chart::kWork>() += h_ / 6 * (power_[0] + 4 * power_[1] + power_[2]);
  chart.finish(t + h_, y_, out);
}

// The dense output of Hairer's code; work by the parabola through the powers.
void Rodas::interpolate(double theta, VectorX& y) const {
  static constexpr double kD[2][5] = {{10.12623508344586, -7.487995877610167, -34.80091861555747,
                                       -7.992771707568823, 1.025137723295662},
                                      {-0.6762803392801253, 6.087714651680015, 16.43084320892478,
                                       24.76722511418386, -6.594389125716872}};
  const double rest = 1 - theta;
  // Hermite-like: linear, plus a bubble with the dense output's coefficients.
  y = rest * start_ + theta * y_;
  for (int j = 0; j < 5; ++j) y += theta * rest * (kD[0][j] + theta * kD[1][j]) * g_[j];
  // The integral of the parabola through the powers.
  const double square = theta * theta / 2, cube = theta * theta * theta / 3;
  y.tail<Chart::kWork>() = start_.tail<Chart::kWork>() +
                           h_ * ((theta - 3 * square + 2 * cube) * power_[0] +
                                 4 * (square - cube) * power_[1] + (2 * cube - square) * power_[2]);
}

}  // namespace sphshell
