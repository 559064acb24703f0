// One run: the loop over the steps, and what it writes down.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dynamics/controllers.hpp"
#include "dynamics/integrators.hpp"

namespace sphshell {

struct RunSettings {
  double dt = 1e-4, duration = 0, start_time = 0;  // [s]
  double control_dt = 0;  // hold the torques this long [s]; 0: evaluate at every stage
  int record_every = 1;   // steps between recorded rows
  bool runge_kutta = false;
};

struct Event {
  enum class Kind : int { Touch = 0, LiftOff = 1, Deep = 2 };
  double t;
  int pair;
  Kind kind;
};

// Figures of one pair over the run.
struct PairSummary {
  double contact_time = 0;  // [s]
  double impulse = 0;       // of the normal force [N s]
  double peak_force = 0;    // largest sum of the normal forces [N]
  double peak_force_time = 0;
  double max_depth = 0;  // [m]
  double max_depth_time = 0;
  int touches = 0;
};

// Recorded rows, in blocks: t, q, v, and the terms of the energy audit.
struct Record {
  static constexpr int kEnergies = 6;  // kinetic, potential, elastic, damping, friction, control
  std::vector<double> t, q, v, energy;
  std::vector<ContactRow> contacts;
  std::vector<double> contact_row;  // the recorded row of each contact
  std::vector<Event> events;
};

class Simulation : private Derivative {
 public:
  enum class Status : int { Running = 0, Finished = 1, Diverged = 2 };

  Simulation(const pinocchio::Model& model, std::vector<Pair> pairs, RunSettings settings,
             std::shared_ptr<Controller> controller, VectorX q0, VectorX v0);

  // Runs for about `wall_seconds` of wall-clock time, or until the records of this call are full.
  Status advance(double wall_seconds);
  // Hands over what was recorded since the last call.
  Record take();

  double progress() const { return settings_.duration > 0 ? double(step_) / steps_ : 1.0; }
  double time() const { return state_.t; }
  const VectorX& q() const { return state_.q; }
  const VectorX& v() const { return state_.v; }
  long steps() const { return step_; }
  double wall_time() const { return wall_time_; }  // spent in advance() [s]
  const std::vector<PairSummary>& summaries() const { return summaries_; }
  const pinocchio::Model& model() const { return scene_.body().model(); }

 private:
  void contacts(const VectorX& q, const VectorX& v) override;
  const VectorX& torque(double t, const VectorX& q, const VectorX& v) override;
  Scene& scene() override { return scene_; }

  void reserve();
  void hold_torques();
  void evaluate(bool record);
  void note_pairs(double dt);
  void write_row();

  RunSettings settings_;
  Scene scene_;
  std::shared_ptr<Controller> controller_;
  std::unique_ptr<Integrator> integrator_;
  State state_;
  VectorX tau_;
  Ledger ledger_;
  Powers last_;
  Record record_;
  std::vector<PairSummary> summaries_;
  std::vector<char> touching_, deep_;
  long step_ = 0, steps_ = 0, rows_ = 0;
  double last_dt_ = 0, wall_time_ = 0;
  double next_control_ = 0;  // when held torques change next, since the start [s]
  bool finished_ = false;
};

}  // namespace sphshell
