// What a run writes down.
#include <algorithm>
#include <utility>

#include "dynamics/simulation.hpp"

namespace sphshell {
namespace {

constexpr std::size_t kRowsPerCall = 4096;
constexpr std::size_t kContactsPerCall = 16384;

}  // namespace

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

bool Simulation::full() const {
  return record_.t.size() >= kRowsPerCall || record_.contacts.size() * 2 > kContactsPerCall ||
         record_.events.size() > 128;
}

Record Simulation::take() {
  Record out;
  std::swap(out, record_);
  reserve();
  return out;
}

Record Simulation::snapshot() {
  if (!started_) start();
  Record out;
  std::swap(out, record_);
  const long rows = std::exchange(rows_, 0);
  write_row(state_);
  rows_ = rows;
  std::swap(out, record_);
  return out;
}

// Rows within the step to next_, and at its end.
void Simulation::record_within(Stepper& stepper) {
  const double end = settings_.start_time + settings_.duration;
  if (settings_.record_dt > 0) {
    // The end is a row, and none stands a round-off before it.
    const double last = end - 1e-9 * settings_.record_dt;
    bool moved = false;
    for (;; ++next_row_) {
      const double t = settings_.start_time + double(next_row_) * settings_.record_dt;
      if (t >= next_.t || t >= last) break;
      stepper.interpolate((t - state_.t) / (next_.t - state_.t), interpolated_);
      chart_.finish(t, interpolated_, between_);
      scene_.evaluate(between_.q, between_.v, between_.z, true);
      write_row(between_);
      moved = true;
    }
    if (moved) {
      scene_.restart();
      scene_.evaluate(next_.q, next_.v, next_.z);
    }
    const double t = settings_.start_time + double(next_row_) * settings_.record_dt;
    if (next_.t < (t < last ? t : end)) return;
    ++next_row_;
  }
  scene_.evaluate(next_.q, next_.v, next_.z, true);
  write_row(next_);
}

// The scene's forces are those at the state.
void Simulation::write_row(const State& state) {
  scene_.log(state.q, state.v, record_.contacts);
  record_.contact_row.resize(record_.contacts.size(), double(rows_));
  record_.t.push_back(state.t);
  record_.q.insert(record_.q.end(), state.q.data(), state.q.data() + state.q.size());
  record_.v.insert(record_.v.end(), state.v.data(), state.v.data() + state.v.size());
  const Powers& powers = scene_.powers();
  const double kinetic = scene_.body().kinetic_energy(state.q, state.v);
  const double potential = scene_.body().potential_energy(state.q);
  const Ledger& ledger = state.ledger;
  for (double e : {kinetic, potential, powers.elastic + powers.bristles, ledger.damping,
                   ledger.friction - powers.bristles, ledger.control})
    record_.energy.push_back(e);
  ++rows_;
}

void Simulation::note_pairs(double h) {
  const auto event = [&](std::size_t k, Event::Kind kind) {
    record_.events.push_back({state_.t, static_cast<int>(k), kind});
  };
  for (std::size_t k = 0; k < summaries_.size(); ++k) {
    const PairState& now = scene_.states()[k];
    PairSummary& summary = summaries_[k];
    pieces_[k] = now.pieces;
    clamped_[k] = now.clamped;
    if (touching_[k]) summary.contact_time += h;
    summary.impulse += 0.5 * h * (normal_force_[k] + now.normal_force);
    normal_force_[k] = now.normal_force;
    const bool touching = now.count > 0;
    if (touching != bool(touching_[k])) {
      event(k, touching ? Event::Kind::Touch : Event::Kind::LiftOff);
      touching_[k] = touching;
      deep_[k] = 0;
      if (touching) ++summary.touches;
    }
    const double radius = scene_.pairs()[k].radius;
    const bool through = now.pushed_through || (radius > 0 && now.depth > radius);
    if (through && !through_[k]) event(k, Event::Kind::Through);
    through_[k] = through;
    if (!touching) continue;
    if (now.normal_force > summary.peak_force)
      summary.peak_force = now.normal_force, summary.peak_force_time = state_.t;
    if (now.depth > summary.max_depth)
      summary.max_depth = now.depth, summary.max_depth_time = state_.t;
    if (radius > 0 && now.depth > 0.5 * radius && !deep_[k]) {
      deep_[k] = 1;
      event(k, Event::Kind::Deep);
    }
  }
}

}  // namespace sphshell
