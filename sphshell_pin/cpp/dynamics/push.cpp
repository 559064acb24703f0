#include "dynamics/push.hpp"

namespace sphshell {

void Push::set(int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& force_world) {
  if (!opposed_.empty()) opposed_[joint_].setZero();
  joint_ = joint;
  point_ = point;
  force_world_ = force_world;
}

// Inverse dynamics against the force, less that without it.
const VectorX& Push::added(Multibody& body, const VectorX& q, const VectorX& v,
                           const VectorX& tau) {
  if (opposed_.empty()) opposed_.assign(body.model().joints.size(), pinocchio::Force::Zero());
  pinocchio::Force& opposed = opposed_[joint_];
  opposed.setZero();
  sum_ = tau - body.bias(q, v, opposed_);
  opposed.linear() = -(body.world_from_joint(joint_).rotation().transpose() * force_world_);
  opposed.angular() = point_.cross(opposed.linear());
  sum_ += body.bias(q, v, opposed_);
  return sum_;
}

}  // namespace sphshell
