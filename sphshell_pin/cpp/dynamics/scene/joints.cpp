#include "dynamics/scene/joints.hpp"

#include "contact/laws/dual.hpp"

namespace sphshell {

// Without any effect nothing is allocated, and evaluate() is not called.
JointForces::JointForces(Effects effects, int nv)
    : effects_(std::move(effects)),
      act_(effects_ && (!effects_->stops.empty() || !effects_->friction.empty() ||
                        effects_->damping.size() > 0)) {
  if (!act_) return;
  torque_.setZero(nv);
  rates_.setZero(static_cast<Eigen::Index>(effects_->friction.size()));
  stretches_ = rates_;
  stops_.resize(effects_->stops.size());
}

void JointForces::evaluate(const VectorX& q, const VectorX& v, const VectorRef& z,
                           double relaxation) {
  powers_ = Powers();
  stretches_ = z;
  torque_.setZero();
  if (effects_->damping.size() > 0) {
    // Viscous damping, -d v, and the power v d v that it takes.
    torque_ = -effects_->damping.cwiseProduct(v);
    powers_.damping = -torque_.dot(v);
  }
  for (std::size_t k = 0; k < stops_.size(); ++k) {
    const JointStop& stop = effects_->stops[k];
    TouchState& state = stops_[k];
    state = {};
    state.depth = stop.depth(q);
    if (!(state.depth > 0)) continue;
    state.count = state.pieces = 1;
    // As a gap rate: negative while moving farther beyond the end.
    const double rate = -stop.sign * v[stop.v];
    const NormalForce<double> push = stop.law.force(state.depth, rate);
    state.normal_force = push.total;
    state.clamped = push.total == 0;
    torque_[stop.v] -= stop.sign * push.total;
    powers_.damping -= (push.total - push.elastic) * rate;
    powers_.elastic += stop.law.energy(state.depth);
  }
  for (std::size_t i = 0; i < effects_->friction.size(); ++i) {
    const DryFriction& dry = effects_->friction[i];
    // As BristleFriction::add() in one dimension, with the projection on [-limit, limit].
    const double speed = v[dry.v], x = z[i], held = dry.clamped(dry.stiffness * x);
    const double force = -dry.held(x, speed);
    torque_[dry.v] += force;
    rates_[i] = speed - (x - held / dry.stiffness) / std::max(dry.relaxation, relaxation);
    powers_.friction -= force * speed;
    powers_.bristles += 0.5 * held * held / dry.stiffness;
  }
}

void JointForces::compensate(const VectorX& v, const VectorX& driven, VectorX& tau) const {
  if (!act_) return;
  if (effects_->damping.size() > 0)
    tau.array() += (driven.array() * effects_->damping.array()) * v.array();
  for (Eigen::Index i = 0; i < stretches_.size(); ++i) {
    const DryFriction& dry = effects_->friction[i];
    tau[dry.v] += driven[dry.v] * dry.held(stretches_[i], v[dry.v]);
  }
}

// Controller and joint components together: what forward dynamics takes.
const VectorX& JointForces::added(const VectorX& tau) {
  sum_ = tau + torque_;
  return sum_;
}

void JointForces::slopes(const VectorX& q, const VectorX& v, const VectorRef& z, double relaxation,
                         std::vector<Slope>& out) const {
  out.clear();
  for (Eigen::Index i = 0; i < effects_->damping.size(); ++i)
    if (effects_->damping[i] != 0)
      out.push_back({static_cast<int>(i), -1, 0, -effects_->damping[i], 0, 0, 0});
  for (const JointStop& stop : effects_->stops) {
    const double depth = stop.depth(q);
    if (!(depth > 0)) continue;
    // By the depth and the rate; the depth grows with sign q, the torque is -sign force: both signs
    // cancel in the product.
    using S = Dual<2>;
    const S force = stop.law.force(S::seed(depth, 0), S::seed(-stop.sign * v[stop.v], 1)).total;
    out.push_back({stop.v, -1, -force.slope[0], force.slope[1], 0, 0, 0});
  }
  for (std::size_t i = 0; i < effects_->friction.size(); ++i) {
    const DryFriction& dry = effects_->friction[i];
    const double spring = dry.stiffness * z[i];
    // Where the projection is active its derivative is zero.
    const bool slides = std::abs(spring + dry.damping * v[dry.v]) > dry.limit;
    const bool gives_way = std::abs(spring) > dry.limit;
    out.push_back({dry.v, static_cast<int>(i), 0, slides ? 0 : -dry.damping,
                   slides ? 0 : -dry.stiffness, 1,
                   gives_way ? -1 / std::max(dry.relaxation, relaxation) : 0});
  }
}

}  // namespace sphshell
