// One run: the loop over the steps, the controller's torques, and changes on the way.
#pragma once

#include "dynamics/control/controllers.hpp"
#include "dynamics/derivatives/sensitivities.hpp"
#include "dynamics/sensing/sensors.hpp"

namespace sphshell {

struct RunSettings : StepSettings {
  double duration = 0, start_time = 0;  // [s]
  double control_dt = 0;  // hold the torques this long [s]; 0: evaluate at every stage
  double record_dt = 0;   // between recorded rows [s]; 0: every step
  bool patches = false;   // record those of contacts
  bool torques = false;   // record those of the controller
  bool states = false;    // record the state of the run with each row
};

// One run to make.
struct Task {
  std::vector<Pair> pairs;
  JointForces::Effects joints;
  RunSettings settings;
  std::shared_ptr<Controller> controller;
  VectorX q0, v0;
  std::vector<Sensor> sensors = {};
};

// A sphere that starts too deep in a shell for its contacts to be trusted.
struct DeepStart {
  int pair;
  double depth;  // [m]
};

// What the steps of a run cost.
struct Counts {
  long steps = 0;          // accepted
  long rejected = 0;       // made, but their error or a sphere's motion was too large
  long event_steps = 0;    // made to end at an event, but they missed it
  long evaluations = 0;    // of the dynamics, in all of these
  long event_queries = 0;  // of the contacts alone, to locate events on the dense output
};

// What a run tells of itself at any time.
struct Figures {
  double time = 0, last_step = 0, wall_time = 0;  // wall_time: spent in advance() [s]
  Counts counts;
  VectorX q, v;
  std::vector<PairSummary> summaries;  // of the pairs, then of the joints' stops
  std::vector<LimitSummary> limits;    // of the velocities (nv), where there are any
};

// What a run uses and others may share, such as a user's routine.
struct Lent {
  std::vector<Pair> pairs;
  std::shared_ptr<Controller> controller;
};

// A run that goes on in pieces: steps, controllers, sensors, recording.
class Simulation : private Torques {
 public:
  enum class Status : int { Running = 0, Finished = 1, Diverged = 2, Stuck = 3 };

  Simulation(const pinocchio::Model& model, Task task);

  // Before the start: what is recorded changes with these by so much. The controller is then asked
  // at other states, too.
  void differentiate(SensitivitySettings settings);
  SensitivityRecord take_sensitivities() {
    return sensitivities_ ? sensitivities_->take() : SensitivityRecord();
  }

  // Before the start: go on from the state of another run, as rows have it. False where it is not
  // of such a scene.
  bool resume(const std::vector<double>& state);

  // Whether the controller, asked twice at a state, has given two answers.
  bool controller_remembers() const { return sensitivities_ && sensitivities_->torques_remember(); }

  // The first pair whose sphere is deeper than half its radius (of two spheres, the smaller) at the
  // start, or inside a closed one-sided shell on the wrong side, however far.
  std::optional<DeepStart> deep_start();
  // Runs for about `wall_seconds` of wall-clock time, to the first step that ends at the time
  // `until` or later, or until `stop` is set.
  Status advance(double wall_seconds, double until = std::numeric_limits<double>::infinity(),
                 const std::atomic<bool>* stop = nullptr);
  // Hands over what was recorded since the last call.
  Record take();
  // The current state as the only row of a record; what was recorded stays.
  Record snapshot();

  // From now on rows have the controller's torques, cut to their limits. A controller whose torques
  // are not held is asked for them at each row.
  void record_torques();

  // From now on the same pairs have other laws, friction (of the same kind) and radii, stops and
  // dry friction of joints have other values, and the controller is another, unless null. The
  // energy this brings counts as the controller's work.
  void change(std::vector<Pair> pairs, JointForces::Effects joints,
              std::shared_ptr<Controller> controller);
  // Go on where the controller of `before` is, which is at the same time.
  void take_over(const Simulation& before);
  // From now on a force acts at a point of the joint's frame; zero ends it. Its work counts as the
  // controller's. `frame`: the number of the one to whose body the point belongs.
  void push(int joint, const Vec3& point, const PointForce& force, int frame);
  // Whether the rows from now on have the patches of their contacts.
  void record_patches(bool on) { recorder_.record_patches(on); }

  // Hands over what a caller may share; the run is at its end.
  Lent give_back() { return {scene_.give_back(), std::move(controller_)}; }

  double progress() const {
    return settings_.duration > 0 ? (time() - settings_.start_time) / settings_.duration : 1.0;
  }
  double time() const { return stepping_.state().t; }
  const VectorX& q() const { return stepping_.state().q; }
  const VectorX& v() const { return stepping_.state().v; }
  Figures figures() const {
    return {time(),
            stepping_.proposal(),
            wall_time_,
            {steps_, stepping_.rejected(), stepping_.event_steps(), stepping_.evaluations(),
             stepping_.event_queries()},
            q(),
            v(),
            recorder_.summaries(),
            recorder_.limits()};
  }
  const pinocchio::Model& model() const { return scene_.body().model(); }
  const std::vector<Pair>& pairs() const { return scene_.pairs(); }
  const Controller* controller() const { return controller_.get(); }

 private:
  const VectorX& torque(double t, const VectorX& q, const VectorX& v) override;
  bool follow_state() const override;
  bool follow_time() const override;

  // The state of the run where its last step was accepted, for rows within the next one.
  void keep_state();
  void start();
  void begin_record();
  void count_steps();
  // Parts of a step, in their order: its length, the step itself (divided where a fixed one is too
  // long), derivatives, acceptance, and the torques that are held from then on.
  void begin_sensors();
  Status step();
  bool make_controlled(double end);
  void accept();
  void hold_torques();
  void command(double t, const VectorX& q, const VectorX& v);
  double end_of_step() const;
  bool is_finite() const;
  double end() const { return settings_.start_time + settings_.duration; }
  bool at_end() const { return time() >= end(); }

  RunSettings settings_;
  SceneData scene_;
  std::shared_ptr<Controller> controller_;
  Stepping stepping_;
  Recorder recorder_;
  Push push_;
  std::unique_ptr<Sensors> sensors_;              // null where there are none
  std::unique_ptr<Sensitivities> sensitivities_;  // null unless asked for
  VectorX tau_;
  std::vector<char> cut_;       // torques that were cut to their limit, when last computed
  std::vector<char> made_cut_;  // and in the step that was made
  long grid_ = 0, grid_steps_ = 0,
       steps_ = 0;      // of the fixed step: which it is, how many there are
  int fine_steps_ = 0;  // made of the fixed step under way
  double wall_time_ = 0;
  double until_ = std::numeric_limits<double>::infinity();  // where advance() stops [s]
  double next_control_;                                     // when held torques change next [s]
  long controls_ = 0;
  double kink_ = std::numeric_limits<double>::infinity();  // of the torques, next in time [s]
  bool started_ = false, finished_ = false;
  std::vector<double> kept_;  // see keep_state()
};

}  // namespace sphshell
