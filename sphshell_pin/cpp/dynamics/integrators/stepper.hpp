// What the loop of a simulation asks of a method.
#pragma once

#include <string_view>

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

class StepSlopes;

// An integration method: one step at a time, which may be repeated.
class Stepper {
 public:
  virtual ~Stepper() = default;

  // Moves on from the chart's origin by h. step() may be repeated with another h.
  virtual void begin(Chart& chart) {
    chart.start(start_);
    chart.rate_at_origin(rate_);
  }
  virtual void step(Chart& chart, double h, State& out) = 0;
  // Once, after a step that is kept: what its end or its work still needs.
  virtual void complete(Chart& /*chart*/, State& /*out*/) {}

  // Of a method that estimates its error: the order of the estimate, and the estimate of the last
  // step, beside y.
  virtual int order_of_error() const { return 0; }
  const VectorX& error() const { return error_; }
  // y at the start and at the end of the last step; its rate at the start.
  const VectorX& start() const { return start_; }
  const VectorX& end() const { return y_; }
  const VectorX& rate() const { return rate_; }
  // y within the last step, at the share theta of it, or a little beyond.
  virtual void interpolate(double /*theta*/, VectorX& /*y*/) const {}
  // Moves changes of the origin to the end of the last step, of h.
  virtual void carry(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const = 0;
  // True where the loop adds up the work of contacts, by the trapezoidal rule.
  virtual bool leaves_work() const { return false; }
  // True where no stiffness limits the step.
  virtual bool is_implicit() const { return false; }

 protected:
  // carry() of methods with a dense output, whose steps it follows to their tolerance.
  void carry_along(StepSlopes& slopes, Chart& chart, double h, MatrixX& changes) const;

  VectorX start_, rate_, y_, error_;
};

// The method that scenarios call so. Throws std::invalid_argument, which lists the names, for any
// other.
std::unique_ptr<Stepper> make_stepper(std::string_view integrator, SceneData& scene);

}  // namespace sphshell
