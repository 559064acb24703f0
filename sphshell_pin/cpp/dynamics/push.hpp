// A force from outside, as joint torques.
#pragma once

#include "dynamics/multibody.hpp"

namespace sphshell {

class Push {
 public:
  // A force [N] in the world at a point of the joint's frame; a zero force ends the push.
  // `frame`: the number of the one whose origin that is.
  void set(int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& force_world, int frame);
  bool active() const { return !force_world_.isZero(0); }
  int joint() const { return joint_; }
  int frame() const { return frame_; }
  // In the joint's frame, about its origin; the body's placements are those of the state.
  pinocchio::Force on_joint(const Multibody& body) const;
  // tau with J^T times the force added; the body's placements are those of (q, v).
  const VectorX& added(Multibody& body, const VectorX& q, const VectorX& v, const VectorX& tau);

 private:
  int joint_ = 0, frame_ = 0;
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero(), force_world_ = Eigen::Vector3d::Zero();
  Forces opposed_;
  VectorX sum_;
};

}  // namespace sphshell
