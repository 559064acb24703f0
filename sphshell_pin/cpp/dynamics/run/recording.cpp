#include "dynamics/run/recording.hpp"

#include <boost/math/tools/minima.hpp>

namespace sphshell {

// A step holds a peak that counts only where one of its ends comes this near to the largest so far;
// what raises that by less than this share of it does not count.
constexpr double kNearPeak = 0.5, kSamePeak = 1e-10;
// Where within a step its rate is seen beside an end, as a share of it.
constexpr double kBeside = 1e-4;
// Of the share at which a peak is, and looks until it is found: the value is off by the square.
constexpr int kPeakBits = 16;
constexpr std::uintmax_t kMostPeakLooks = 50;

// Summaries of the pairs, then of the joints' stops.
Recorder::Recorder(SceneData& scene, double start, double end, double record_dt, bool patches)
    : scene_(scene),
      start_(start),
      end_(end),
      record_dt_(record_dt),
      summaries_(scene.num_touches()),
      status_(summaries_.size()),
      touches_(summaries_.size()) {
  const JointEffects* joints = scene.joints().effects();
  if (joints) limits_.resize(std::max(joints->most_effort.size(), joints->speed.size()));
  limit_status_.resize(limits_.size());
  if (patches) record_.patches.emplace();
}

void Recorder::record_patches(bool on) {
  if (on == record_.patches.has_value()) return;
  record_.patches.reset();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  if (on) record_.patches.emplace(record_.contacts.size(), unknown_patch(nan));
}

void Recorder::record_torques(TorquesAt torques, Eigen::Index nv) {
  torques_ = std::move(torques);
  if (!record_.torques)  // rows that are there already have none
    record_.torques.emplace(record_.t.size() * static_cast<std::size_t>(nv),
                            std::numeric_limits<double>::quiet_NaN());
}

// What is asked for goes on being recorded, from nothing.
Record Recorder::take() {
  Record next;
  if (record_.patches) next.patches.emplace();
  if (record_.torques) next.torques.emplace();
  if (record_.states) next.states.emplace();
  return std::exchange(record_, std::move(next));
}

// Rows that the other run has recorded are not due again.
void Recorder::go_on(double start, double end, double t) {
  start_ = start, end_ = end;
  if (record_dt_ > 0)
    while (due() <= t) ++next_row_;
}

// A row of its own; what was recorded before is put back.
Record Recorder::snapshot(const State& state) {
  Record recorded = take();
  const long rows = std::exchange(rows_, 0);
  RowFollower* follower = std::exchange(follower_, nullptr);
  add_row(state);
  rows_ = rows, follower_ = follower;
  return std::exchange(record_, std::move(recorded));
}

void Recorder::add_rows(const Stepping& made) {
  const State &from = made.state(), &to = made.next();
  if (record_dt_ > 0) {
    // The end is a row, and none stands a round-off before it.
    const double last = end_ - 1e-9 * record_dt_;
    bool moved = false;
    // Rows between accepted steps are evaluated on the dense output.
    for (; due() < to.t && due() < last; ++next_row_) {
      const double share = (due() - from.t) / (to.t - from.t);
      made.interpolate(share, due(), between_);
      scene_.evaluate(between_.q, between_.v, between_.z, true);
      made.close_loss(between_);
      add_row(between_, share);
      moved = true;
    }
    if (moved) {
      scene_.evaluate_anew(to.q, to.v, to.z);
    }
    if (to.t < (due() < last ? due() : end_)) return;
    ++next_row_;
  }
  scene_.evaluate(to.q, to.v, to.z, true);
  add_row(to);
}

// Contacts, state, energies, torques and sensitivities at one time.
void Recorder::add_row(const State& state, double share) {
  scene_.log(state.q, state.v, record_.contacts, record_.patches ? &*record_.patches : nullptr);
  record_.contact_row.resize(record_.contacts.size(), double(rows_));
  record_.t.push_back(state.t);
  record_.q.insert(record_.q.end(), state.q.begin(), state.q.end());
  record_.v.insert(record_.v.end(), state.v.begin(), state.v.end());
  const Powers& powers = scene_.powers();
  // Columns of Record::energy, in this order [J]; the energy that bristles hold is not lost yet.
  const double kinetic = scene_.body().kinetic_energy(state.q, state.v);
  const double potential = scene_.body().potential_energy(state.q);
  const Ledger& ledger = state.ledger;
  for (double e : {kinetic, potential, powers.elastic + powers.bristles, ledger.damping,
                   ledger.friction - powers.bristles, ledger.control})
    record_.energy.push_back(e);
  if (record_.torques) {
    const VectorX& torques = torques_(state);
    record_.torques->insert(record_.torques->end(), torques.begin(), torques.end());
  }
  if (record_.states) {
    record_.states->insert(record_.states->end(), run_state_->begin(), run_state_->end());
    record_.state_sizes.push_back(double(run_state_->size()));
  }
  if (follower_) follower_->add_row(state, share);
  ++rows_;
}

// Begin and end of touch; `begin` is the kind of the first, that of the end follows it.
void Recorder::add_touch(std::size_t k, double t, double h, int number, Event::Kind begin) {
  PairSummary& summary = summaries_[k];
  PairStatus& status = status_[k];
  const TouchState &now = scene_.touch(k), before = std::exchange(status.touch, now);
  const bool touches = now.count > 0, touched = before.count > 0;
  // Over a step that begins in touch; the impulse by the trapezoidal rule.
  if (touched) summary.contact_time += h;
  summary.impulse += 0.5 * h * (before.normal_force + now.normal_force);
  if (touches != touched) {
    const int kind = static_cast<int>(begin) + (touches ? 0 : 1);
    record_.events.push_back({t, number, static_cast<Event::Kind>(kind)});
    status.deep = false;
    if (touches) ++summary.touches;
  }
  raise_peaks(summary, now, t);
}

void Recorder::raise_peaks(PairSummary& summary, const TouchState& now, double t) {
  if (now.count == 0) return;
  if (now.normal_force > summary.peak_force)
    summary.peak_force = now.normal_force, summary.peak_force_time = t;
  if (now.depth > summary.max_depth) summary.max_depth = now.depth, summary.max_depth_time = t;
}

// Peaks between the ends of a step, on its dense output: looked for only where the rate at the
// higher end says that there is one.
void Recorder::add_peaks(const Stepping& made) {
  const State &from = made.state(), &to = made.next();
  bool moved = false;
  const auto look = [&](double share, std::size_t k) -> const TouchState& {
    moved = true;
    made.interpolate(share, from.t + share * (to.t - from.t), between_);
    scene_.evaluate(between_.q, between_.v, between_.z);
    return scene_.touch(k);
  };
  for (std::size_t k = 0; k < summaries_.size(); ++k) touches_[k] = scene_.touch(k);
  for (std::size_t k = 0; k < summaries_.size(); ++k) {
    PairSummary& summary = summaries_[k];
    const TouchState &first = status_[k].touch, &last = touches_[k];
    if (first.count == 0 && last.count == 0) continue;
    for (const auto& [of, most] : {std::pair(&TouchState::normal_force, &PairSummary::peak_force),
                                   std::pair(&TouchState::depth, &PairSummary::max_depth)}) {
      // A quantity that still grows backwards from its higher end has its peak within the step.
      const bool rises = last.*of > first.*of;
      const double higher = rises ? last.*of : first.*of;
      if (!(higher > 0) || higher < kNearPeak * summary.*most) continue;
      const double rate = (look(rises ? 1 - kBeside : kBeside, k).*of - higher) / kBeside;
      // Where the peak is concave it stays below its tangent.
      if (!(rate > 0 && higher + rate > (1 + kSamePeak) * summary.*most)) continue;
      std::uintmax_t looks = kMostPeakLooks;
      const double at =
          boost::math::tools::brent_find_minima([&](double share) { return -(look(share, k).*of); },
                                                0.0, 1.0, kPeakBits, looks)
              .first;
      const TouchState top = look(at, k);  // sets the time, too
      raise_peaks(summary, top, between_.t);
    }
  }
  if (!moved) return;
  scene_.evaluate_anew(to.q, to.v, to.z);
}

// Events and sums of an accepted step of length h that ends at t.
void Recorder::add_step(double t, double h) {
  const std::size_t pairs = scene_.pairs().size();
  for (std::size_t k = 0; k < pairs; ++k) {
    const PairState& now = scene_.states()[k];
    const int number = static_cast<int>(k);
    const auto add_event = [&](Event::Kind kind) { record_.events.push_back({t, number, kind}); };
    PairStatus& status = status_[k];
    add_touch(k, t, h, number, Event::Kind::Touch);
    // Warnings, once each time a threshold is passed.
    const bool beyond = now.conformity > kMostConformal || now.half_axis > kLargestEllipse;
    if (beyond && !status.beyond_hertz) add_event(Event::Kind::BeyondHertz);
    status.beyond_hertz = beyond;
    const double radius = scene_.pairs()[k].least_radius();
    const bool through = now.pushed_through || (radius > 0 && now.depth > radius);
    if (through && !status.through) add_event(Event::Kind::Through);
    status.through = through;
    if (now.count > 0 && radius > 0 && now.depth > 0.5 * radius && !status.deep) {
      status.deep = true;
      add_event(Event::Kind::Deep);
    }
  }
  for (std::size_t k = pairs; k < summaries_.size(); ++k)
    add_touch(k, t, h, static_cast<int>(k - pairs), Event::Kind::Stop);
}

// Of the velocities that have a limit: times during which efforts were cut, peak speeds, and events
// where either begins or ends.
void Recorder::add_limits(const VectorX& v, const std::vector<char>& cut, double t, double h) {
  for (std::size_t i = 0; i < limits_.size(); ++i) {
    const JointEffects& joints = *scene_.joints().effects();
    LimitSummary& summary = limits_[i];
    LimitStatus& status = limit_status_[i];
    const int number = static_cast<int>(i);
    const auto change = [&](bool& was, bool is, double& first, Event::Kind begin) {
      if (was == is) return;
      was = is;
      if (is && first < 0) first = t;
      const int kind = static_cast<int>(begin) + (is ? 0 : 1);
      record_.events.push_back({t, number, static_cast<Event::Kind>(kind)});
    };
    if (cut[i]) summary.cut_time += h;
    change(status.cut, cut[i], summary.first_cut, Event::Kind::EffortLimit);
    const double speed = std::abs(v[number]);
    summary.peak_speed = std::max(summary.peak_speed, speed);
    const bool too_fast = joints.speed.size() > 0 && speed > joints.speed[number];
    change(status.too_fast, too_fast, summary.first_too_fast, Event::Kind::SpeedLimit);
  }
}

}  // namespace sphshell
