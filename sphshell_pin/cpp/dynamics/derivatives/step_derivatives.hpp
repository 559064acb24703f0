// How changes of a state, of torques and of parameters travel along a step.
#pragma once

#include "dynamics/derivatives/coordinate_derivatives.hpp"
#include "dynamics/derivatives/linearization.hpp"

namespace sphshell {

class Stepper;

// Torques at a state at which the scene has been evaluated.
using TorqueAt = std::function<const VectorX&(double t, const VectorX& q, const VectorX& v)>;

// Changes as ChartSlopes has them; the first columns are those of the parameters.
class StepSlopes {
 public:
  StepSlopes(SceneData& scene, std::vector<Parameter> parameters);

  // Moves `changes` from the chart's origin to the end of the last step of `stepper`, h long, or to
  // a share of it by its dense output, where held torques change by `torque` (nv). Leaves the scene
  // evaluated elsewhere.
  void carry(Chart& chart, const Stepper& stepper, double h, const MatrixX& torque,
             MatrixX& changes, double share = 1);

  // What carry() is made of. The changes of the rates at y that go with those of y.
  MatrixX rates(Chart& chart, double t, const VectorX& y, const MatrixX& by);
  // As carry(), from the rates of bristles at the chart's origin with another velocity.
  MatrixX bristle_rates(Chart& chart, const VectorX& v, const MatrixX& v_by);
  // The changes of y at the origin, and those of a state from those of y there.
  MatrixX at_origin() const;
  MatrixX finish(Chart& chart, const VectorX& y, const MatrixX& by);
  // Moves the changes at the origin to the share of the step's dense output, by the Radau method of
  // order 5 for the equations of the changes, which are linear, in steps as short as they need.
  void along(Chart& chart, const Stepper& stepper, double h, double share, MatrixX& out);

  // Differences torques at a state by (u, v, z), (nv, 2 nv + nz), and by the parameters.
  void torque_slopes(const TorqueAt& torque, double t, const VectorX& q, const VectorX& v,
                     const VectorX& z);

  // The changes of torques whose slopes were found last.
  MatrixX held(const MatrixX& at) const {
    return applied(torque_slopes_, at, torque_by_parameters_);
  }

  // Whether torques asked for twice at a state were not the same: they cannot be differenced.
  bool torques_remember() const { return remembers_; }

  Linearization& linearization() { return linearization_; }

 private:
  struct Path {
    Chart& chart;
    const Stepper& stepper;
    double h;
  };
  // Halves a part of the path until the changes agree.
  void follow(const Path& path, double from, double to, int depth, MatrixX& changes);
  // One step between two shares of the path; whether anything touches there.
  bool radau(const Path& path, double from, double to, MatrixX& changes);
  // The rates at a state, and how the last ones answer.
  void linearize(Chart& chart, double t);
  // Of (v', z') by the torques that are held, and by the parameters, at a held state.
  MatrixX own_rates() const;

  SceneData& scene_;
  Linearization linearization_;
  ChartSlopes chart_slopes_;
  const MatrixX* origin_ = nullptr;
  const MatrixX* torque_ = nullptr;
  State state_;
  VectorX tau_, q_, v_, z_, u_, y_;
  VectorX scales_;  // of the columns
  MatrixX jacobian_, torque_slopes_, torque_by_parameters_;
  bool follows_ = false;  // torques do, and torque_slopes_ says how
  bool remembers_ = false;
};

}  // namespace sphshell
