#include "dynamics/run/simulation.hpp"

#include <chrono>

namespace sphshell {
namespace {

constexpr int kMostFineSteps = 1000000;
// A start deeper than this share of the radius is refused.
constexpr double kDeepStart = 0.5;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace

Simulation::Simulation(const pinocchio::Model& model, Task task)
    : settings_(std::move(task.settings)),
      scene_(model, std::move(task.pairs), std::move(task.joints)),
      controller_(std::move(task.controller)),
      stepping_(scene_, *this, settings_,
                {settings_.start_time,
                 std::move(task.q0),
                 std::move(task.v0),
                 VectorX::Zero(scene_.bristle_size()),
                 {}}),  // bristles that are not stretched
      recorder_(scene_, settings_.start_time, end(), settings_.record_dt, settings_.patches),
      tau_(VectorX::Zero(model.nv)),
      cut_(static_cast<std::size_t>(model.nv), 0),
      next_control_(settings_.start_time) {
  if (!task.sensors.empty())
    // The base is private: no other function could convert to it.
    sensors_ = std::make_unique<Sensors>(std::move(task.sensors), scene_,
                                         static_cast<Torques&>(*this), push_, settings_.start_time);
  if (settings_.torques) record_torques();
  if (settings_.states) recorder_.record_states(kept_);
  if (controller_) controller_->prepare(scene_);
  if (controller_ && sensors_) controller_->read(sensors_->readings());
  count_steps();
}

// The last step is shortened to end at the duration; a hair's breadth is not a step.
void Simulation::count_steps() {
  if (settings_.dt == 0) return;
  const double ratio = settings_.duration / settings_.dt;
  grid_steps_ = std::lround(std::ceil(ratio - 1e-9 - 4e-16 * ratio));
}

// The numbers: start and duration of the run, the fixed step, how many of them and of the
// controller's times are over, then those of the stepping, the torques, and the scene's memory.
void Simulation::keep_state() {
  if (!settings_.states) return;
  kept_ = {settings_.start_time, settings_.duration, settings_.dt, double(grid_),
           double(controls_)};
  const std::vector<double> steps = stepping_.save(), memory = scene_.save(stepping_.state().z);
  kept_.insert(kept_.end(), steps.begin(), steps.end());
  kept_.insert(kept_.end(), tau_.begin(), tau_.end());
  kept_.insert(kept_.end(), memory.begin(), memory.end());
}

// The times of steps, rows and controller are those of the run that goes on, and its end where it
// is the same.
bool Simulation::resume(const std::vector<double>& state) {
  constexpr std::size_t own = 5;
  const std::size_t nq = std::size_t(q().size()), nv = std::size_t(v().size());
  const std::size_t steps = own + Stepping::kSaved + nq + nv, fixed = steps + nv;
  if (started_ || state.size() < fixed ||
      !scene_.load(state.data() + fixed, state.size() - fixed, stepping_.state().z))
    return false;
  if (state[2] == settings_.dt) {
    const double duration = settings_.start_time - state[0] + settings_.duration;
    const bool same = std::abs(duration - state[1]) <= 1e-12 * std::max(1.0, std::abs(duration));
    settings_.duration = same ? state[1] : duration;
    settings_.start_time = state[0];
    count_steps();
    grid_ = std::lround(state[3]);
    controls_ = std::lround(state[4]);
    next_control_ = settings_.start_time + double(controls_) * settings_.control_dt;
  }
  stepping_.resume(state.data() + own);
  tau_ = Eigen::Map<const VectorX>(state.data() + steps, Eigen::Index(nv));
  recorder_.go_on(settings_.start_time, end(), time());
  begin_record();
  return true;
}

void Simulation::differentiate(SensitivitySettings settings) {
  if (!settings.any()) return;
  sensitivities_ = std::make_unique<Sensitivities>(scene_, std::move(settings));
  recorder_.set_follower(sensitivities_.get());
}

// See the declaration; a contact source knows no radius that a depth could be compared with.
std::optional<DeepStart> Simulation::deep_start() {
  if (!started_) start();
  for (std::size_t k = 0; k < scene_.pairs().size(); ++k) {
    const Pair& pair = scene_.pairs()[k];
    if (!pair.has_sphere()) continue;
    const PairState& state = scene_.states()[k];
    double depth = state.depth;
    if (depth == 0)
      depth =
          pair.ask([&](const auto& one) { return one.depth_behind(state.center, pair.radius); });
    if (depth > kDeepStart * pair.least_radius()) return DeepStart{static_cast<int>(k), depth};
  }
  return {};
}

Simulation::Status Simulation::advance(double wall_seconds, double until,
                                       const std::atomic<bool>* stop) {
  // The clock is looked at every 16 steps, or at each where steps are slow.
  until_ = until;
  if (finished_) return Status::Finished;
  const auto start_of_call = std::chrono::steady_clock::now();
  Status status = Status::Running;
  if (!started_) start();
  if (sensors_ && !sensors_->begun()) begin_sensors();
  int pause = 15;
  for (int checked = 0; status == Status::Running && time() < until; ++checked) {
    if ((checked & pause) == pause) {
      const double elapsed = seconds_since(start_of_call);
      if (elapsed > wall_seconds || (stop && *stop)) break;
      if (elapsed > 1e-3 * (checked + 1)) pause = 0;  // slow steps: look at the clock at each
    }
    status = at_end() ? Status::Finished : step();
  }
  finished_ = status != Status::Running;
  wall_time_ += seconds_since(start_of_call);
  return status;
}

void Simulation::start() {
  stepping_.restart();
  begin_record();
}

void Simulation::begin_record() {
  started_ = true;
  keep_state();
  recorder_.add_step(time(), 0);
  recorder_.add_limits(v(), cut_, time(), 0);
  recorder_.add_row(stepping_.state());
}

// The first sample needs the first torque, for which a controller may read the sensors.
void Simulation::begin_sensors() {
  sensors_->hold_still(stepping_.state());
  hold_torques();
  sensors_->begin(stepping_.state());
}

Record Simulation::take() {
  Record out = recorder_.take();
  if (sensors_) out.sensors = sensors_->take();
  return out;
}

// Fixed steps end on a grid that is computed from the start, so that rounding does not add up;
// others at the next time at which torques change.
double Simulation::end_of_step() const {
  if (settings_.dt > 0)
    return grid_ + 1 >= grid_steps_ ? end()
                                    : settings_.start_time + double(grid_ + 1) * settings_.dt;
  double out = std::min(end(), until_);
  if (controller_ && settings_.control_dt > 0) out = std::min(out, next_control_);
  if (controller_) out = std::min(out, controller_->next_kink(time()));
  return out;
}

// One step, or a part of a fixed step that had to be divided: the next call goes on.
Simulation::Status Simulation::step() {
  if (fine_steps_ == 0) hold_torques();
  if (sensors_) sensors_->begin_step(stepping_.state());
  const double end = end_of_step();
  Status status = Status::Running;
  if (settings_.dt == 0) {
    if (!make_controlled(end)) status = Status::Stuck;
  } else {
    kink_ = kInfinity;
    if (!stepping_.fine() && stepping_.make_fixed(end)) {
      made_cut_ = cut_;
      if (sensitivities_) sensitivities_->step(stepping_);
      accept();
    } else {
      // One of the steps that replace a fixed one: there may be very many, and the caller wants to
      // look at the clock.
      stepping_.set_fine(true);
      if (fine_steps_++ >= kMostFineSteps || !make_controlled(end)) status = Status::Stuck;
    }
    if (status == Status::Running && time() < end) return is_finite() ? status : Status::Diverged;
    fine_steps_ = 0;
    // Back to fixed steps when they would do.
    if (stepping_.fine() && stepping_.proposal() > 0.5 * settings_.dt) stepping_.set_fine(false);
    ++grid_;
    ++steps_;
    // Rows of fixed steps: of the steps whose number is a multiple of the ratio.
    const long every =
        settings_.record_dt > 0 ? std::max(1L, std::lround(settings_.record_dt / settings_.dt)) : 1;
    if (status == Status::Running && (grid_ % every == 0 || at_end())) {
      keep_state();
      recorder_.add_row(stepping_.state());
    }
  }
  return is_finite() ? status : Status::Diverged;
}

// False where no step is short enough.
bool Simulation::make_controlled(double end) {
  // Sensors and rows within the step need its dense output, so they come before the step is
  // accepted.
  if (controller_) kink_ = controller_->next_kink(time());
  const Stepping::Made made = stepping_.make_controlled(end);
  if (made != Stepping::Made::Step) return made == Stepping::Made::Nothing;
  made_cut_ = cut_;
  // Before the step is accepted, as the scene must still know where it began.
  if (sensitivities_) sensitivities_->step(stepping_);
  if (settings_.dt == 0) {
    if (sensors_) sensors_->add_dense(stepping_);
    recorder_.add_rows(stepping_);
    ++steps_;
  }
  recorder_.add_peaks(stepping_);
  accept();
  return true;
}

// Sensors, derivatives and recording see the step, each at its place in this order. Torques that
// they ask for leave no trace in the figures of the effort limits.
void Simulation::accept() {
  const double before = time();
  if (sensors_ && settings_.dt > 0) sensors_->add_fixed(stepping_, settings_.dt);
  if (sensitivities_) {
    const bool controlled = settings_.dt == 0 || stepping_.fine();
    sensitivities_->accept(stepping_.next(), controlled && stepping_.at_event());
  }
  stepping_.accept();
  recorder_.add_step(time(), time() - before);
  recorder_.add_limits(v(), made_cut_, time(), time() - before);
  if (settings_.dt == 0) keep_state();
}

// Not-a-number fails every comparison.
bool Simulation::is_finite() const { return v().squaredNorm() < 1e24 && q().squaredNorm() < 1e24; }

// Torques that are held over control_dt change at the start of a step, never inside one.
void Simulation::hold_torques() {
  if (!controller_ || settings_.control_dt == 0) return;
  // The grid of fixed steps need not hold the control times to the last bit.
  const double round_off = std::numeric_limits<double>::epsilon() * std::abs(time());
  const double hair = settings_.dt > 0 ? std::max(1e-6 * settings_.dt, 4 * round_off) : 0;
  if (time() + hair < next_control_) return;
  while (next_control_ <= time() + hair)
    next_control_ = settings_.start_time + double(++controls_) * settings_.control_dt;
  // First at the state itself: a controller may begin there.
  command(time(), q(), v());
  if (sensitivities_) {
    const VectorX asked = tau_;
    const std::vector<char> cut = cut_;
    sensitivities_->hold(
        [this](double t, const VectorX& q, const VectorX& v) -> const VectorX& {
          command(t, q, v);
          return tau_;
        },
        stepping_.state());
    tau_ = asked, cut_ = cut;
  }
  if (sensors_) sensors_->jump();
}

void Simulation::record_torques() {
  const auto torques_at = [this](const State& at) -> const VectorX& {
    const bool held = settings_.control_dt > 0;
    if (controller_ && !held)
      command(std::min(at.t, std::nextafter(kink_, -kInfinity)), at.q, at.v);
    else if (controller_ && controls_ == 0)  // the first row stands before the first held torque
      tau_.setConstant(std::numeric_limits<double>::quiet_NaN());
    return tau_;
  };
  recorder_.record_torques(torques_at, tau_.size());
}

// What the controller asks for, cut to what the motors give.
void Simulation::command(double t, const VectorX& q, const VectorX& v) {
  controller_->torque(scene_, t, q, v, tau_);
  const JointEffects* joints = scene_.joints().effects();
  if (!joints || joints->most_effort.size() == 0) return;
  for (Eigen::Index i = 0; i < tau_.size(); ++i) {
    const double asked = tau_[i];
    tau_[i] = std::clamp(asked, joints->least_effort[i], joints->most_effort[i]);
    cut_[i] = tau_[i] != asked;
  }
}

const VectorX& Simulation::torque(double t, const VectorX& q, const VectorX& v) {
  // The stages at the end of a step that ends at a kink belong to what comes before it.
  if (t >= kink_) t = std::nextafter(kink_, -kInfinity);
  if (controller_ && settings_.control_dt == 0) command(t, q, v);
  return push_.active() ? push_.added(scene_.body(), q, v, tau_) : tau_;
}

bool Simulation::follow_state() const {
  return push_.active() || (controller_ && settings_.control_dt == 0);
}

bool Simulation::follow_time() const {
  return controller_ && settings_.control_dt == 0 && controller_->follows_time();
}

Record Simulation::snapshot() {
  if (!started_) start();
  return recorder_.snapshot(stepping_.state());
}

void Simulation::push(int joint, const Vec3& point, const PointForce& force, int frame) {
  // The spring and damper of a push need the joint's placement and velocity.
  scene_.need_velocity_of(joint);
  // The next step begins with what was evaluated here, maybe without this joint.
  scene_.body().kinematics(q(), v());
  push_.set(joint, point, force, frame);
  if (sensors_) sensors_->jump();
}

void Simulation::take_over(const Simulation& before) {
  // Both runs have a controller, or neither goes on.
  if (!controller_ || !before.controller_) return;
  controller_->take_over(*before.controller_, time());
  next_control_ = time();
}

void Simulation::change(std::vector<Pair> pairs, JointForces::Effects joints,
                        std::shared_ptr<Controller> controller) {
  if (!started_) start();
  State& state = stepping_.state();
  scene_.evaluate_anew(state.q, state.v, state.z, true);
  // At the same state, with the laws before and after the change.
  const double before = scene_.powers().elastic;
  scene_.change(std::move(pairs), std::move(joints));
  if (controller && controller != controller_) {
    controller->prepare(scene_);
    if (sensors_) controller->read(sensors_->readings());
    if (controller_) controller->take_over(*controller_, state.t);
    controller_ = std::move(controller);
    next_control_ = state.t;
  }
  stepping_.restart();
  // A change of stiffness adds the change of stored energy.
  state.ledger.control += scene_.powers().elastic - before;
  recorder_.add_step(state.t, 0);
  if (sensors_) sensors_->jump();
}

}  // namespace sphshell
