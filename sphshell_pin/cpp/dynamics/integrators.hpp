// Fixed-step integrators on the configuration space of a multibody model.
#pragma once

#include "dynamics/scene.hpp"

namespace sphshell {

// Work and losses gathered along the motion [J].
struct Ledger {
  double damping = 0, friction = 0, control = 0;
};

struct State {
  double t = 0;
  VectorX q, v;
};

// What the integrator integrates. The first call of a step was made by the loop (it also logs);
// later stages call it themselves. torque() sees the placements of the last contacts().
class Derivative {
 public:
  virtual ~Derivative() = default;
  virtual void contacts(const VectorX& q, const VectorX& v) = 0;
  virtual const VectorX& torque(double t, const VectorX& q, const VectorX& v) = 0;
  virtual Scene& scene() = 0;
};

class Integrator {
 public:
  virtual ~Integrator() = default;
  // Moves q and v of `state` on by dt, not t. On entry the contacts at `state` are evaluated.
  virtual void step(Derivative& f, double dt, State& state, Ledger& ledger) = 0;
  // True where step() gathers the contact losses itself, stage by stage; else the loop does.
  virtual bool gathers_losses() const = 0;
};

// v += dt a(q, v), then q is moved by dt v: order 1, symplectic for conservative forces.
class SemiImplicitEuler : public Integrator {
 public:
  explicit SemiImplicitEuler(Multibody& body);
  void step(Derivative& f, double dt, State& state, Ledger& ledger) override;
  bool gathers_losses() const override { return false; }

 private:
  VectorX v_, step_, q_;
};

// The classical method of order 4 in Munthe-Kaas's form (BIT 38, 1998): the motion within the step
// is q exp(u), and u' = v + [u, v]/2 + [u, [u, v]]/12 makes up for groups that do not commute.
class RungeKutta4 : public Integrator {
 public:
  explicit RungeKutta4(Multibody& body);
  void step(Derivative& f, double dt, State& state, Ledger& ledger) override;
  bool gathers_losses() const override { return true; }

 private:
  VectorX u_, q_, v_, rate_[4], acceleration_[4];
};

}  // namespace sphshell
