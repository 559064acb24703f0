// The joints between two bodies, and how the one moves against the other.
#pragma once

#include "contact/laws/wrench_derivatives.hpp"
#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// From body j to body i through their last common ancestor; what moves both alike is no part of it.
// All in the frame of a shell fixed to body j, twists and wrenches about its origin: there a joint
// moves those that come after it in the chain, and no others.
class Chain {
 public:
  Chain(const pinocchio::Model& model, int joint_j, int joint_i);

  // After body.place_axes().
  void place(const Multibody& body, const pinocchio::SE3& world_from_shell, const VectorX& v);

  int size() const { return static_cast<int>(velocity_.size()); }
  // Index in v of axis k.
  int velocity(int k) const { return velocity_[k]; }
  // (6, size): the twist of body i against body j is axes() v.
  const Matrix6X& axes() const { return axes_; }
  const Vector6& twist() const { return twist_; }
  const Matrix6X& twist_by_q() const { return twist_by_q_; }  // (6, size)

  // Adds the generalized forces (nv) of `wrench` on body i and its opposite on body j, and their
  // derivative (nv, nv) with respect to q where the wrench is held in the shell's frame.
  void add_force(const Vector6& wrench, VectorX& force, MatrixX& by_q) const;

 private:
  struct Link {
    int joint, first, count;  // its axes
    int column;               // of the first one, among those of all joints
    double sign;              // 1 on the way to body i, -1 on that to body j
    int moved;                // the first axis that it moves
  };
  // How much an axis turns of itself with another of its joint.
  struct Turn {
    int axis, by;
    Vector6 slope;
  };
  // Appends a joint's axes to the chain.
  void add(const pinocchio::Model& model, int joint, double sign);

  std::vector<Link> links_;
  std::vector<int> velocity_;
  std::vector<Turn> turns_;
  Matrix6X axes_, twist_by_q_;
  Vector6 twist_;
};

}  // namespace sphshell
