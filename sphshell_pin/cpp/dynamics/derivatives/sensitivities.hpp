// How the motion of a run changes with parameters and with its start.
#pragma once

#include "dynamics/derivatives/step_derivatives.hpp"
#include "dynamics/run/recording.hpp"

namespace sphshell {

struct SensitivitySettings {
  std::vector<Parameter> parameters;
  bool by_q0 = false, by_v0 = false;

  bool any() const { return !parameters.empty() || by_q0 || by_v0; }
};

// Follows a run step by step. A change has a column: those of the parameters, of q0 in its tangent
// space, of v0.
class Sensitivities : public RowFollower {
 public:
  Sensitivities(SceneData& scene, SensitivitySettings settings);

  // The torques that are held from now on are those of a controller at this state.
  void hold(const TorqueAt& torque, const State& state);
  // A step was made; leaves the scene evaluated at its end.
  void step(Stepping& made);
  // The step is accepted next; `located`: it ends at an event.
  void accept(const State& to, bool located);
  // A row of what is recorded. Leaves the scene evaluated there.
  void add_row(const State& state, double share) override;

  // Hands over what was recorded since the last call.
  SensitivityRecord take() { return std::exchange(record_, {}); }
  bool torques_remember() const { return slopes_.torques_remember(); }

 private:
  // Adds what an event at the end of the step does to the changes.
  void jump(const State& to);
  std::vector<char> touching_pairs() const;
  Eigen::RowVectorXd time_of(const State& at, const std::vector<char>& touched, bool ends);
  // Stretches of bristles that begin, and their new order.
  void begin_contacts(const State& to);
  void reorder_bristles(const VectorX& z);
  // The change, as the state changes, of what has these slopes of contacts.
  MatrixX changed(const MatrixX& slopes, const MatrixX& by) const {
    return applied(slopes, by, slopes.rightCols(parameters_));
  }

  SceneData& scene_;
  StepSlopes slopes_;
  Eigen::Index columns_, parameters_;
  MatrixX now_, next_, between_;  // at the state; at the end of the step that was made
  MatrixX torque_;                // held
  ContactForceSlopes contacts_;
  Stepping* made_ = nullptr;  // the step that was made, until it is accepted
  double h_ = 0;
  SensitivityRecord record_;
};

}  // namespace sphshell
