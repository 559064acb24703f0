// What acts in the joints besides motors and gravity: stops at the ends of their range, viscous
// damping, dry friction; and the limits of their motors and speeds.
#pragma once

#include "sphshell_pin/laws/normal.hpp"
#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// Of all contacts and joints: power lost in damping and friction, and energy stored.
struct Powers {
  double damping = 0, friction = 0;  // [W]
  double elastic = 0, bristles = 0;  // [J]
};

// One end of the range of a coordinate whose rate is a velocity. Its law gives the generalized
// force [N m or N] that pushes back at a depth [rad or m] beyond the end.
struct JointStop {
  int q, v;     // indices of the coordinate and of the velocity
  double end;   // [rad or m]
  double sign;  // 1: the upper end, -1: the lower one
  NormalLaw law;

  double depth(const VectorX& at) const { return sign * (at[q] - end); }
};

// Dry friction of one velocity: the elastic, perfectly plastic spring of BristleFriction in one
// dimension, with a constant limit.
struct DryFriction {
  int v;
  double limit, stiffness, damping;  // [N m], [N m/rad], [N m s/rad], or [N], [N/m], [N s/m]
  double relaxation;                 // time in which the spring gives way beyond its limit [s]

  double clamped(double x) const { return std::clamp(x, -limit, limit); }
  // What the spring holds at a stretch x and a speed; friction is its opposite.
  double held(double x, double speed) const { return clamped(stiffness * x + damping * speed); }
};

// The constant description, shared by all states of a scene: what acts in the joints, and the
// compiled code that moves them, or null for Pinocchio's.
struct JointEffects {
  VectorX damping;                           // (nv) [N m s/rad or N s/m], or empty
  VectorX least_effort, most_effort, speed;  // (nv), infinite where there is no limit, or empty
  std::vector<JointStop> stops = {};
  std::vector<DryFriction> friction = {};
  std::shared_ptr<const CompiledRobot> compiled = {};
};

// A pair, or a stop of a joint, at one state.
struct TouchState {
  int count = 0;            // of contacts, saddles not counted
  int pieces = 0;           // of contacts, less saddles: changes where a depth goes through zero
  int clamped = 0;          // of contacts that the law's clamp holds at no force
  double depth = 0;         // largest [m]; that of a stop is negative before its end [rad or m]
  double normal_force = 0;  // sum [N], of a stop [N m or N]
};

// The effects at one state. Without any, nothing is computed.
class JointForces {
 public:
  using Effects = std::shared_ptr<const JointEffects>;

  JointForces(Effects effects, int nv);

  // Whether anything acts, or may act.
  bool act() const { return act_; }
  const JointEffects* effects() const { return effects_.get(); }
  // Of the same stops and friction, with other values.
  void change(Effects effects) { effects_ = std::move(effects); }
  // Number of stretches of springs: the last part of the scene's z.
  int size() const { return static_cast<int>(rates_.size()); }

  // z: the stretches [rad or m]; they give way no faster than `relaxation` [s].
  void evaluate(const VectorX& q, const VectorX& v, const VectorRef& z, double relaxation);
  // Of the last evaluate(): the torques (nv), what they do, rates of the stretches.
  const VectorX& torque() const { return torque_; }
  const Powers& powers() const { return powers_; }
  const VectorX& rates() const { return rates_; }
  const std::vector<TouchState>& stops() const { return stops_; }
  // Adds to tau what makes up for damping and dry friction at velocities v of `driven` joints (1,
  // else 0), with the stretches of the last evaluate(), or of stretch().
  void compensate(const VectorX& v, const VectorX& driven, VectorX& tau) const;
  double& stretch(int i) { return stretches_[i]; }
  // tau with the torques of the last evaluate().
  const VectorX& added(const VectorX& tau);

  // How torque and rate of one velocity answer the state; `spring`: which friction, or -1.
  struct Slope {
    int v, spring;
    double by_q, by_v, by_z, rate_by_v, rate_by_z;
  };
  void slopes(const VectorX& q, const VectorX& v, const VectorRef& z, double relaxation,
              std::vector<Slope>& out) const;

 private:
  Effects effects_;
  bool act_;
  VectorX torque_, rates_, sum_, stretches_;
  Powers powers_;
  std::vector<TouchState> stops_;
};

}  // namespace sphshell
