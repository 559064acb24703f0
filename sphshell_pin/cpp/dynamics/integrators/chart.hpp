// The equations of motion in coordinates round the state at which a step begins.
#pragma once

#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Work done since the start [J].
struct Ledger {
  double damping = 0;   // taken by the normal damping
  double friction = 0;  // taken by friction; bristles hold a part of it
  double control = 0;   // given by the controller
};

// Of a run, at time t [s].
struct State {
  double t = 0;
  VectorX q, v;
  VectorX z;  // bristles
  Ledger ledger;
};

// Where the joint torques come from. The scene's placements are those of (q, v).
class Torques {
 public:
  virtual ~Torques() = default;
  // tau (nv), valid until the next call.
  virtual const VectorX& torque(double t, const VectorX& q, const VectorX& v) = 0;
  // What a linearization has to vary: false where torques are held.
  virtual bool follow_state() const = 0;
  virtual bool follow_time() const = 0;
};

// exp of a rotation vector [rad].
Eigen::Matrix3d rotation_of(const Vec3& angle);

// Makes a plain system of the motion,
//
//   y = (u, w, z, work),   y' = rate(t, y),
//
// to which any method for plain systems applies with its full order (Munthe-Kaas, BIT 38, 1998).
// Joints with plain coordinates: q = q0 + u, w = v. Rotations: R = R0 exp(u), w the body's angular
// velocity, and u' = w + [u, w] / 2 + ... A free body's position and linear velocity are
// counted in the axes R0, which stand still during the step: free flight is then straight, however
// the body spins.
class Chart {
 public:
  static constexpr int kWork = 3;

  Chart(SceneData& scene, Torques& torques);

  // The forces have been evaluated at `origin`.
  void begin(const State& origin);
  Eigen::Index size() const { return 2 * nv_ + origin_->z.size() + kWork; }
  // y', with one evaluation of the scene.
  void rate(double t, const VectorX& y, VectorX& out);
  // The rate at y = (0, v, z, work) of the origin.
  void rate_at_origin(VectorX& out);
  const VectorX& torque_at_origin() const { return torque_; }
  // The rates of the bristles at the origin's place, with another velocity.
  const VectorX& bristle_rates_at(const VectorRef& v);
  // y at the origin.
  void start(VectorX& y) const;
  // y as a state at time t.
  void finish(double t, const VectorX& y, State& out) const;

  const State& origin() const { return *origin_; }
  SceneData& scene() { return scene_; }
  Torques& torques() { return torques_; }
  int nv() const { return nv_; }
  int nz() const { return static_cast<int>(origin_->z.size()); }
  long evaluations() const { return evaluations_; }

 private:
  void place(const VectorX& y, VectorX& q, VectorX& v) const;
  // Writes w', z' and the powers; returns the torques.
  const VectorX& fill(double t, const VectorX& q, const VectorX& v, VectorX& out);

  SceneData& scene_;
  Torques& torques_;
  const State* origin_ = nullptr;
  int nv_;
  long evaluations_ = 0;
  VectorX q_, v_, z_, torque_;
  mutable VectorX u_;
};

}  // namespace sphshell
