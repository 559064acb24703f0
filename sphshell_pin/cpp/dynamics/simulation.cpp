#include "dynamics/simulation.hpp"

#include <chrono>
#include <cmath>
#include <utility>

namespace sphshell {
namespace {

constexpr std::size_t kRowsPerCall = 4096;
constexpr std::size_t kContactsPerCall = 16384;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Simulation::Simulation(const pinocchio::Model& model, std::vector<Pair> pairs, RunSettings settings,
                       std::shared_ptr<Controller> controller, VectorX q0, VectorX v0)
    : settings_(settings),
      scene_(model, std::move(pairs)),
      controller_(std::move(controller)),
      tau_(VectorX::Zero(model.nv)),
      summaries_(scene_.pairs().size()),
      touching_(scene_.pairs().size(), 0),
      deep_(scene_.pairs().size(), 0) {
  if (settings_.runge_kutta)
    integrator_ = std::make_unique<RungeKutta4>(scene_.body());
  else
    integrator_ = std::make_unique<SemiImplicitEuler>(scene_.body());
  if (controller_) controller_->prepare(scene_);
  state_ = {settings_.start_time, std::move(q0), std::move(v0)};
  // The last step is shortened to end at the duration; a hair's breadth is not a step.
  const double ratio = settings_.duration / settings_.dt;
  steps_ = std::lround(std::ceil(ratio - 1e-9 - 4e-16 * ratio));
  last_dt_ = settings_.duration - settings_.dt * double(steps_ - 1);
  reserve();
}

void Simulation::reserve() {
  const auto& model = scene_.body().model();
  record_.t.reserve(kRowsPerCall);
  record_.q.reserve(kRowsPerCall * static_cast<std::size_t>(model.nq));
  record_.v.reserve(kRowsPerCall * static_cast<std::size_t>(model.nv));
  record_.energy.reserve(kRowsPerCall * Record::kEnergies);
  if (!scene_.pairs().empty()) {
    record_.contacts.reserve(kContactsPerCall);
    record_.contact_row.reserve(kContactsPerCall);
  }
  record_.events.reserve(256);
}

Record Simulation::take() {
  // A callback that threw in the middle of an evaluation leaves contacts without a row.
  record_.contacts.resize(record_.contact_row.size());
  Record out;
  std::swap(out, record_);
  reserve();
  return out;
}

Simulation::Status Simulation::advance(double wall_seconds) {
  if (finished_) return Status::Finished;
  const auto start = std::chrono::steady_clock::now();
  Status status = Status::Running;
  int pause = 15;
  for (int checked = 0;; ++checked) {
    const bool last = step_ == steps_;
    const bool record = last || step_ % settings_.record_every == 0;
    const bool full = record_.t.size() == kRowsPerCall ||
                      record_.contacts.size() * 2 > kContactsPerCall || record_.events.size() > 128;
    if (full) break;
    if ((checked & pause) == pause) {
      const double elapsed = seconds_since(start);
      if (elapsed > wall_seconds) break;
      if (elapsed > 1e-3 * (checked + 1)) pause = 0;  // slow steps: look at the clock at each
    }
    const double dt = last ? 0 : step_ + 1 == steps_ ? last_dt_ : settings_.dt;
    evaluate(record);
    note_pairs(dt);
    if (last) {
      finished_ = true;
      status = Status::Finished;
      break;
    }
    hold_torques();
    integrator_->step(*this, dt, state_, ledger_);
    ++step_;
    state_.t = settings_.start_time +
               (step_ == steps_ ? settings_.duration : double(step_) * settings_.dt);
    // Not-a-number fails every comparison.
    if (!(state_.v.squaredNorm() < 1e24) || !(state_.q.squaredNorm() < 1e24)) {
      finished_ = true;
      status = Status::Diverged;
      break;
    }
  }
  wall_time_ += seconds_since(start);
  return status;
}

// Forces at the state, the losses up to it, and a row of the record where one is due.
void Simulation::evaluate(bool record) {
  scene_.evaluate(state_.q, state_.v, true, record ? &record_.contacts : nullptr, true);
  if (!integrator_->gathers_losses()) {
    const Powers& now = scene_.powers();
    if (step_ > 0) {
      const double dt = step_ == steps_ ? last_dt_ : settings_.dt;
      ledger_.damping += 0.5 * dt * (last_.damping + now.damping);
      ledger_.friction += 0.5 * dt * (last_.friction + now.friction);
    }
    last_ = now;
  }
  if (!record) return;
  record_.contact_row.resize(record_.contacts.size(), double(rows_));
  write_row();
}

void Simulation::write_row() {
  record_.t.push_back(state_.t);
  record_.q.insert(record_.q.end(), state_.q.data(), state_.q.data() + state_.q.size());
  record_.v.insert(record_.v.end(), state_.v.data(), state_.v.data() + state_.v.size());
  const double elastic = scene_.powers().elastic;
  const double kinetic = scene_.body().kinetic_energy(state_.q, state_.v);
  const double potential = scene_.body().potential_energy(state_.q);
  for (double e : {kinetic, potential, elastic, ledger_.damping, ledger_.friction, ledger_.control})
    record_.energy.push_back(e);
  ++rows_;
}

void Simulation::note_pairs(double dt) {
  for (std::size_t k = 0; k < summaries_.size(); ++k) {
    const PairState& now = scene_.states()[k];
    PairSummary& summary = summaries_[k];
    const bool touching = now.count > 0;
    if (touching != bool(touching_[k])) {
      record_.events.push_back(
          {state_.t, int(k), touching ? Event::Kind::Touch : Event::Kind::LiftOff});
      touching_[k] = touching;
      deep_[k] = 0;
      if (touching) ++summary.touches;
    }
    if (!touching) continue;
    summary.contact_time += dt;
    summary.impulse += dt * now.normal_force;
    if (now.normal_force > summary.peak_force)
      summary.peak_force = now.normal_force, summary.peak_force_time = state_.t;
    if (now.depth > summary.max_depth)
      summary.max_depth = now.depth, summary.max_depth_time = state_.t;
    const double radius = scene_.pairs()[k].radius;
    if (radius > 0 && now.depth > 0.5 * radius && !deep_[k]) {
      deep_[k] = 1;
      record_.events.push_back({state_.t, int(k), Event::Kind::Deep});
    }
  }
}

void Simulation::contacts(const VectorX& q, const VectorX& v) {
  scene_.evaluate(q, v, true, nullptr);
}

// Torques that are held over control_dt change at the start of a step, never inside one.
void Simulation::hold_torques() {
  if (!controller_ || settings_.control_dt == 0) return;
  const double elapsed = state_.t - settings_.start_time + 1e-6 * settings_.dt;
  if (elapsed < next_control_) return;
  next_control_ = (std::floor(elapsed / settings_.control_dt) + 1) * settings_.control_dt;
  controller_->torque(scene_, state_.t, state_.q, state_.v, tau_);
}

const VectorX& Simulation::torque(double t, const VectorX& q, const VectorX& v) {
  if (controller_ && settings_.control_dt == 0) controller_->torque(scene_, t, q, v, tau_);
  return tau_;
}

}  // namespace sphshell
