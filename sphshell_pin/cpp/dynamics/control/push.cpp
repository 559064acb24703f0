#include "dynamics/control/push.hpp"

namespace sphshell {

// The entry of the joint that was pushed before is cleared: bias() reads all of them.
void Push::set(int joint, const Eigen::Vector3d& point, const PointForce& force, int frame) {
  if (!opposed_.empty()) opposed_[joint_].setZero();
  joint_ = joint;
  frame_ = frame;
  point_ = point;
  force_ = force;
}

pinocchio::Force Push::on_joint(const Multibody& body) const {
  const pinocchio::SE3& pose = body.world_from_joint(joint_);
  Eigen::Vector3d world = force_.force;
  if (force_.stiffness != 0 || force_.damping != 0) {
    const Eigen::Vector3d x = pose.act(point_);
    world += force_.stiffness * (force_.anchor - x) - force_.damping * body.velocity_at(joint_, x);
  }
  // Into the joint's frame, about its origin.
  const Eigen::Vector3d force = pose.rotation().transpose() * world;
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
