// Explicit methods.
#pragma once

#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

// v += dt a(q, v), then q is moved by dt v: order 1, symplectic for conservative forces.
class SemiImplicitEuler : public Stepper {
 public:
  void step(Chart& chart, double h, State& out) override;
  void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const override;
  bool leaves_work() const override { return true; }
};

// Runge-Kutta methods: stage i is y + h sum_j a[i][j] k[j].
class ExplicitRungeKutta : public Stepper {
 public:
  void begin(Chart& chart) override;
  void step(Chart& chart, double h, State& out) override;
  void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const override;

 protected:
  struct Row {
    double node;
    std::array<double, 6> a;
  };
  explicit ExplicitRungeKutta(std::vector<Row> rows, std::vector<double> weights)
      : rows_(std::move(rows)), weights_(std::move(weights)), k_(rows_.size() + 1) {}

  std::vector<Row> rows_;        // of the stages behind the first
  std::vector<double> weights_;  // of all stages
  std::vector<VectorX> k_;
  VectorX stage_;
  double h_ = 0;
};

// The classical method of order 4.
class RungeKutta4 : public ExplicitRungeKutta {
 public:
  RungeKutta4();
};

// Order 5 with an estimate of order 4 (Dormand and Prince, J. Comput. Appl. Math. 6, 1980), dense
// output of order 4 (Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6).
class DormandPrince : public ExplicitRungeKutta {
 public:
  DormandPrince();
  void step(Chart& chart, double h, State& out) override;
  void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const override {
    carry_along(slopes, chart, h, changes);
  }
  int order_of_error() const override { return 5; }
  void interpolate(double theta, VectorX& y) const override;
};

}  // namespace sphshell
