// One run: the loop over the steps, and what it writes down.
#pragma once

#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "dynamics/controllers.hpp"
#include "dynamics/guard.hpp"
#include "dynamics/integrators/stepper.hpp"
#include "dynamics/push.hpp"

namespace sphshell {

enum class Integrator : int {
  SemiImplicitEuler = 0,
  RungeKutta4 = 1,
  LinearlyImplicitEuler = 2,
  Adaptive = 3,
  Implicit = 4
};

struct RunSettings {
  Integrator integrator = Integrator::SemiImplicitEuler;
  double dt = 0;                        // of a fixed step [s]; 0: the error decides
  double rtol = 0, atol = 0;            // per step, of the state
  double duration = 0, start_time = 0;  // [s]
  double control_dt = 0;  // hold the torques this long [s]; 0: evaluate at every stage
  double record_dt = 0;   // between recorded rows [s]; 0: every step
};

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

// Recorded rows, in blocks: t, q, v, and the terms of the energy audit.
struct Record {
  static constexpr int kEnergies = 6;  // kinetic, potential, elastic, damping, friction, control
  std::vector<double> t, q, v, energy;
  std::vector<ContactRow> contacts;
  std::vector<double> contact_row;  // the recorded row of each contact
  std::vector<Event> events;
};

// What a run uses and others may share, such as a user's routine.
struct Lent {
  std::vector<Pair> pairs;
  std::shared_ptr<Controller> controller;
};

class Simulation : private Torques {
 public:
  enum class Status : int { Running = 0, Finished = 1, Diverged = 2, Stuck = 3 };

  Simulation(const pinocchio::Model& model, std::vector<Pair> pairs, RunSettings settings,
             std::shared_ptr<Controller> controller, VectorX q0, VectorX v0);

  // Runs for about `wall_seconds` of wall-clock time, to the first step that ends at the time
  // `until` or later, or until the records of this call are full.
  Status advance(double wall_seconds, double until = std::numeric_limits<double>::infinity());
  // No more rows fit: advance() returns at once until take() is called.
  bool full() const;
  // Hands over what was recorded since the last call.
  Record take();
  // The state where the run stands as the only row of a record; what was recorded stays.
  Record snapshot();

  // From now on the same pairs have other laws, friction (of the same kind) and radii, and the
  // controller is another, unless null. The energy this brings counts as the controller's work.
  void change(std::vector<Pair> pairs, std::shared_ptr<Controller> controller);
  // From now on a force [N] in the world acts at a point of the joint's frame; zero ends it. Its
  // work counts as the controller's.
  void push(int joint, const Vec3& point, const Vec3& force_world);

  // Hands over what a caller may share; the run is at its end.
  Lent give_back() { return {scene_.give_back(), std::move(controller_)}; }

  double progress() const {
    return settings_.duration > 0 ? (state_.t - settings_.start_time) / settings_.duration : 1.0;
  }
  double time() const { return state_.t; }
  const VectorX& q() const { return state_.q; }
  const VectorX& v() const { return state_.v; }
  long steps() const { return steps_; }
  long rejected() const { return rejected_; }
  long evaluations() const { return chart_.evaluations(); }
  double last_step() const { return proposal_; }   // [s]
  double wall_time() const { return wall_time_; }  // spent in advance() [s]
  const std::vector<PairSummary>& summaries() const { return summaries_; }
  const pinocchio::Model& model() const { return scene_.body().model(); }
  const std::vector<Pair>& pairs() const { return scene_.pairs(); }
  const Controller* controller() const { return controller_.get(); }

 private:
  const VectorX& torque(double t, const VectorX& q, const VectorX& v) override;
  bool follow_state() const override;
  bool follow_time() const override;

  void reserve();
  void start();
  Status step();
  bool fixed_step(double end);
  void set_fine(bool fine);
  bool is_finite() const;
  Status controlled_step(Stepper& stepper, double end);
  void attempt(Stepper& stepper, double h);
  double error_of(const Stepper& stepper);
  bool meets_event() const;
  double step_to_event(Stepper& stepper, double h);
  void keep(bool leaves_work);
  void hold_torques();
  void note_pairs(double h);
  void record_within(Stepper& stepper);
  void write_row(const State& state);
  double end_of_step() const;
  bool at_end() const { return state_.t >= settings_.start_time + settings_.duration; }

  RunSettings settings_;
  Scene scene_;
  std::shared_ptr<Controller> controller_;
  Chart chart_;
  std::unique_ptr<Stepper> stepper_;
  // For what a fixed step cannot resolve: a sphere that would pass through a shell in one.
  std::unique_ptr<Stepper> fine_stepper_;
  Guard guard_;
  Push push_;
  State state_, next_, between_;
  VectorX tau_, sizes_, interpolated_;
  Powers last_;
  std::vector<int> pieces_, clamped_;  // of each pair at state_
  Record record_;
  std::vector<PairSummary> summaries_;
  std::vector<double> normal_force_;
  std::vector<char> touching_, deep_, through_;
  int fine_steps_ = 0;  // made of the fixed step under way
  long grid_ = 0, grid_steps_ = 0, steps_ = 0, rejected_ = 0, rows_ = 0, next_row_ = 0;
  double wall_time_ = 0;
  double until_ = std::numeric_limits<double>::infinity();  // where advance() stops [s]
  double next_control_ = 0;                                 // when held torques change next [s]
  long controls_ = 0;
  double kink_ = std::numeric_limits<double>::infinity();  // of the torques, next in time [s]
  double proposal_ = 0, last_error_ = 1;                   // of the next step [s]; of the last one
  bool started_ = false, finished_ = false, fine_ = false;
};

}  // namespace sphshell
