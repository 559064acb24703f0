// One step of a run: of a given length, or as long as the error allows.
#pragma once

#include "dynamics/run/events.hpp"
#include "dynamics/run/continuous_detection.hpp"
#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

// dt > 0: fixed steps; else the tolerances hold.
struct StepSettings {
  std::string integrator = "semi-implicit-euler";  // a name of integrators/table.cpp
  double dt = 0;                                   // of a fixed step [s]; 0: the error decides
  double rtol = 0, atol = 0;                       // per step, of the state
};

// A step is first made, then accepted; in between its rows are recorded.
class Stepping {
 public:
  enum class Made { Step, Nothing, Stuck };

  Stepping(SceneData& scene, Torques& torques, const StepSettings& settings, State start);

  // Evaluates the scene at the state, where a run begins or its scene has changed.
  void restart();
  // What the next steps depend on beside the scene's memory, as numbers; resume() goes on from
  // them, where the scene's memory has been loaded into the state's bristles.
  std::vector<double> save() const;
  static constexpr std::size_t kSaved = 12;  // numbers beside q and v
  void resume(const double* from);
  // A fixed step to `end`. False where it would carry a sphere too far: it is not made.
  bool make_fixed(double end);
  // A step whose length the error decides, to `end` at most; it ends at the first event. Nothing:
  // `end` is a round-off away, and the state is there now.
  Made make_controlled(double end);
  // What was made becomes the state.
  void accept();

  State& state() { return state_; }
  const State& state() const { return state_; }
  const State& next() const { return next_; }
  const Stepper& stepper() const { return *active_; }
  const Chart& chart() const { return chart_; }
  Chart& chart() { return chart_; }
  // The state at time t, a share of the step that was made, by its dense output.
  void interpolate(double share, double t, State& out) const {
    active_->interpolate(share, dense_);
    chart_.finish(t, dense_, out);
  }
  // Sets the loss of damping at a state within the step, at which the scene is evaluated, where the
  // law's clamp holds every force at zero: it is all that was stored, whatever the quadrature says.
  void close_loss(State& at) const;
  // Whether the controlled step that was made ends at an event.
  bool at_event() const { return after_event_; }
  // Steps of the fixed length are replaced by controlled ones where a sphere moves too far.
  bool fine() const { return active_ != stepper_.get(); }
  // Whether fixed steps are divided by a method with error control.
  void set_fine(bool fine);

  double proposal() const { return proposal_; }  // of the next controlled step [s]
  long evaluations() const { return chart_.evaluations(); }
  long rejected() const { return rejected_; }
  long event_steps() const { return event_steps_; }  // tried to end at an event, and not kept
  long event_queries() const { return events_.queries(); }

 private:
  struct Tolerances {
    double rtol, atol;
  };

  Tolerances tolerances() const;
  double error_norm() const;
  double weighted(const VectorX& change, const VectorX& y) const;
  double first_step();
  double predicted_step(double h);
  void begin();
  bool passes_kinks() const;
  double step_to_event(double h, double left, bool is_met);

  const StepSettings settings_;
  SceneData& scene_;
  Chart chart_;
  // The second one is for what a fixed step cannot resolve.
  std::unique_ptr<Stepper> stepper_, fine_stepper_;
  Stepper* active_;
  ContinuousDetection detection_;
  Events events_;
  State state_, next_;
  Powers last_;
  // A contact on a plane where the step begins.
  struct Place {
    int pair;
    Vec3 point;
    double depth;
    Vec3 slip;
  };

  bool divides_ = false;  // fixed steps of high order, which must not pass kinks
  std::vector<Place> places_;
  VectorX probe_, rate_;
  mutable VectorX sizes_, dense_;
  double proposal_ = 0, last_error_ = 1;  // of the next step [s]; of the last one
  bool after_event_ = false;              // the last step ended at one
  bool free_ = false;                     // nothing touches at the state
  bool held_ = false;                     // a clamp holds the force of all that touches at zero
  long rejected_ = 0, event_steps_ = 0;
};

}  // namespace sphshell
