#include "dynamics/controllers.hpp"

#include <algorithm>
#include <pinocchio/spatial.hpp>
#include <utility>

namespace sphshell {

GravityCompensation::GravityCompensation(VectorX actuated) : actuated_(std::move(actuated)) {}

void GravityCompensation::torque(SceneData& scene, double, const VectorX& q, const VectorX&,
                                 VectorX& tau) {
  tau = scene.body().gravity(q).cwiseProduct(actuated_);
}

JointPd::JointPd(VectorX kp, VectorX kd, VectorX q_ref, bool gravity, VectorX actuated)
    : kp_(std::move(kp)),
      kd_(std::move(kd)),
      q_ref_(std::move(q_ref)),
      actuated_(std::move(actuated)),
      error_(VectorX::Zero(kd_.size())),
      gravity_(gravity) {}

void JointPd::torque(SceneData& scene, double, const VectorX& q, const VectorX& v, VectorX& tau) {
  scene.body().difference(q, q_ref_, error_);
  tau = kp_.cwiseProduct(error_) - kd_.cwiseProduct(v);
  if (gravity_) tau += scene.body().gravity(q);
  tau.array() *= actuated_.array();
}

CartesianImpedance::CartesianImpedance(ImpedanceSettings settings, int num_joints)
    : s_(std::move(settings)),
      opposed_(static_cast<std::size_t>(num_joints), pinocchio::Force::Zero()),
      error_(VectorX::Zero(s_.actuated.size())) {}

void CartesianImpedance::prepare(SceneData& scene) {
  scene.need_velocity_of(s_.joint);
  scene.need_velocity_of(s_.path_joint);
  segment_ = 0;
  started_ = false;
}

void CartesianImpedance::torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
                                VectorX& tau) {
  Multibody& body = scene.body();
  const SE3& joint = body.world_from_joint(s_.joint);
  const SE3 pose = joint * s_.frame;
  const pinocchio::Motion twist = s_.frame.actInv(body.velocity(s_.joint));
  const Vec3 velocity = pose.rotation() * twist.linear(), spin = pose.rotation() * twist.angular();
  if (!started_) hold_ = pose.rotation(), started_ = true;

  // The target moves along straight pieces of the path; time may also step back (inner stages).
  const std::vector<double>& times = s_.times;
  t -= late_;
  while (segment_ + 2 < times.size() && t >= times[segment_ + 1]) ++segment_;
  while (segment_ > 0 && t < times[segment_]) --segment_;
  const std::size_t i = segment_, j = std::min(i + 1, times.size() - 1);
  const double span = times[j] - times[i];
  const double u = span > 0 ? std::clamp((t - times[i]) / span, 0.0, 1.0) : 0.0;
  const bool moving = span > 0 && t >= times[i] && t < times[j];
  Vec3 target = s_.points[i] + u * (s_.points[j] - s_.points[i]);
  Vec3 target_velocity = Vec3::Zero();
  if (moving) target_velocity = (s_.points[j] - s_.points[i]) / span;
  Vec3 normal = s_.normals[i] + u * (s_.normals[j] - s_.normals[i]);
  SE3 path = s_.path_placement;
  if (s_.path_joint != 0) path = body.world_from_joint(s_.path_joint) * s_.path_placement;
  target = path.act(target);
  target_velocity = path.rotation() * target_velocity;
  normal = path.rotation() * normal;
  if (s_.path_joint != 0) {
    const SE3& carrier = body.world_from_joint(s_.path_joint);
    const pinocchio::Motion& w = body.velocity(s_.path_joint);
    target_velocity +=
        carrier.rotation() * (w.linear() + w.angular().cross(carrier.actInv(target)));
  }

  Vec3 offset = target - pose.translation();
  if (s_.normal_force != 0) {
    normal.normalize();
    offset -= offset.dot(normal) * normal;
  }
  Vec3 force = s_.stiffness * offset + s_.damping * (target_velocity - velocity);
  if (s_.normal_force != 0) force -= s_.normal_force * normal;
  Vec3 moment = -s_.rotational_damping * spin;
  if (s_.rotational_stiffness != 0)
    moment += s_.rotational_stiffness *
              pinocchio::log3(Eigen::Matrix3d(hold_ * pose.rotation().transpose()));

  // One recursion gives the bias torques and J^T F: inverse dynamics at rest against -F.
  pinocchio::Force& opposed = opposed_[s_.joint];
  const Vec3 local = joint.rotation().transpose() * force;
  opposed.linear() = -local;
  opposed.angular() =
      -(joint.rotation().transpose() * moment) - s_.frame.translation().cross(local);
  tau = body.bias(q, v, opposed_);
  if (s_.posture_stiffness.size() > 0) {
    body.difference(q, s_.q_ref, error_);
    tau += s_.posture_stiffness.cwiseProduct(error_);
  }
  if (s_.joint_damping.size() > 0) tau -= s_.joint_damping.cwiseProduct(v);
  tau.array() *= s_.actuated.array();
}

double CartesianImpedance::next_kink(double t) const {
  const auto next = std::upper_bound(s_.times.begin(), s_.times.end(), t - late_);
  return next == s_.times.end() ? std::numeric_limits<double>::infinity() : *next + late_;
}

// The orientation held stays, and the target stays where it is on the path.
void CartesianImpedance::take_over(const Controller& before, double t) {
  const auto* other = dynamic_cast<const CartesianImpedance*>(&before);
  if (!other || other->s_.times.size() != s_.times.size()) return;
  hold_ = other->hold_;
  started_ = other->started_;
  if (s_.times.size() < 2) return;
  const std::vector<double>&now = s_.times, &then = other->s_.times;
  const double at = std::clamp(t - other->late_, then.front(), then.back());
  const auto next = std::upper_bound(then.begin() + 1, then.end() - 1, at);
  const std::size_t j = std::min<std::size_t>(next - then.begin(), now.size() - 1);
  const std::size_t i = j > 0 ? j - 1 : 0;
  const double span = then[j] - then[i];
  const double u = span > 0 ? (at - then[i]) / span : 0;
  late_ = t - (now[i] + u * (now[j] - now[i]));
}

}  // namespace sphshell
