// A force from outside, as joint torques.
#pragma once

#include "dynamics/multibody.hpp"

namespace sphshell {

class Push {
 public:
  // A force [N] in the world at a point of the joint's frame; a zero force ends the push.
  void set(int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& force_world);
  bool active() const { return !force_world_.isZero(0); }
  // tau with J^T times the force added; the body's placements are those of (q, v).
  const VectorX& added(Multibody& body, const VectorX& q, const VectorX& v, const VectorX& tau);

 private:
  int joint_ = 0;
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero(), force_world_ = Eigen::Vector3d::Zero();
  Forces opposed_;
  VectorX sum_;
};

}  // namespace sphshell
