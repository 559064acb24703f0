#include "dynamics/integrators/chart.hpp"

namespace sphshell {

// x in the axes that a segment has at q: of a quaternion, or of cosine and sine.
static Vec3 turned(const CurvedSegment& s, const VectorX& q, const Vec3& x) {
  const double* at = q.data() + s.index_q + s.linear;
  if (s.angular == 3) return Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(at)) * x;
  return {at[0] * x[0] - at[1] * x[1], at[1] * x[0] + at[0] * x[1], 0};
}

// The rate of u where exp(u) turns with the angular velocity w, in turning axes.
static Vec3 angle_rate(const Vec3& u, const Vec3& w) {
  // u' = w + [u, w] / 2 + c [u, [u, w]], c = (1 - |u| / 2 cot(|u| / 2)) / |u|^2, by its series near
  // zero.
  const double a2 = u.squaredNorm();
  const double half = 0.5 * std::sqrt(a2);
  const double c = a2 > 1e-6 ? (1 - half / std::tan(half)) / a2 : 1.0 / 12 + a2 / 720;
  const Vec3 once = u.cross(w);
  return w + 0.5 * once + c * u.cross(once);
}

Eigen::Matrix3d rotation_of(const Vec3& angle) {
  const double a = angle.norm();
  return a > 0 ? Eigen::AngleAxisd(a, angle / a).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

Chart::Chart(SceneData& scene, Torques& torques)
    : scene_(scene),
      torques_(torques),
      nv_(scene.body().model().nv),
      q_(scene.body().model().nq),
      v_(nv_),
      u_(nv_) {}

// Contacts that stages of an earlier step have seen are forgotten.
void Chart::begin(const State& origin) {
  origin_ = &origin;
  scene_.restart();
}

void Chart::place(const VectorX& y, VectorX& q, VectorX& v) const {
  u_ = y.head(nv_);
  scene_.body().integrate(origin_->q, u_, q);
  v = y.segment(nv_, nv_);
  for (const CurvedSegment& s : scene_.body().curved()) {
    if (s.linear == 0) continue;
    // Position: the origin's plus u in the axes R0. Pinocchio's own exponential of SE(3) would
    // couple it with the rotation. Velocity: from the axes R0 into the body's.
    const Vec3 moved = turned(s, origin_->q, s.linear_of(u_));
    const Vec3 velocity = rotation_of(-s.angular_of(u_)) * s.linear_of(v);
    for (int k = 0; k < s.linear; ++k) {
      q[s.index_q + k] = origin_->q[s.index_q + k] + moved[k];
      v[s.index_v + k] = velocity[k];
    }
  }
}

// All but the rate of u, at (q, v); what turns is still counted in turning axes.
const VectorX& Chart::fill(double t, const VectorX& q, const VectorX& v, VectorX& out) {
  ++evaluations_;
  const VectorX& tau = torques_.torque(t, q, v);
  out.resize(size());
  // Pinocchio's acceleration of a free body is that of components in the turning body; in axes that
  // stand still it is a + spin x v.
  out.segment(nv_, nv_) = scene_.acceleration(q, v, tau);
  for (const CurvedSegment& s : scene_.body().curved()) {
    const Vec3 turning = s.angular_of(v).cross(s.linear_of(v));
    for (int k = 0; k < s.linear; ++k) out[nv_ + s.index_v + k] += turning[k];
  }
  out.segment(2 * nv_, nz()) = scene_.bristle_rates();
  const Powers& powers = scene_.powers();
  // The work of damping, friction and control is integrated like the state.
  out.tail<kWork>() << powers.damping, powers.friction, tau.dot(v);
  return tau;
}

void Chart::rate_at_origin(VectorX& out) {
  torque_ = fill(origin_->t, origin_->q, origin_->v, out);
  out.head(nv_) = origin_->v;
}

const VectorX& Chart::bristle_rates_at(const VectorRef& v) {
  v_ = v;
  scene_.revisit(origin_->q, v_, origin_->z);
  return scene_.bristle_rates();
}

void Chart::rate(double t, const VectorX& y, VectorX& out) {
  place(y, q_, v_);
  z_ = y.segment(2 * nv_, nz());
  scene_.evaluate(q_, v_, z_);
  fill(t, q_, v_, out);
  out.head(nv_) = y.segment(nv_, nv_);
  for (const CurvedSegment& s : scene_.body().curved()) {
    const Vec3 u = s.angular_of(y), turning = angle_rate(u, s.angular_of(y, nv_));
    for (int k = 0; k < s.angular; ++k) out[s.index_v + s.linear + k] = turning[3 - s.angular + k];
    if (s.linear == 0) continue;
    // Into the axes of the chart, where the step began.
    const Vec3 acceleration = rotation_of(u) * s.linear_of(out, nv_);
    for (int k = 0; k < s.linear; ++k) out[nv_ + s.index_v + k] = acceleration[k];
  }
}

void Chart::start(VectorX& y) const {
  const Ledger& l = origin_->ledger;
  y.resize(size());
  y.head(nv_).setZero();
  y.segment(nv_, nv_) = origin_->v;
  y.segment(2 * nv_, nz()) = origin_->z;
  y.tail<kWork>() << l.damping, l.friction, l.control;
}

void Chart::finish(double t, const VectorX& y, State& out) const {
  out.t = t;
  out.q.resize(origin_->q.size());
  place(y, out.q, out.v);
  out.z = y.segment(2 * nv_, nz());
  const auto work = y.tail<kWork>();
  out.ledger = {work[0], work[1], work[2]};
}

}  // namespace sphshell
