#include "dynamics/recording.hpp"

#include <utility>

namespace sphshell {

Recorder::Recorder(std::size_t pairs, double start, double end, double record_dt)
    : start_(start), end_(end), record_dt_(record_dt), summaries_(pairs), status_(pairs) {}

Record Recorder::take() { return std::exchange(record_, {}); }

Record Recorder::snapshot(SceneData& scene, const State& state) {
  Record recorded = std::exchange(record_, {});
  const long rows = std::exchange(rows_, 0);
  add_row(scene, state);
  rows_ = rows;
  return std::exchange(record_, std::move(recorded));
}

void Recorder::add_rows(SceneData& scene, const Chart& chart, const Stepper& stepper,
                        const State& from, const State& to) {
  if (record_dt_ > 0) {
    // The end is a row, and none stands a round-off before it.
    const double last = end_ - 1e-9 * record_dt_;
    bool moved = false;
    for (; due() < to.t && due() < last; ++next_row_) {
      stepper.interpolate((due() - from.t) / (to.t - from.t), y_);
      chart.finish(due(), y_, between_);
      scene.evaluate(between_.q, between_.v, between_.z, true);
      add_row(scene, between_);
      moved = true;
    }
    if (moved) {
      scene.restart();
      scene.evaluate(to.q, to.v, to.z);
    }
    if (to.t < (due() < last ? due() : end_)) return;
    ++next_row_;
  }
  scene.evaluate(to.q, to.v, to.z, true);
  add_row(scene, to);
}

void Recorder::add_row(SceneData& scene, const State& state) {
  scene.log(state.q, state.v, record_.contacts);
  record_.contact_row.resize(record_.contacts.size(), double(rows_));
  record_.t.push_back(state.t);
  record_.q.insert(record_.q.end(), state.q.begin(), state.q.end());
  record_.v.insert(record_.v.end(), state.v.begin(), state.v.end());
  const Powers& powers = scene.powers();
  const double kinetic = scene.body().kinetic_energy(state.q, state.v);
  const double potential = scene.body().potential_energy(state.q);
  const Ledger& ledger = state.ledger;
  for (double e : {kinetic, potential, powers.elastic + powers.bristles, ledger.damping,
                   ledger.friction - powers.bristles, ledger.control})
    record_.energy.push_back(e);
  ++rows_;
}

void Recorder::add_step(const SceneData& scene, double t, double h) {
  for (std::size_t k = 0; k < summaries_.size(); ++k) {
    const PairState& now = scene.states()[k];
    PairSummary& summary = summaries_[k];
    PairStatus& status = status_[k];
    const auto add_event = [&](Event::Kind kind) {
      record_.events.push_back({t, static_cast<int>(k), kind});
    };
    if (status.touching) summary.contact_time += h;
    summary.impulse += 0.5 * h * (status.normal_force + now.normal_force);
    status.normal_force = now.normal_force;
    const bool touching = now.count > 0;
    if (touching != status.touching) {
      add_event(touching ? Event::Kind::Touch : Event::Kind::LiftOff);
      status.touching = touching;
      status.deep = false;
      if (touching) ++summary.touches;
    }
    const double radius = scene.pairs()[k].least_radius();
    const bool through = now.pushed_through || (radius > 0 && now.depth > radius);
    if (through && !status.through) add_event(Event::Kind::Through);
    status.through = through;
    if (!touching) continue;
    if (now.normal_force > summary.peak_force)
      summary.peak_force = now.normal_force, summary.peak_force_time = t;
    if (now.depth > summary.max_depth) summary.max_depth = now.depth, summary.max_depth_time = t;
    if (radius > 0 && now.depth > 0.5 * radius && !status.deep) {
      status.deep = true;
      add_event(Event::Kind::Deep);
    }
  }
}

}  // namespace sphshell
