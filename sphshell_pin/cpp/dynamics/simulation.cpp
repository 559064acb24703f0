#include "dynamics/simulation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include "dynamics/integrators/explicit.hpp"
#include "dynamics/integrators/implicit.hpp"

namespace sphshell {
namespace {

// Of the steps that stand in for a fixed one.
constexpr double kFineTolerance = 1e-6;
constexpr int kMostFineSteps = 1000000;
constexpr double kFirstStep = 1e-5;  // [s]

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

// Of the numbers near t.
double spacing(double t) { return std::numeric_limits<double>::epsilon() * std::abs(t); }

std::unique_ptr<Stepper> make_stepper(Integrator integrator, Scene& scene) {
  switch (integrator) {
    case Integrator::RungeKutta4:
      return std::make_unique<RungeKutta4>();
    case Integrator::LinearlyImplicitEuler:
      return std::make_unique<LinearlyImplicitEuler>(scene);
    case Integrator::Adaptive:
      return std::make_unique<DormandPrince>();
    case Integrator::Implicit:
      return std::make_unique<Rodas>(scene);
    default:
      return std::make_unique<SemiImplicitEuler>();
  }
}

}  // namespace

Simulation::Simulation(const pinocchio::Model& model, std::vector<Pair> pairs, RunSettings settings,
                       std::shared_ptr<Controller> controller, VectorX q0, VectorX v0)
    : settings_(settings),
      scene_(model, std::move(pairs)),
      controller_(std::move(controller)),
      chart_(scene_, *this),
      stepper_(make_stepper(settings.integrator, scene_)),
      guard_(scene_),
      tau_(VectorX::Zero(model.nv)),
      pieces_(scene_.pairs().size(), 0),
      clamped_(scene_.pairs().size(), 0),
      summaries_(scene_.pairs().size()),
      normal_force_(scene_.pairs().size(), 0),
      touching_(scene_.pairs().size(), 0),
      deep_(scene_.pairs().size(), 0),
      through_(scene_.pairs().size(), 0) {
  if (controller_) controller_->prepare(scene_);
  state_.t = settings_.start_time;
  state_.q = std::move(q0);
  state_.v = std::move(v0);
  state_.z.setZero(scene_.bristle_size());
  next_ = between_ = state_;
  next_control_ = settings_.start_time;
  set_fine(false);
  if (settings_.dt > 0) {
    // The last step is shortened to end at the duration; a hair's breadth is not a step.
    const double ratio = settings_.duration / settings_.dt;
    grid_steps_ = std::lround(std::ceil(ratio - 1e-9 - 4e-16 * ratio));
  }
  proposal_ = std::min(kFirstStep, settings_.duration);
  reserve();
}

Simulation::Status Simulation::advance(double wall_seconds, double until) {
  until_ = until;
  if (finished_) return Status::Finished;
  const auto start_of_call = std::chrono::steady_clock::now();
  Status status = Status::Running;
  if (!started_) start();
  int pause = 15;
  for (int checked = 0; status == Status::Running; ++checked) {
    if (full() || state_.t >= until) break;
    if ((checked & pause) == pause) {
      const double elapsed = seconds_since(start_of_call);
      if (elapsed > wall_seconds) break;
      if (elapsed > 1e-3 * (checked + 1)) pause = 0;  // slow steps: look at the clock at each
    }
    status = at_end() ? Status::Finished : step();
  }
  finished_ = status != Status::Running;
  wall_time_ += seconds_since(start_of_call);
  return status;
}

void Simulation::start() {
  started_ = true;
  scene_.evaluate(state_.q, state_.v, state_.z, true);
  std::swap(state_, next_);
  state_.t = next_.t;
  keep(false);
  steps_ = 0;
  write_row(state_);
  next_row_ = 1;
}

double Simulation::end_of_step() const {
  double end = settings_.start_time + settings_.duration;
  if (settings_.dt > 0)
    return grid_ + 1 >= grid_steps_ ? end : settings_.start_time + double(grid_ + 1) * settings_.dt;
  end = std::min(end, until_);
  if (controller_ && settings_.control_dt > 0) end = std::min(end, next_control_);
  if (controller_) end = std::min(end, controller_->next_kink(state_.t));
  return end;
}

Simulation::Status Simulation::step() {
  if (fine_steps_ == 0) hold_torques();
  const double end = end_of_step();
  Status status = Status::Running;
  if (settings_.dt == 0) {
    status = controlled_step(*stepper_, end);
  } else {
    if (fine_ || !fixed_step(end)) {
      set_fine(true);
      if (!fine_stepper_)
        fine_stepper_ = make_stepper(settings_.integrator == Integrator::LinearlyImplicitEuler
                                         ? Integrator::Implicit
                                         : Integrator::Adaptive,
                                     scene_);
      // One at a time: a fixed step may take very many, and the caller wants to look at the clock.
      status =
          fine_steps_++ < kMostFineSteps ? controlled_step(*fine_stepper_, end) : Status::Stuck;
      if (status == Status::Running && state_.t < end)
        return is_finite() ? status : Status::Diverged;
      fine_steps_ = 0;
      // Back to fixed steps when they would do.
      if (proposal_ > 0.5 * settings_.dt) set_fine(false);
    }
    ++grid_;
    ++steps_;
    const long every =
        settings_.record_dt > 0 ? std::max(1L, std::lround(settings_.record_dt / settings_.dt)) : 1;
    if (status == Status::Running && (grid_ % every == 0 || at_end())) write_row(state_);
  }
  return is_finite() ? status : Status::Diverged;
}

// Not-a-number fails every comparison.
bool Simulation::is_finite() const {
  return state_.v.squaredNorm() < 1e24 && state_.q.squaredNorm() < 1e24;
}

void Simulation::set_fine(bool fine) {
  fine_ = fine;
  const bool is_explicit = settings_.integrator == Integrator::SemiImplicitEuler ||
                           settings_.integrator == Integrator::RungeKutta4;
  scene_.relax_in(is_explicit && !fine ? settings_.dt : 0);
}

// False where the step would carry a sphere too far: it is not made.
bool Simulation::fixed_step(double end) {
  kink_ = std::numeric_limits<double>::infinity();
  chart_.begin(state_);
  stepper_->begin(chart_);
  stepper_->step(chart_, end - state_.t, next_);
  next_.t = end;
  stepper_->complete(chart_, next_);
  if (guard_.allowed(scene_, state_, next_) < 1) {
    scene_.restart();
    scene_.evaluate(state_.q, state_.v, state_.z);
    proposal_ = std::min(proposal_, 0.1 * (end - state_.t));
    last_error_ = 1;
    return false;
  }
  keep(stepper_->leaves_work());
  return true;
}

// One accepted step whose size the error decides, up to `end` at most.
Simulation::Status Simulation::controlled_step(Stepper& stepper, double end) {
  const double left = end - state_.t;
  const double shortest = 8 * spacing(end);
  if (left <= spacing(end)) {
    state_.t = end;
    return Status::Running;
  }
  if (controller_) kink_ = controller_->next_kink(state_.t);
  // No short step is left over at the end.
  double h = proposal_ > 0.95 * left ? left : std::min(proposal_, 0.5 * left);
  h = std::min(std::max(h, 4 * shortest), left);
  const double order = stepper.order_of_error();
  chart_.begin(state_);
  stepper.begin(chart_);
  bool rejected = false;
  double error = 0;
  for (;;) {
    if (h < shortest && h < left) {
      proposal_ = h;
      return Status::Stuck;
    }
    attempt(stepper, h);
    error = error_of(stepper);
    // At the resolution of time an error is round-off.
    if (!(error <= 1) && !(h <= 4 * shortest && std::isfinite(error))) {
      ++rejected_;
      rejected = true;
      h *= error < 1e300 ? std::clamp(0.9 * std::pow(error, -1 / order), 0.1, 0.9) : 0.1;
      continue;
    }
    next_.t = h == left ? end : state_.t + h;
    stepper.complete(chart_, next_);
    const double allowed = guard_.allowed(scene_, state_, next_);
    if (allowed < 1) {
      ++rejected_;
      h *= std::clamp(0.95 * allowed, 0.01, 0.9);
      continue;
    }
    break;
  }
  // PI control (Gustafsson 1991).
  double factor = 0.9 * std::pow(std::max(error, 1e-10), -0.7 / order) *
                  std::pow(std::max(last_error_, 1e-10), 0.4 / order);
  factor = std::clamp(factor, 0.2, rejected ? 1.0 : 5.0);
  const double tried = h;
  if (meets_event()) {
    h = step_to_event(stepper, h);
    last_error_ = 1;
  } else {
    last_error_ = std::max(error, 1e-4);
  }
  // A step cut short by `end` says nothing against the one proposed.
  proposal_ = h == left && factor * tried < proposal_ && error < 0.5 ? proposal_ : factor * tried;
  if (settings_.dt == 0) record_within(stepper);
  keep(false);
  return Status::Running;
}

void Simulation::attempt(Stepper& stepper, double h) {
  scene_.restart();
  stepper.step(chart_, h, next_);
}

// The largest error of the state, against the tolerance of each part.
double Simulation::error_of(const Stepper& stepper) {
  const bool fine = settings_.dt > 0;
  const double rtol = fine ? kFineTolerance : settings_.rtol;
  const double atol = fine ? 1e-2 * kFineTolerance : settings_.atol;
  const VectorX& error = stepper.error();
  const VectorX& y = stepper.end();
  const int nv = chart_.nv();
  if (!y.allFinite() || !error.allFinite()) return std::numeric_limits<double>::infinity();
  double worst = 0;
  scene_.body().sizes(state_.q, sizes_);
  for (int i = 0; i < nv; ++i)
    worst = std::max(worst, std::abs(error[i]) / (atol + rtol * sizes_[i]));
  scene_.body().speeds(y.segment(nv, nv), sizes_);
  for (int i = 0; i < nv; ++i)
    worst = std::max(worst, std::abs(error[nv + i]) / (atol + rtol * sizes_[i]));
  for (const ActiveContact& active : scene_.active()) {
    if (active.slot < 0) continue;
    const BristleFriction& friction = *scene_.pairs()[active.pair].friction.bristle();
    const Vec3 z = y.segment<3>(2 * nv + 3 * active.slot);
    const double limit = friction.mu_static * active.force.normal / friction.stiffness;
    const double e = error.segment<3>(2 * nv + 3 * active.slot).norm();
    worst = std::max(worst, e / (1e-6 * atol + rtol * (z.norm() + limit)));
  }
  return worst;
}

// A depth or the clamp of a law went through zero: there the motion has a kink.
bool Simulation::meets_event() const {
  for (std::size_t k = 0; k < pieces_.size(); ++k) {
    const PairState& now = scene_.states()[k];
    if (now.pieces != pieces_[k] || now.clamped != clamped_[k]) return true;
  }
  return false;
}

// Bisects for the shortest step, to round-off, that meets the event; makes it.
double Simulation::step_to_event(Stepper& stepper, double h) {
  const double resolution =
      4 * std::numeric_limits<double>::epsilon() * std::max(std::abs(state_.t), h);
  double before = 0, after = h;
  while (after - before > resolution) {
    const double middle = 0.5 * (before + after);
    attempt(stepper, middle);
    scene_.evaluate(next_.q, next_.v, next_.z);
    (meets_event() ? after : before) = middle;
  }
  attempt(stepper, after);
  next_.t = after == h ? next_.t : state_.t + after;
  stepper.complete(chart_, next_);
  return after;
}

// Makes next_, at which the forces are evaluated, the state.
void Simulation::keep(bool leaves_work) {
  const Powers now = scene_.powers();
  const double h = next_.t - state_.t;
  if (leaves_work) {
    next_.ledger.damping += 0.5 * h * (last_.damping + now.damping);
    next_.ledger.friction += 0.5 * h * (last_.friction + now.friction);
  }
  last_ = now;
  scene_.accept(next_.z);
  std::swap(state_, next_);
  guard_.begin(scene_);
  note_pairs(h);
  if (settings_.dt == 0) ++steps_;
}

// Torques that are held over control_dt change at the start of a step, never inside one.
void Simulation::hold_torques() {
  if (!controller_ || settings_.control_dt == 0) return;
  // The grid of fixed steps need not hold the control times to the last bit.
  const double hair = settings_.dt > 0 ? std::max(1e-6 * settings_.dt, 4 * spacing(state_.t)) : 0;
  if (state_.t + hair < next_control_) return;
  while (next_control_ <= state_.t + hair)
    next_control_ = settings_.start_time + double(++controls_) * settings_.control_dt;
  controller_->torque(scene_, state_.t, state_.q, state_.v, tau_);
}

const VectorX& Simulation::torque(double t, const VectorX& q, const VectorX& v) {
  // The stages at the end of a step that ends at a kink belong to what comes before it.
  if (t >= kink_) t = std::nextafter(kink_, -std::numeric_limits<double>::infinity());
  if (controller_ && settings_.control_dt == 0) controller_->torque(scene_, t, q, v, tau_);
  return push_.active() ? push_.added(scene_.body(), q, v, tau_) : tau_;
}

bool Simulation::follow_state() const {
  return push_.active() || (controller_ && settings_.control_dt == 0);
}

bool Simulation::follow_time() const {
  return controller_ && settings_.control_dt == 0 && controller_->follows_time();
}

void Simulation::push(int joint, const Vec3& point, const Vec3& force_world) {
  scene_.need_velocity_of(joint);
  push_.set(joint, point, force_world);
}

void Simulation::change(std::vector<Pair> pairs, std::shared_ptr<Controller> controller) {
  if (!started_) start();
  scene_.restart();
  scene_.evaluate(state_.q, state_.v, state_.z, true);
  const double before = scene_.powers().elastic;
  scene_.change(std::move(pairs));
  if (controller && controller != controller_) {
    controller->prepare(scene_);
    if (controller_) controller->take_over(*controller_, state_.t);
    controller_ = std::move(controller);
    next_control_ = state_.t;
  }
  scene_.evaluate(state_.q, state_.v, state_.z, true);
  // Whoever turns a stiffness up loads the spring.
  state_.ledger.control += scene_.powers().elastic - before;
  last_ = scene_.powers();
  scene_.accept(state_.z);
  guard_.begin(scene_);
  note_pairs(0);
  proposal_ = std::min(proposal_, kFirstStep);
  last_error_ = 1;
}

}  // namespace sphshell
