// Linearly implicit methods: one Jacobian and one factorization a step, no iteration.
#pragma once

#include <Eigen/LU>

#include "dynamics/integrators/stepper.hpp"
#include "dynamics/derivatives/linearization.hpp"

namespace sphshell {

// The rates of a chart at its origin, their Jacobian, and systems with I / (gamma h) - Jacobian.
class ImplicitStepper : public Stepper {
 public:
  explicit ImplicitStepper(SceneData& scene) : linearization_(scene) {}
  void begin(Chart& chart) override;
  bool is_implicit() const override { return true; }

 protected:
  // Of I / gamma_h - Jacobian.
  void factorize(double gamma_h);
  // In place; work is no part of the system.
  void solve(VectorX& x);
  MatrixX solved(const MatrixX& columns) const { return lu_.solve(columns); }

  VectorX rate_of_time_;

 private:
  // How torques change with the state, and with time; and the Jacobian in coordinates of the chart.
  void linearize_torques(Chart& chart);
  void add_time(Chart& chart);
  void to_chart(Chart& chart);

  Linearization linearization_;
  Eigen::MatrixXd rates_, jacobian_, matrix_, torque_by_state_;
  Eigen::PartialPivLU<Eigen::MatrixXd> lu_;
  VectorX q_, v_, torque_, column_, u_, solution_;
  int nv_ = 0, nz_ = 0;
};

// One stage, order 1, L-stable: whatever the stiffness, a step of any size is stable.
class LinearlyImplicitEuler : public ImplicitStepper {
 public:
  using ImplicitStepper::ImplicitStepper;
  void step(Chart& chart, double h, State& out) override;
  void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const override;
  bool leaves_work() const override { return true; }
};

// Order 4 with an estimate of order 3, six stages, L-stable and stiffly accurate: RODAS of Hairer
// and Wanner, Solving Ordinary Differential Equations II, IV.7.
class Rodas : public ImplicitStepper {
 public:
  using ImplicitStepper::ImplicitStepper;
  void step(Chart& chart, double h, State& out) override;
  void complete(Chart& chart, State& out) override;
  void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const override {
    carry_along(slopes, chart, h, changes);
  }
  int order_of_error() const override { return 4; }
  void interpolate(double theta, VectorX& y) const override;

 private:
  static constexpr int kStages = 6;
  VectorX g_[kStages], stage_, rate_at_stage_, middle_;
  Eigen::Vector3d power_[3] = {Vec3::Zero(), Vec3::Zero(),
                               Vec3::Zero()};  // at the start, the middle and the end
  double h_ = 0;
};

}  // namespace sphshell
