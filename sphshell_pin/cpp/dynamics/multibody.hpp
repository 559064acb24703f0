// Pinocchio's algorithms as the simulation uses them; their templates are compiled in one file.
#pragma once

#include <pinocchio/multibody.hpp>

#include <vector>

namespace sphshell {

using VectorX = Eigen::VectorXd;
using VectorRef = Eigen::Ref<const VectorX>;
using Forces = std::vector<pinocchio::Force>;

// A segment of the velocity whose group does not commute: its composition needs a correction in
// Runge-Kutta methods of order 3 and more.
struct CurvedSegment {
  enum class Group { Rotation, Planar, Rigid } group;
  int index_v, index_q;
};

// A constant model with the scratch that its algorithms write: one per thread.
class Multibody {
 public:
  explicit Multibody(const pinocchio::Model& model);

  // Placements and, with v, velocities of the joints that were asked for by `need`, no others.
  void kinematics(const VectorX& q);
  void kinematics(const VectorX& q, const VectorX& v);
  void need(int joint);

  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau);
  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                              const Forces& external);
  const VectorX& gravity(const VectorX& q);
  // Torque that holds the bias forces and opposes `external`: rnea(q, v, 0, external).
  const VectorX& bias(const VectorX& q, const VectorX& v, const Forces& external);
  void integrate(const VectorX& q, const VectorX& step, VectorX& out) const;
  void difference(const VectorX& q0, const VectorX& q1, VectorX& out) const;
  double kinetic_energy(const VectorX& q, const VectorX& v);
  double potential_energy(const VectorX& q);

  const pinocchio::SE3& world_from_joint(int joint) const { return data_.oMi[joint]; }
  const pinocchio::Motion& velocity(int joint) const { return data_.v[joint]; }
  const pinocchio::Model& model() const { return model_; }
  const std::vector<CurvedSegment>& curved() const { return curved_; }

 private:
  pinocchio::Model model_;
  pinocchio::Data data_;
  VectorX zero_;
  std::vector<CurvedSegment> curved_;
  std::vector<int> needed_;  // joints, parents first
};

}  // namespace sphshell
