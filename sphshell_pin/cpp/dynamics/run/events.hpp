// Where within a step the motion has a kink.
#pragma once

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

// The state of a chart at a share of a step, as its dense output or a prediction has it.
using Motion = std::function<void(double share, VectorX& y)>;

// An event is a change of sign: of the depth of a contact or of a joint in its stop (touch,
// lift-off), of a saddle's depth, or of the force that a law clamps at zero. Events are located on
// an interpolated motion, where a look costs a query of the contacts and no evaluation of the
// dynamics.
class Events {
 public:
  explicit Events(SceneData& scene) : scene_(scene), at_begin_(scene.num_touches()) {}

  // A step begins where the scene was last evaluated.
  void begin();
  // Whether an event lies between there and where the scene was last evaluated.
  bool met() const;
  // Whether one lies between there and the share theta of a motion; evaluates the scene there.
  bool met_at(double theta, const Motion& motion, const Chart& chart);
  // The share of a motion where the first event has just been met, to within `tolerance`. None has
  // been met at the share `before`, one has at `after`.
  double locate(double before, double after, double tolerance, const Motion& motion,
                const Chart& chart);

  long queries() const { return queries_; }  // states looked at

 private:
  struct Start {
    int pieces = 0, clamped = 0;
    Vec3 center = Vec3::Zero();  // of the sphere, in the shell's frame
  };
  // Of a pair or, behind the pairs, of a joint's stop.
  Start now(std::size_t k) const;
  // Its quantities that change sign at its events, positive ones first in each list.
  enum Kind { Minimum, Saddle, Clamp, kKinds };
  using Gauges = std::array<std::vector<double>, kKinds>;

  // Whether contacts of pair or stop k have come or gone since begin().
  bool changed(std::size_t k) const;
  // The quantities whose signs change at events, sorted.
  void measure(std::size_t k, double margin, Gauges& out);

  SceneData& scene_;
  std::vector<Start> at_begin_;
  Query query_;
  Gauges before_, after_, between_;
  State state_;
  VectorX y_;
  long queries_ = 0;
};

}  // namespace sphshell
