#include "dynamics/derivatives/step_derivatives.hpp"

#include <Eigen/LU>

#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

// Of central differences of torques, relative to the larger of 1 and the number.
constexpr double kTorqueDifference = 1e-7;
// Changes over a step and over its halves agree to this share of the largest, in contact and out of
// it, or are taken as they are after so many halvings.
constexpr double kAgreed = 1e-6, kAgreedFree = 1e-9;
constexpr int kMostHalvings = 16;
// Smaller changes of positions [m or rad] and velocities, of stretches [m], count as these, where a
// parameter changes by all of itself.
constexpr double kLeast = 1e-6, kLeastStretch = 1e-9;
// A step ends just behind its event, where the slopes may jump: those before it count.
constexpr double kLastNode = 1 - 1e-5;

StepSlopes::StepSlopes(SceneData& scene, std::vector<Parameter> parameters)
    : scene_(scene), linearization_(scene) {
  linearization_.set_parameters(std::move(parameters));
}

void StepSlopes::carry(Chart& chart, const Stepper& stepper, double h, const MatrixX& torque,
                       MatrixX& changes, double share) {
  const MatrixX from = changes;
  origin_ = &from, torque_ = &torque;
  if (share < 1)
    along(chart, stepper, h, share, changes);
  else
    stepper.carry(*this, chart, h, changes);
  origin_ = nullptr, torque_ = nullptr;
}

// At the origin u is zero whatever the origin is: its change is that of the chart itself.
MatrixX StepSlopes::at_origin() const {
  MatrixX out = *origin_;
  out.topRows(torque_->rows()).setZero();
  return out;
}

// From coordinates of the chart to changes of the state.
MatrixX StepSlopes::finish(Chart& chart, const VectorX& y, const MatrixX& by) {
  chart_slopes_.begin(chart, y);
  return chart_slopes_.place(*origin_, by);
}

// Evaluates the scene at state_: v' by (u, v, z), with what the controller's torques add through
// the inverse inertia.
void StepSlopes::linearize(Chart& chart, double t) {
  Torques& torques = chart.torques();
  follows_ = torques.follow_state();
  if (follows_) {
    const TorqueAt at = [&](double time, const VectorX& q, const VectorX& v) -> const VectorX& {
      return torques.torque(time, q, v);
    };
    torque_slopes(at, t, state_.q, state_.v, state_.z);
  }
  scene_.evaluate(state_.q, state_.v, state_.z);
  tau_ = torques.torque(t, state_.q, state_.v);
  linearization_.rates(state_.q, state_.v, state_.z, tau_, jacobian_);
  if (follows_)
    jacobian_.topRows(tau_.size()).noalias() += linearization_.inverse_mass() * torque_slopes_;
}

void StepSlopes::torque_slopes(const TorqueAt& torque, double t, const VectorX& q, const VectorX& v,
                               const VectorX& z) {
  const Eigen::Index nv = v.size();
  torque_slopes_.setZero(nv, 2 * nv + z.size());
  q_ = q, v_ = v, z_ = z;
  u_.setZero(nv);
  scene_.evaluate(q, v, z, true);
  const VectorX rates = scene_.bristle_rates(), here = torque(t, q, v);
  const std::size_t contacts = scene_.active().size();
  // Torques may jump where a contact begins or ends: they are differenced on this side of it.
  // Central; where the set of contacts changes on one side, one-sided. move(sign) makes a step and
  // returns its length, move(0) takes it back.
  const auto difference = [&](auto&& column, const auto& move) {
    VectorX sum = VectorX::Zero(nv);
    double span = 0;
    for (const double sign : {1.0, -1.0}) {
      const double step = move(sign);
      scene_.evaluate(q_, v_, z_, true);
      if (scene_.active().size() != contacts) continue;
      sum += sign * (torque(t, q_, v_) - here);
      span += step;
    }
    move(0.0);
    if (span > 0) column = sum / span;
  };
  for (Eigen::Index k = 0; k < nv; ++k) {
    difference(torque_slopes_.col(k), [&](double sign) {
      u_[k] = sign * kTorqueDifference;
      scene_.body().integrate(q, u_, q_);
      u_[k] = 0;
      return kTorqueDifference;
    });
    q_ = q;
    const double step = kTorqueDifference * std::max(1.0, std::abs(v[k]));
    difference(torque_slopes_.col(nv + k), [&](double sign) {
      v_[k] = v[k] + sign * step;
      return step;
    });
  }
  // Slots without a contact change nothing; stretches are short.
  for (Eigen::Index k = 0; k < z.size(); ++k)
    if (rates[k] != 0)
      difference(torque_slopes_.col(2 * nv + k), [&](double sign) {
        constexpr double kStep = 1e-3 * kTorqueDifference;
        z_[k] = z[k] + sign * kStep;
        return kStep;
      });
  // What a controller makes of forces that the parameters change at a held state.
  q_ = q, v_ = v, z_ = z;
  const std::vector<Parameter>& parameters = linearization_.parameters();
  torque_by_parameters_.setZero(nv, static_cast<Eigen::Index>(parameters.size()));
  for (std::size_t c = 0; c < parameters.size(); ++c) {
    const Parameter& one = parameters[c];
    const Pair kept = scene_.pairs()[one.pair];
    difference(torque_by_parameters_.col(c), [&](double sign) {
      const auto [pair, step] =
          sign == 0 ? std::pair(kept, 0.0) : one.changed(kept, sign, kTorqueDifference);
      scene_.exchange(one.pair, pair);
      return step;
    });
  }
  scene_.evaluate(q, v, z, true);
  if (torque(t, q, v) != here) remembers_ = true;
}

