// A force from outside, as joint torques.
#pragma once

#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// What acts at a point x of a body: a force [N], and a spring and a damper from there to an anchor
// [N/m], [N s/m], all in the world: force + stiffness (anchor - x) - damping x'.
struct PointForce {
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), anchor = Eigen::Vector3d::Zero();
  double stiffness = 0, damping = 0;

  bool is_zero() const { return force.isZero(0) && stiffness == 0 && damping == 0; }
};

// The force that a user applies to a body while a run goes on.
class Push {
 public:
  // A force at a point of the joint's frame; a zero one ends the push. `frame`: the number of the
  // one to whose body the point belongs.
  void set(int joint, const Eigen::Vector3d& point, const PointForce& force, int frame) {
    // The entry of the joint that was pushed before is cleared: bias() reads all of them.
    if (!opposed_.empty()) opposed_[joint_].setZero();
    joint_ = joint;
    frame_ = frame;
    point_ = point;
    force_ = force;
  }
  bool active() const { return !force_.is_zero(); }
  int joint() const { return joint_; }
  int frame() const { return frame_; }
  // In the joint's frame, about its origin; the body's placements and velocities are those of the
  // state.
  pinocchio::Force on_joint(const Multibody& body) const {
    const pinocchio::SE3& pose = body.world_from_joint(joint_);
    Eigen::Vector3d world = force_.force;
    if (force_.stiffness != 0 || force_.damping != 0) {
      const Eigen::Vector3d x = pose.act(point_), rate = body.velocity_at(joint_, x);
      world += force_.stiffness * (force_.anchor - x) - force_.damping * rate;
    }
    // Into the joint's frame, about its origin.
    const Eigen::Vector3d force = pose.rotation().transpose() * world;
    return {force, point_.cross(force)};
  }
  // tau with J^T times the force added; the body's placements are those of (q, v).
  const VectorX& added(Multibody& body, const VectorX& q, const VectorX& v, const VectorX& tau) {
    // Inverse dynamics against the force, less that without it.
    if (opposed_.empty()) opposed_.assign(body.model().joints.size(), pinocchio::Force::Zero());
    pinocchio::Force& opposed = opposed_[joint_];
    opposed.setZero();
    sum_ = tau - body.bias(q, v, opposed_);
    opposed = -on_joint(body);
    sum_ += body.bias(q, v, opposed_);
    return sum_;
  }

 private:
  int joint_ = 0, frame_ = 0;
  Eigen::Vector3d point_ = Eigen::Vector3d::Zero();
  PointForce force_;
  Forces opposed_;
  VectorX sum_;
};

}  // namespace sphshell
