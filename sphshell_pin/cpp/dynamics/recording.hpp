// What a run keeps: rows of the motion, events, and figures of each pair.
#pragma once

#include <vector>

#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

struct Event {
  enum class Kind : int { Touch = 0, LiftOff = 1, Deep = 2, Through = 3 };
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

// Readings of sensors in the order of their arrival; `values` holds those of one after the other.
struct SensorRows {
  std::vector<int> sensor;
  std::vector<double> t, sampled, values;  // when it arrived, and when it was taken [s]
};

// Recorded rows: t, q, v, and the terms of the energy audit.
struct Record {
  static constexpr int kEnergies = 6;  // kinetic, potential, elastic, damping, friction, control
  std::vector<double> t, q, v, energy;
  std::vector<ContactRow> contacts;
  std::vector<double> contact_row;  // the recorded row of each contact
  std::vector<Event> events;
  SensorRows sensors;
};

class Recorder {
 public:
  // Rows every `record_dt` from `start` to `end` [s], and at `end`; 0: at the end of every step.
  Recorder(std::size_t pairs, double start, double end, double record_dt);

  // The scene's last evaluate() was at the state.
  void add_row(SceneData& scene, const State& state);
  // The rows due in the last step of `stepper`, which is from `from` to `to`, and at its end.
  // Leaves the forces evaluated at `to`.
  void add_rows(SceneData& scene, const Chart& chart, const Stepper& stepper, const State& from,
                const State& to);
  // Events and figures of a step of h [s] that ends at t; the scene has accepted its end.
  void add_step(const SceneData& scene, double t, double h);

  // Hands over what was recorded since the last call.
  Record take();
  // The state as the only row of a record; the scene's last evaluate() was there.
  Record snapshot(SceneData& scene, const State& state);
  const std::vector<PairSummary>& summaries() const { return summaries_; }

 private:
  struct PairStatus {
    double normal_force = 0;
    bool touching = false, deep = false, through = false;
  };

  double due() const { return start_ + double(next_row_) * record_dt_; }

  double start_, end_, record_dt_;
  Record record_;
  std::vector<PairSummary> summaries_;
  std::vector<PairStatus> status_;
  long rows_ = 0, next_row_ = 1;
  State between_;
  VectorX y_;
};

}  // namespace sphshell
