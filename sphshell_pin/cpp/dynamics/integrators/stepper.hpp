// What the loop of a simulation asks of a method.
#pragma once

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

class Stepper {
 public:
  virtual ~Stepper() = default;

  // Moves on from the chart's origin by h. step() may be repeated with another h.
  virtual void begin(Chart& chart) = 0;
  virtual void step(Chart& chart, double h, State& out) = 0;

  // After a step that is kept, unless its error or the scene forbids: leaves the forces evaluated
  // at `out`.
  virtual void complete(Chart& chart, State& out) { chart.scene().evaluate(out.q, out.v, out.z); }

  // Of a method that estimates its error: the order of the estimate, and the estimate of the last
  // step, beside y.
  virtual int order_of_error() const { return 0; }
  virtual const VectorX& error() const { return error_; }
  // y at the end of the last step.
  const VectorX& end() const { return y_; }
  // y within the last step, at the share theta of it.
  virtual void interpolate(double /*theta*/, VectorX& /*y*/) const {}
  // True where the loop gathers the work of contacts, by the trapezoidal rule.
  virtual bool leaves_work() const { return false; }

 protected:
  VectorX y_, error_;
};

}  // namespace sphshell
