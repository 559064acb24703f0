#include "dynamics/chain.hpp"

namespace sphshell {
namespace {

Vector6 stacked(const Vec3& linear, const Vec3& angular) {
  Vector6 out;
  out << linear, angular;
  return out;
}

// Rate of the twist b where it moves with the twist a.
Vector6 motion_cross(const Vector6& a, const Vector6& b) {
  const Vec3 velocity = a.head<3>(), spin = a.tail<3>();
  const Vec3 b_velocity = b.head<3>(), b_spin = b.tail<3>();
  return stacked(spin.cross(b_velocity) + velocity.cross(b_spin), spin.cross(b_spin));
}

// Rate of a wrench where it moves with the twist a.
Vector6 force_cross(const Vector6& a, const Vector6& wrench) {
  const Vec3 velocity = a.head<3>(), spin = a.tail<3>();
  const Vec3 force = wrench.head<3>(), moment = wrench.tail<3>();
  return stacked(spin.cross(force), spin.cross(moment) + velocity.cross(force));
}

Vector6 into(const pinocchio::SE3& frame, const Vector6& twist) {
  const Vec3 velocity = twist.head<3>(), spin = twist.tail<3>();
  const auto turn = frame.rotation().transpose();
  return stacked(turn * (velocity - frame.translation().cross(spin)), turn * spin);
}

}  // namespace

Chain::Chain(const pinocchio::Model& model, int joint_j, int joint_i) {
  const auto& to_j = model.supports[joint_j];
  const auto& to_i = model.supports[joint_i];
  std::size_t common = 0;
  while (common < to_j.size() && common < to_i.size() && to_j[common] == to_i[common]) ++common;
  for (std::size_t k = to_j.size(); k > common; --k) add(model, static_cast<int>(to_j[k - 1]), -1);
  for (std::size_t k = common; k < to_i.size(); ++k) add(model, static_cast<int>(to_i[k]), 1);
  axes_.setZero(6, size());
  twist_by_q_.setZero(6, size());
  twist_.setZero();
}

void Chain::add(const pinocchio::Model& model, int joint, double sign) {
  const int first = size(), count = model.nvs[joint];
  // A joint on the way to body j moves the shell with its own axes.
  links_.push_back({joint, first, count, sign, sign > 0 ? first : first + count});
  for (int k = 0; k < count; ++k) velocity_.push_back(model.idx_vs[joint] + k);
}

void Chain::place(const Multibody& body, const pinocchio::SE3& world_from_shell, const VectorX& v) {
  turns_.clear();
  Vector6 behind = Vector6::Zero();  // velocity of body i against the body behind the link
  for (auto link = links_.rbegin(); link != links_.rend(); ++link) {
    Vector6 own = Vector6::Zero();
    for (int k = link->first; k < link->first + link->count; ++k) {
      axes_.col(k) = link->sign * into(world_from_shell, body.axes().col(velocity_[k]));
      own += v[velocity_[k]] * axes_.col(k);
    }
    const Vector6 moved = link->sign > 0 ? Vector6(behind + own) : behind;
    for (int k = link->first; k < link->first + link->count; ++k)
      twist_by_q_.col(k) = motion_cross(axes_.col(k), moved);
    behind += own;
  }
  twist_ = behind;
  for (const TurningAxes& turning : body.turning())
    for (const Link& link : links_) {
      if (link.joint != turning.joint) continue;
      const pinocchio::SE3 pose = world_from_shell.actInv(body.world_from_joint(link.joint));
      for (int m = 0; m < link.count; ++m)
        for (int k = 0; k < link.count; ++k) {
          const pinocchio::Motion slope(Vector6(turning.by_q.col(k + link.count * m)));
          turns_.push_back(
              {link.first + k, link.first + m, link.sign * Vector6(pose.act(slope).toVector())});
          twist_by_q_.col(link.first + m) += v[velocity_[link.first + k]] * turns_.back().slope;
        }
    }
}

void Chain::add_force(const Vector6& wrench, VectorX& force, MatrixX& by_q) const {
  for (int k = 0; k < size(); ++k) force[velocity_[k]] += axes_.col(k).dot(wrench);
  for (const Link& link : links_)
    for (int m = link.first; m < link.first + link.count; ++m) {
      const Vector6 with = force_cross(axes_.col(m), wrench);
      for (int k = link.moved; k < size(); ++k)
        by_q(velocity_[k], velocity_[m]) -= axes_.col(k).dot(with);
    }
  for (const Turn& turn : turns_)
    by_q(velocity_[turn.axis], velocity_[turn.by]) += turn.slope.dot(wrench);
}

}  // namespace sphshell
