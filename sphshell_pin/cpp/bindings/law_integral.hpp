// The elastic energy of a user's force that states none.
#pragma once

#include "bindings/callbacks.hpp"

namespace sphshell {

// The integral of the force at rest over the depth. Intervals of depth, an octave each, are halved
// until Gauss's rule agrees with that of both halves, once: kinks end in intervals too small to
// matter. Copies share what was found.
class LawIntegral {
 public:
  explicit LawIntegral(LawForce force)
      : force_(std::move(force)), found_(std::make_shared<Found>()) {}
  double operator()(double depth, const double* parameters) const;
  const LawForce& force() const { return force_; }

 private:
  // In the root of the depth, where sums of powers of it, halves among them, are polynomials.
  struct Interval {
    double start, energy;  // the energy at the start [J]
  };
  struct Table {
    std::vector<Interval> intervals;
    double end;     // [m^0.5]
    double energy;  // at the end [J]
    int jumps = 0;  // intervals that were halved as often as possible
  };
  // Threads may extend the same table at once: each makes the same one, and publishes it.
  struct Found {
    std::shared_ptr<const Table> table;
  };
  double gauss(double from, double to, const double* parameters) const;
  void divide(double from, double to, double whole, const double* parameters, int halvings,
              Table& table) const;

  LawForce force_;
  std::shared_ptr<Found> found_;
};

}  // namespace sphshell