MatrixX StepSlopes::own_rates() const {
  const MatrixX &by = linearization_.by_parameters(), &inverse_mass = linearization_.inverse_mass();
  MatrixX out = MatrixX::Zero(by.rows(), torque_->cols());
  out.leftCols(by.cols()) = by;
  out.topRows(torque_->rows()).noalias() += inverse_mass * *torque_;
  if (follows_)
    out.topLeftCorner(torque_->rows(), by.cols()).noalias() += inverse_mass * torque_by_parameters_;
  return out;
}

MatrixX StepSlopes::rates(Chart& chart, double t, const VectorX& y, const MatrixX& by) {
  chart.finish(t, y, state_);
  linearize(chart, t);
  const MatrixX at = finish(chart, y, by);
  MatrixX out(by.rows(), by.cols());
  out.bottomRows(jacobian_.rows()) = applied(jacobian_, at, own_rates());
  scene_.evaluate(state_.q, state_.v, state_.z);
  y_ = scene_.acceleration(state_.q, state_.v, tau_);
  chart_slopes_.rates(y_, state_.v, by, at, out);
  return out;
}

// At the positions of the origin, which change by its change, with the velocity v, which changes by
// v_by.
MatrixX StepSlopes::bristle_rates(Chart& chart, const VectorX& v, const MatrixX& v_by) {
  const State& from = chart.origin();
  scene_.evaluate(from.q, v, from.z);
  linearization_.rates(from.q, v, from.z, tau_, jacobian_);
  MatrixX at = *origin_;
  at.middleRows(v.size(), v.size()) = v_by;
  return applied(jacobian_.bottomRows(chart.nz()), at,
                 linearization_.by_parameters().bottomRows(chart.nz()));
}

// Errors are measured in units of the parameters: each column times its scale.
void StepSlopes::along(Chart& chart, const Stepper& stepper, double h, double share, MatrixX& out) {
  const std::vector<Parameter>& parameters = linearization_.parameters();
  scales_.setOnes(out.cols());
  for (std::size_t c = 0; c < parameters.size(); ++c) scales_[c] = parameters[c].scale;
  follow({chart, stepper, h}, 0, share, 0, out);
}

