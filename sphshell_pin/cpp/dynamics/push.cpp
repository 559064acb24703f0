#include "dynamics/push.hpp"

namespace sphshell {

void Push::set(int joint, const Eigen::Vector3d& point, const Eigen::Vector3d& force_world,
               int frame) {
  if (!opposed_.empty()) opposed_[joint_].setZero();
  joint_ = joint;
  frame_ = frame;
  point_ = point;
  force_world_ = force_world;
}

pinocchio::Force Push::on_joint(const Multibody& body) const {
  const Eigen::Vector3d force = body.world_from_joint(joint_).rotation().transpose() * force_world_;
  return {force, point_.cross(force)};
}

// Inverse dynamics against the force, less that without it.
const VectorX& Push::added(Multibody& body, const VectorX& q, const VectorX& v,
                           const VectorX& tau) {
  if (opposed_.empty()) opposed_.assign(body.model().joints.size(), pinocchio::Force::Zero());
  pinocchio::Force& opposed = opposed_[joint_];
  opposed.setZero();
  sum_ = tau - body.bias(q, v, opposed_);
  opposed = -on_joint(body);
  sum_ += body.bias(q, v, opposed_);
  return sum_;
}

}  // namespace sphshell
