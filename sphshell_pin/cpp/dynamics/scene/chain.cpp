#include "dynamics/scene/chain.hpp"

namespace sphshell {
Chain::Chain(const pinocchio::Model& model, int joint_j, int joint_i) {
  const auto& to_j = model.supports[joint_j];
  const auto& to_i = model.supports[joint_i];
  // supports: the joints from the root to a joint. Behind the last common one the way goes up from
  // body j, and down to body i.
  std::size_t common = 0;
  while (common < to_j.size() && common < to_i.size() && to_j[common] == to_i[common]) ++common;
  for (std::size_t k = to_j.size(); k > common; --k) add(model, static_cast<int>(to_j[k - 1]), -1);
  for (std::size_t k = common; k < to_i.size(); ++k) add(model, static_cast<int>(to_i[k]), 1);
  axes_.setZero(6, size());
  twist_by_q_.setZero(6, size());
  twist_.setZero();
}

void Chain::add(const pinocchio::Model& model, int joint, double sign) {
  // A mimic joint has an axis of its own, and the velocity of the joint that it mimics.
  const int first = size(), count = model.nvExtendeds[joint];
  // A joint on the way to body j moves the shell with its own axes.
  links_.push_back(
      {joint, first, count, model.idx_vExtendeds[joint], sign, sign > 0 ? first : first + count});
  for (int k = 0; k < count; ++k) velocity_.push_back(model.idx_vs[joint] + k);
}

void Chain::place(const Multibody& body, const pinocchio::SE3& world_from_shell, const VectorX& v) {
  using pinocchio::Motion;
  turns_.clear();
  // From body i backwards: what a joint moves is all that is behind it in the chain.
  Motion behind = Motion::Zero();  // velocity of body i against the body behind the link
  for (auto link = links_.rbegin(); link != links_.rend(); ++link) {
    Motion own = Motion::Zero();
    for (int k = link->first; k < link->first + link->count; ++k) {
      const Motion axis =
          world_from_shell.actInv(Motion(body.axes().col(link->column + k - link->first)));
      axes_.col(k) = link->sign * axis.toVector();
      own += Motion(v[velocity_[k]] * axes_.col(k));
    }
    const Motion moved = link->sign > 0 ? behind + own : behind;
    for (int k = link->first; k < link->first + link->count; ++k)
      twist_by_q_.col(k) = Motion(axes_.col(k)).cross(moved).toVector();
    behind += own;
  }
  twist_ = behind.toVector();
  for (const TurningAxes& turning : body.turning())
    for (const Link& link : links_) {
      if (link.joint != turning.joint) continue;
      const pinocchio::SE3 pose = world_from_shell.actInv(body.world_from_joint(link.joint));
      for (int m = 0; m < link.count; ++m)
        for (int k = 0; k < link.count; ++k) {
          const Motion slope = pose.act(Motion(turning.by_q.col(k + link.count * m)));
          turns_.push_back({link.first + k, link.first + m, link.sign * slope.toVector()});
          twist_by_q_.col(link.first + m) += v[velocity_[link.first + k]] * turns_.back().slope;
        }
    }
}

// Generalized force of axis k: its scalar product with the wrench.
void Chain::add_force(const Vector6& wrench, VectorX& force, MatrixX& by_q) const {
  for (int k = 0; k < size(); ++k) force[velocity_[k]] += axes_.col(k).dot(wrench);
  for (const Link& link : links_)
    for (int m = link.first; m < link.first + link.count; ++m) {
      const pinocchio::Motion axis(axes_.col(m));
      // An axis that an earlier joint turns changes by [axis_m, axis_k]; with the wrench held, by
      // the dual cross product.
      const Vector6 rate = axis.cross(pinocchio::Force(wrench)).toVector();
      for (int k = link.moved; k < size(); ++k)
        by_q(velocity_[k], velocity_[m]) -= axes_.col(k).dot(rate);
    }
  for (const Turn& turn : turns_)
    by_q(velocity_[turn.axis], velocity_[turn.by]) += turn.slope.dot(wrench);
}

}  // namespace sphshell
