#include "dynamics/run/stepping.hpp"

namespace sphshell {

// Of the steps that replace a fixed one; of those behind kinks of contacts on planes.
constexpr double kFineTolerance = 1e-7, kKinkTolerance = 2e-8;
// A contact that faces and edges share moves this far in a fixed step at most, as a share of the
// shell's size.
constexpr double kMostWandering = 3e-3;
// Of the depth over which the damping of a contact on a plane comes on, and of the slip over which
// its friction does, a fixed step passes this share at most.
constexpr double kMostRamp = 0.1;
constexpr double kFirstStep = 1e-5;  // of a run, and after a change [s]
// A step ends behind its event by this share of its length at most, and of rtol; where it is aimed
// at, as a share of that.
constexpr double kEventShare = 1e-3, kBehind = 0.02;
// How far beyond the end of a step, as a share of it, its dense output still locates an event.
constexpr double kBeyond = 0.05;
constexpr int kMostEventSteps = 8;  // in one step
// Up to this error the dense output of a rejected step shows where the event is.
constexpr double kUsableError = 1e6;
// A derivative of the force is not bounded at an event (depth^1.5): there the estimate of the error
// is too small, and the error falls with a lower order.
constexpr double kErrorAtKink = 0.05, kOrderAtKink = 2.5, kFirstShare = 0.15;
constexpr int kMostKinkRejections = 3;  // in one step; then the error is taken as it is

// Of the numbers near t.
static double spacing(double t) { return std::numeric_limits<double>::epsilon() * std::abs(t); }

Stepping::Stepping(SceneData& scene, Torques& torques, const StepSettings& settings, State start)
    : settings_(settings),
      scene_(scene),
      chart_(scene, torques),
      stepper_(make_stepper(settings.integrator, scene)),
      detection_(scene),
      events_(scene),
      state_(std::move(start)),
      next_(state_),
      divides_(settings.dt > 0 && !stepper_->leaves_work() && !stepper_->is_implicit()) {
  set_fine(false);
}

// A fixed step that the guard refuses is divided by a method with error control.
void Stepping::set_fine(bool fine) {
  if (fine && !fine_stepper_)
    fine_stepper_ = make_stepper(stepper_->is_implicit() ? "implicit" : "adaptive", scene_);
  active_ = (fine ? fine_stepper_ : stepper_).get();
  const bool is_explicit = settings_.dt > 0 && !active_->is_implicit() && !fine;
  scene_.relax_in(is_explicit ? settings_.dt : 0);
}

// Sets what the next step has to know of its begin.
void Stepping::begin() {
  const std::vector<ActiveContact>& active = scene_.active();
  const bool alone = !scene_.joints().act();
  free_ = !scene_.touching() && alone;
  // Of controlled steps alone, which end where a clamp begins or ends.
  held_ = (settings_.dt == 0 || fine()) && alone && !active.empty() &&
          std::all_of(active.begin(), active.end(),
                      [](const ActiveContact& one) { return one.clamped; });
  detection_.begin(scene_);
  events_.begin();
  places_.clear();
  if (!divides_) return;
  for (const ActiveContact& one : active)
    if (scene_.pair_of(one).on_plane())
      places_.push_back({one.pair, one.contact.point, one.contact.depth, one.force.slip});
}

// Whether the forces of what lies on a plane have had kinks since the step began, which a step of
// high order must not pass: a contact has begun or ended, has moved from corner to corner, which it
// does by 1000 sizes a radian of tilt, or has passed much of the depth over which damping comes on,
// or of the slip over which friction does.
bool Stepping::passes_kinks() const {
  if (!divides_ || fine()) return false;
  std::size_t left = places_.size();
  for (const ActiveContact& one : scene_.active()) {
    const Pair& pair = scene_.pair_of(one);
    const PlaneBelow* plane = std::get_if<PlaneBelow>(&pair.geometry);
    if (!plane) continue;
    const Place* before = nullptr;
    double moved = kInfinity;
    for (const Place& place : places_)
      if (const double apart = (place.point - one.contact.point).norm();
          place.pair == one.pair && apart < moved)
        moved = apart, before = &place;
    if (!before || left-- == 0) return true;
    if (plane->flats().any() && moved > kMostWandering * plane->flats().size) return true;
    if (const ImpactLaw* law = std::get_if<ImpactLaw>(&pair.law.law); law && law->needs_rate()) {
      const double full = law->full_damping_depth;
      if (std::abs(std::min(one.contact.depth, full) - std::min(before->depth, full)) >
          kMostRamp * full)
        return true;
    }
    if (const CoulombFriction* friction = std::get_if<CoulombFriction>(&pair.friction.law)) {
      const double full = friction->v_static;
      if ((in_ball(one.force.slip, full) - in_ball(before->slip, full)).norm() > kMostRamp * full)
        return true;
    }
  }
  return left > 0;
}

void Stepping::close_loss(State& at) const {
  if (held_) at.ledger.damping = state_.ledger.damping + last_.elastic - scene_.powers().elastic;
}

// Forgets the history of step lengths: the right-hand side is another one from here on.
void Stepping::restart() {
  scene_.evaluate(state_.q, state_.v, state_.z, true);
  last_ = scene_.powers();
  scene_.accept(state_.z);
  begin();
  proposal_ = kFirstStep;
  after_event_ = false;
  last_error_ = 1;
}

std::vector<double> Stepping::save() const {
  const Ledger& work = state_.ledger;
  std::vector<double> out{state_.t,      work.damping,   work.friction,        work.control,
                          proposal_,     last_error_,    double(after_event_), double(fine()),
                          last_.damping, last_.friction, last_.elastic,        last_.bristles};
  out.insert(out.end(), state_.q.begin(), state_.q.end());
  out.insert(out.end(), state_.v.begin(), state_.v.end());
  return out;
}

void Stepping::resume(const double* from) {
  state_.t = from[0];
  state_.ledger = {from[1], from[2], from[3]};
  state_.q = Eigen::Map<const VectorX>(from + kSaved, state_.q.size());
  state_.v = Eigen::Map<const VectorX>(from + kSaved + state_.q.size(), state_.v.size());
  scene_.evaluate_anew(state_.q, state_.v, state_.z, true);
  set_fine(from[7] != 0);
  begin();
  proposal_ = from[4], last_error_ = from[5];
  after_event_ = from[6] != 0;
  last_ = {from[8], from[9], from[10], from[11]};
}

// Of the steps that replace a fixed one, or those asked for.
Stepping::Tolerances Stepping::tolerances() const {
  const double fine = places_.empty() ? kFineTolerance : kKinkTolerance;
  if (settings_.dt > 0) return {fine, 1e-2 * fine};
  return {settings_.rtol, settings_.atol};
}

// False where the motion was too long for collision detection or the shares: nothing has been
// changed then.
bool Stepping::make_fixed(double end) {
  held_ = false;
  chart_.begin(state_);
  active_->begin(chart_);
  active_->step(chart_, end - state_.t, next_);
  next_.t = end;
  active_->complete(chart_, next_);
  scene_.evaluate(next_.q, next_.v, next_.z);
  if (detection_.allowed(scene_, state_, next_) >= 1 && !passes_kinks()) return true;
  scene_.evaluate_anew(state_.q, state_.v, state_.z);
  proposal_ = std::min(proposal_, 0.1 * (end - state_.t));
  after_event_ = false;
  last_error_ = 1;
  return false;
}

Stepping::Made Stepping::make_controlled(double end) {
  const double left = end - state_.t;
  // Below this a step does not change the time by a reliable amount.
  const double shortest = 8 * spacing(end);
  // Nothing is left but rounding.
  if (left <= spacing(end)) {
    state_.t = end;
    return Made::Nothing;
  }
  chart_.begin(state_);
  active_->begin(chart_);
  const bool after_event = std::exchange(after_event_, false);
  if (after_event) proposal_ = first_step();
  // No short step is left over at the end.
  double h = proposal_ > 0.95 * left ? left : std::min(proposal_, 0.5 * left);
  if (free_) h = predicted_step(h);
  h = std::min(std::max(h, 4 * shortest), left);
  // Steps are made until one is kept: its error is small, no sphere has moved too far, and it ends
  // at an event if there was one.
  const double order = active_->order_of_error();
  bool rejected = false;
  int event_steps = 0, kink_rejections = 0;
  double error = 0;
  for (;;) {
    if (h < shortest && h < left) {
      proposal_ = h;
      return Made::Stuck;
    }
    scene_.restart();
    active_->step(chart_, h, next_);
    next_.t = h == left ? end : state_.t + h;
    error = error_norm();
    // At the resolution of time an error is round-off.
    const bool shortest_yet = h <= 4 * shortest && std::isfinite(error);
    const double kink_limit = kink_rejections < kMostKinkRejections ? kErrorAtKink : 1;
    double limit = after_event ? kink_limit : 1;
    const bool small = error <= limit || shortest_yet;
    bool is_met = false;
    if (small || (error < kUsableError && event_steps < kMostEventSteps)) {
      scene_.evaluate(next_.q, next_.v, next_.z);
      const double allowed = detection_.allowed(scene_, state_, next_, true);
      if (allowed < 1 && small) {
        ++rejected_;
        h *= std::clamp(0.95 * allowed, 0.01, 0.9);
        continue;
      }
      is_met = allowed >= 1 && events_.met();
      const bool to_locate = event_steps == 0 ? is_met : error <= kink_limit;
      if (to_locate && event_steps < kMostEventSteps) {
        const double wanted =
            std::min(std::max(step_to_event(h, left, is_met), 4 * shortest), left);
        if (wanted != h) {
          ++event_steps_;
          ++event_steps;
          h = wanted;
          continue;
        }
        // The search has looked elsewhere; the step ends here.
        scene_.evaluate_anew(next_.q, next_.v, next_.z);
      }
      if (is_met) limit = kink_limit;
    }
    if (error <= limit || shortest_yet) {
      after_event_ = is_met;
      break;
    }
    ++rejected_;
    rejected = true;
    // error ~ h^order: the step for which the error would be 0.9 of its limit.
    const double power = -1 / (limit < 1 ? kOrderAtKink : order);
    if (limit < 1) ++kink_rejections;
    h *= error < 1e300 ? std::clamp(0.9 * std::pow(error / limit, power), 0.1, 0.9) : 0.1;
  }
  active_->complete(chart_, next_);
  if (after_event_)
    for (const ActiveContact& active : scene_.active())
      // A contact that begins at the end of the step has had no time to be stretched.
      if (active.slot >= 0 && scene_.is_new(active))
        next_.z.segment(3 * active.slot, 3 * scene_.pairs()[active.pair].friction.rings())
            .setZero();
  close_loss(next_);
  // PI control (Gustafsson 1991).
  double factor = 0.9 * std::pow(std::max(error, 1e-10), -0.7 / order) *
                  std::pow(std::max(last_error_, 1e-10), 0.4 / order);
  factor = std::clamp(factor, 0.2, rejected ? 1.0 : 5.0);
  last_error_ = after_event_ ? 1 : std::max(error, 1e-4);
  // A step cut short by `end` says nothing against the one proposed.
  if (h < left || factor * h >= proposal_ || error >= 0.5) proposal_ = factor * h;
  return Made::Step;
}

// The length of the step that ends just behind the event, seen from one of length h; h where that
// will do, or where there is no event.
double Stepping::step_to_event(double h, double left, bool is_met) {
  const Motion path = [this](double share, VectorX& y) { active_->interpolate(share, y); };
  const double resolution = std::max(kEventShare * tolerances().rtol, 8 * spacing(state_.t) / h);
  double before = 0, after = 1;
  if (is_met) {
    if (!events_.met_at(1 - resolution, path, chart_)) return h;
  } else {
    before = 1;
    after = std::min(1 + kBeyond, left / h);
    if (after <= 1 || !events_.met_at(after, path, chart_)) return h;
  }
  const double share = events_.locate(before, after, 0.01 * resolution, path, chart_);
  return share * (1 + kBehind * resolution) * h;
}

// At most h, and no longer than to the event or the place where the guard would stop a motion that
// keeps its acceleration: most steps of free bodies then end there at the first try.
double Stepping::predicted_step(double h) {
  const VectorX &start = active_->start(), &rate = active_->rate();
  const int nv = chart_.nv();
  const auto parabola = [&](double share, VectorX& y) {
    y = start + share * h * rate;
    y.head(nv) += 0.5 * share * share * h * h * rate.segment(nv, nv);
  };
  const Motion path = std::cref(parabola);  // no copy on the heap
  const double resolution = kEventShare * tolerances().rtol;
  for (int i = 0; i < kMostEventSteps; ++i) {
    path(1, probe_);
    chart_.finish(state_.t + h, probe_, next_);
    scene_.evaluate_anew(next_.q, next_.v, next_.z);
    const double allowed = detection_.allowed(scene_, state_, next_, true);
    if (allowed >= 1) break;
    h *= std::clamp(0.95 * allowed, 0.01, 0.9);
  }
  if (!events_.met()) return h;
  return events_.locate(0, 1, 0.01 * resolution, path, chart_) * (1 + kBehind * resolution) * h;
}

// The largest error of the state, against the tolerance of each part.
double Stepping::error_norm() const {
  const VectorX& error = active_->error();
  const VectorX& y = active_->end();
  const int nv = chart_.nv();
  if (!y.allFinite() || !error.allFinite()) return kInfinity;
  double worst = weighted(error, y);
  const auto [rtol, atol] = tolerances();
  for (const ActiveContact& active : scene_.active()) {
    // A contact that begins at the end of the step is not stretched yet.
    if (active.slot < 0 || scene_.is_new(active)) continue;
    const FrictionLaw& friction = scene_.pairs()[active.pair].friction;
    const double stiffness = active.force.stiffness;
    // The stretch at which the contact begins to slip: what errors are compared with while it is
    // small.
    const double limit = friction.sticking()->mu_static * active.force.normal / stiffness;
    for (int i = 0; i < friction.rings(); ++i) {
      const auto stretch = [&](const VectorX& z) {
        return friction.stretch(z.segment<3>(2 * nv + 3 * (active.slot + i)), active.contact.normal,
                                stiffness);
      };
      worst = std::max(worst, stretch(error) / (1e-6 * atol + rtol * (stretch(y) + limit)));
    }
  }
  const int first = 2 * nv + scene_.joint_bristles();
  for (int i = 0; i < scene_.joints().size(); ++i) {
    const DryFriction& dry = scene_.joints().effects()->friction[i];
    const double size = std::abs(y[first + i]) + dry.limit / dry.stiffness;
    worst = std::max(worst, std::abs(error[first + i]) / (1e-6 * atol + rtol * size));
  }
  return worst;
}

// The largest part of a change of positions and velocities, against its tolerance at y.
double Stepping::weighted(const VectorX& change, const VectorX& y) const {
  const auto [rtol, atol] = tolerances();
  const int nv = chart_.nv();
  double worst = 0;
  scene_.body().sizes(state_.q, sizes_);
  for (int i = 0; i < nv; ++i)
    worst = std::max(worst, std::abs(change[i]) / (atol + rtol * sizes_[i]));
  scene_.body().speeds(y.segment(nv, nv), sizes_);
  for (int i = 0; i < nv; ++i)
    worst = std::max(worst, std::abs(change[nv + i]) / (atol + rtol * sizes_[i]));
  return worst;
}

// The first step after an event, from one evaluation more: Hairer, Norsett, Wanner, Solving
// Ordinary Differential Equations I, II.4.
double Stepping::first_step() {
  const double rtol = tolerances().rtol;
  const VectorX &start = active_->start(), &rate = active_->rate();
  const double speed = weighted(rate, start);
  // An explicit Euler step that changes the state by a hundredth of its size.
  const double h = speed > 0 ? 0.01 / (rtol * speed) : 1e-6;
  probe_ = start + h * rate;
  scene_.restart();
  chart_.rate(state_.t + h, probe_, rate_);
  rate_ -= rate;
  const double change = weighted(rate_, start) / h, most = std::max(speed, change);
  if (!(most > 0) || !std::isfinite(most)) return h;
  return kFirstShare * std::min(100 * h, std::pow(0.01 / most, 1.0 / active_->order_of_error()));
}

void Stepping::accept() {
  const Powers now = scene_.powers();
  const double h = next_.t - state_.t;
  // By the trapezoidal rule from the powers at both ends.
  if (active_->leaves_work()) {
    next_.ledger.damping += 0.5 * h * (last_.damping + now.damping);
    next_.ledger.friction += 0.5 * h * (last_.friction + now.friction);
  }
  last_ = now;
  scene_.accept(next_.z);
  std::swap(state_, next_);
  begin();
}

}  // namespace sphshell
