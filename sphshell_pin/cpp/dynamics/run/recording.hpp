// What a run keeps: rows of the motion, events, and figures of each pair.
#pragma once

#include "dynamics/run/stepping.hpp"

namespace sphshell {

// At time t [s], of a pair, a joint stop or a joint.
struct Event {
  enum class Kind : int {
    Touch,
    LiftOff,
    Deep,
    Through,
    BeyondHertz,  // the theory of its law does not hold
    Stop,         // a joint reaches a stop, and leaves it
    StopLeft,
    EffortLimit,  // a controller's torque begins to be cut, and ends
    EffortLimitLeft,
    SpeedLimit,  // a joint becomes faster than its limit, and slower
    SpeedLimitLeft
  };
  double t;
  int pair;  // of a stop, its number; of a limit, that of the velocity
  Kind kind;
};

// Figures of one pair, or of one stop of a joint, over the run.
struct PairSummary {
  double contact_time = 0;  // [s]
  double impulse = 0;       // of the normal force [N s]
  double peak_force = 0;    // largest sum of the normal forces [N]
  double peak_force_time = 0;
  double max_depth = 0;  // [m]
  double max_depth_time = 0;
  int touches = 0;
};

// Of one velocity over the run; times are -1 where it never was so.
struct LimitSummary {
  double cut_time = 0, first_cut = -1;         // of the controller's torque [s]
  double peak_speed = 0, first_too_fast = -1;  // [rad/s or m/s], [s]
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
  std::optional<std::vector<PatchRow>> patches;  // of the contacts, where they are asked for
  std::optional<std::vector<double>> torques;    // of the controller (nv), where asked for; or nan
  // Those of runs, where asked for, one behind the other, and how many numbers each has.
  std::optional<std::vector<double>> states;
  std::vector<double> state_sizes;
  std::vector<double> contact_row;  // the recorded row of each contact
  std::vector<Event> events;
  SensorRows sensors;
};

// Of each recorded row, in rows of one number a column: changes of q and v; of each of its contacts
// those of the force on the sphere (three rows), the normal force and the depth.
struct SensitivityRecord {
  std::vector<double> q, v, force_world, normal_force, depth;
};

// Records something more of each row.
class RowFollower {
 public:
  virtual ~RowFollower() = default;
  // `share`: where in the step under way the state is; the scene's last evaluate() was there.
  virtual void add_row(const State& state, double share) = 0;
};

// What a run leaves behind: rows, events, sums and peaks of each pair.
class Recorder {
 public:
  // Rows every `record_dt` from `start` to `end` [s], and at `end`; 0: at the end of every step.
  Recorder(SceneData& scene, double start, double end, double record_dt, bool patches);

  // Whether the rows from now on have the patches of their contacts; those of rows that are
  // recorded already are unknown.
  void record_patches(bool on);
  void set_follower(RowFollower* follower) { follower_ = follower; }

  // From now on rows have the torques (nv) that `torques` gives where the scene was evaluated.
  using TorquesAt = std::function<const VectorX&(const State&)>;
  void record_torques(TorquesAt torques, Eigen::Index nv);

  // From now on rows have the state of the run that this refers to.
  void record_states(const std::vector<double>& state) {
    run_state_ = &state;
    record_.states.emplace();
  }
  // Of a run that goes on at time t, from another's start to `end`.
  void go_on(double start, double end, double t);

  // The scene's last evaluate() was at the state; `share`: see RowFollower.
  void add_row(const State& state, double share = 1);
  // The rows due in the step that was made, and at its end, where it leaves the forces evaluated.
  void add_rows(const Stepping& made);
  // The largest force and depth of each pair and stop within the same step, where its dense output
  // has them between its ends. The scene's last evaluate() was at its end, and it is left there.
  void add_peaks(const Stepping& made);
  // Events and figures of a step of h [s] that ends at t; the scene has accepted its end.
  void add_step(double t, double h);

  // The same of limits of torque and speed; `cut`: which torques were cut.
  void add_limits(const VectorX& v, const std::vector<char>& cut, double t, double h);

  // Hands over what was recorded since the last call.
  Record take();
  // The state as the only row of a record; the scene's last evaluate() was there.
  Record snapshot(const State& state);
  const std::vector<PairSummary>& summaries() const { return summaries_; }
  const std::vector<LimitSummary>& limits() const { return limits_; }

 private:
  struct PairStatus {
    TouchState touch;  // at the end of the last step
    bool deep = false, through = false, beyond_hertz = false;
  };
  struct LimitStatus {
    bool cut = false, too_fast = false;
  };

  // Of pair or stop k at the state of the scene; and peaks that it raises.
  static void raise_peaks(PairSummary& summary, const TouchState& now, double t);
  void add_touch(std::size_t k, double t, double h, int number, Event::Kind begin);

  double due() const { return start_ + double(next_row_) * record_dt_; }

  SceneData& scene_;
  double start_, end_, record_dt_;
  Record record_;
  std::vector<PairSummary> summaries_;
  std::vector<PairStatus> status_;
  std::vector<TouchState> touches_;  // at the end of the step that was made
  std::vector<LimitSummary> limits_;
  std::vector<LimitStatus> limit_status_;
  long rows_ = 0, next_row_ = 1;
  State between_;
  RowFollower* follower_ = nullptr;
  TorquesAt torques_;  // empty unless asked for
  const std::vector<double>* run_state_ = nullptr;
};

}  // namespace sphshell