// Halves are taken until they agree: in free flight a body may turn far in a step; where friction
// begins to slip, or a law is clamped, the derivatives of the rates jump within one.
void StepSlopes::follow(const Path& path, double from, double to, int depth, MatrixX& changes) {
  // One step of Radau's method against two of half the length.
  MatrixX once = changes;
  const bool touching = radau(path, from, to, once);
  if (depth >= kMostHalvings) {
    changes = once;
    return;
  }
  const double middle = 0.5 * (from + to);
  MatrixX twice = changes;
  radau(path, from, middle, twice);
  radau(path, middle, to, twice);
  const Eigen::Index nv = path.chart.nv(), nz = path.chart.nz();
  const MatrixX error = (once - twice) * scales_.asDiagonal(), all = twice * scales_.asDiagonal();
  const auto off = [&](Eigen::Index first, Eigen::Index count, double least) {
    if (count == 0) return 0.0;
    const double size = all.middleRows(first, count).cwiseAbs().maxCoeff();
    return error.middleRows(first, count).cwiseAbs().maxCoeff() / std::max(size, least);
  };
  if (std::max({off(0, nv, kLeast), off(nv, nv, kLeast), off(2 * nv, nz, kLeastStretch)}) >
      (touching ? kAgreed : kAgreedFree)) {
    follow(path, from, middle, depth + 1, changes);
    follow(path, middle, to, depth + 1, changes);
  } else {
    changes = twice;
  }
}

bool StepSlopes::radau(const Path& path, double from, double to, MatrixX& changes) {
  constexpr int kStages = 3;
  // Radau IIA of order 5 (Hairer and Wanner, Solving Ordinary Differential Equations II, IV.5).
  static const double kRoot = std::sqrt(6.0);
  static const double kNode[kStages] = {(4 - kRoot) / 10, (4 + kRoot) / 10, 1};
  static const double kA[kStages][kStages] = {
      {(88 - 7 * kRoot) / 360, (296 - 169 * kRoot) / 1800, (-2 + 3 * kRoot) / 225},
      {(296 + 169 * kRoot) / 1800, (88 + 7 * kRoot) / 360, (-2 - 3 * kRoot) / 225},
      {(16 - kRoot) / 36, (16 + kRoot) / 36, 1.0 / 9}};
  Chart& chart = path.chart;
  const Eigen::Index nv = chart.nv(), nz = chart.nz(), n = 2 * nv + nz, m = changes.cols();
  const double span = (to - from) * path.h;
  MatrixX slope[kStages], force[kStages];
  // Bristles that no contact has change nothing.
  std::vector<char> lives(static_cast<std::size_t>(n), 0);
  std::fill_n(lives.begin(), 2 * nv, 1);
  bool touching = false;
  for (int i = 0; i < kStages; ++i) {
    const double at = std::min(from + (to - from) * kNode[i], kLastNode),
                 t = chart.origin().t + at * path.h;
    path.stepper.interpolate(at, y_);
    chart.finish(t, y_, state_);
    linearize(chart, t);
    touching = touching || scene_.touching() || scene_.joints().act();
    slope[i].setZero(n, n);
    slope[i].block(0, nv, nv, nv).setIdentity();
    slope[i].bottomRows(nv + nz) = jacobian_;
    add_turning(scene_.body(), state_.v, slope[i]);
    force[i].setZero(n, m);
    force[i].bottomRows(nv + nz) = own_rates();
    for (Eigen::Index k = 2 * nv; k < n; ++k)
      if (!slope[i].row(k).isZero(0) || !slope[i].col(k).isZero(0)) lives[k] = 1;
  }
  // Only rows that something couples to enter the linear system: most slots of bristles are spare.
  std::vector<Eigen::Index> live;
  for (Eigen::Index k = 0; k < n; ++k)
    if (lives[k]) live.push_back(k);
  const Eigen::Index size = static_cast<Eigen::Index>(live.size());
  MatrixX part = changes(live, Eigen::all);
  // (I - h A (x) J) K = J y + f, all stages at once, for all columns of changes.
  MatrixX system = MatrixX::Identity(kStages * size, kStages * size), right(kStages * size, m);
  for (int i = 0; i < kStages; ++i) {
    const MatrixX a = slope[i](live, live);
    for (int j = 0; j < kStages; ++j)
      system.block(i * size, j * size, size, size) -= span * kA[i][j] * a;
    right.middleRows(i * size, size) = a * part + force[i](live, Eigen::all);
  }
  const MatrixX rates = system.partialPivLu().solve(right);
  for (int j = 0; j < kStages; ++j)
    part += span * kA[kStages - 1][j] * rates.middleRows(j * size, size);
  for (Eigen::Index k = 0; k < size; ++k) changes.row(live[k]) = part.row(k);
  return touching;
}

}  // namespace sphshell
