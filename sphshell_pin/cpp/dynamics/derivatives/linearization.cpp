#include "dynamics/derivatives/linearization.hpp"

namespace sphshell {

// The displacement of a contact's place that goes with a displacement of its body.
static Matrix36 displacement_of(const ContactSite& site) {
  Matrix36 out;
  out << Mat3::Identity(), site.place_by_turn - pinocchio::skew(site.place);
  return out;
}

// One chain of joints for each pair; contacts carry dn_dc from the next evaluation on.
Linearization::Linearization(SceneData& scene) : scene_(scene) {
  scene.want_dn_dc();
  scene.body().want_derivatives();
  const pinocchio::Model& model = scene.body().model();
  for (const Pair& pair : scene.pairs()) chains_.emplace_back(model, pair.joint_j, pair.joint_i);
  force_.setZero(model.nv);
  column_.setZero(model.nv);
  inverse_mass_.setZero(model.nv, model.nv);
  is_loaded_.assign(static_cast<std::size_t>(model.nv), 0);
  loaded_.reserve(is_loaded_.size());
}

void Linearization::forces(const VectorX& q, const VectorX& v, MatrixX& by_q, MatrixX& by_v) {
  force_.setZero(v.size());
  add_contacts(q, v, nullptr);
  // Of J^T F: both the wrench's change and that of J count.
  by_q = by_q_;
  by_v = by_v_;
}

void Linearization::rates(const VectorX& q, const VectorX& v, const VectorX& z, const VectorX& tau,
                          MatrixX& jacobian) {
  Multibody& body = scene_.body();
  const Eigen::Index nv = v.size();
  jacobian.setZero(nv + z.size(), 2 * nv + z.size());
  auto by_q = jacobian.topLeftCorner(nv, nv), by_v = jacobian.block(0, nv, nv, nv);
  force_ = tau;
  const bool joints_act = scene_.joints().act(), any = scene_.touching() || joints_act;
  // Order of rows: v', then z'; of columns: u, v, z.
  by_parameters_.setZero(nv + z.size(), static_cast<Eigen::Index>(parameters_.size()));
  if (any) add_contacts(q, v, &jacobian);
  if (joints_act) add_joints(q, v, z, jacobian);
  // These forces are torques like others: their derivatives pass through the inertia.
  body.acceleration_derivatives(q, v, force_, by_q, by_v, inverse_mass_);
  if (!any) return;
  for (int m : loaded_)
    for (int k : loaded_) {
      by_q.col(m) += by_q_(k, m) * inverse_mass_.col(k);
      by_v.col(m) += by_v_(k, m) * inverse_mass_.col(k);
    }
  if (!parameters_.empty())
    by_parameters_.topRows(nv) = (inverse_mass_ * by_parameters_.topRows(nv)).eval();
  // What was written as generalized forces by z.
  // dv'/dz = M^-1 of the generalized force by z.
  const auto pass_through_inertia = [&](Eigen::Index z) {
    auto column = jacobian.col(2 * nv + z).head(nv);
    column_.setZero();
    for (int k : loaded_) column_ += column[k] * inverse_mass_.col(k);
    column = column_;
  };
  for (const ActiveContact& active : scene_.active())
    for (int i = 0; i < 3 * rings_of(active); ++i) pass_through_inertia(3 * active.slot + i);
  for (Eigen::Index i = scene_.joint_bristles(); i < z.size(); ++i) pass_through_inertia(i);
}

// Adds stops, damping and dry friction of joints, as add_contacts() does with contacts.
void Linearization::add_joints(const VectorX& q, const VectorX& v, const VectorX& z,
                               MatrixX& jacobian) {
  const JointForces& joints = scene_.joints();
  const Eigen::Index nv = v.size(), first = scene_.joint_bristles();
  force_ += joints.torque();
  joints.slopes(q, v, z.tail(joints.size()), scene_.least_relaxation(), joint_slopes_);
  for (const JointForces::Slope& slope : joint_slopes_) {
    by_q_(slope.v, slope.v) += slope.by_q;
    by_v_(slope.v, slope.v) += slope.by_v;
    if (!is_loaded_[slope.v]) loaded_.push_back(slope.v);
    is_loaded_[slope.v] = 1;
    if (slope.spring < 0) continue;
    const Eigen::Index row = first + slope.spring;
    jacobian(slope.v, 2 * nv + row) += slope.by_z;
    jacobian(nv + row, nv + slope.v) = slope.rate_by_v;
    jacobian(nv + row, 2 * nv + row) = slope.rate_by_z;
  }
}

// Fills by_q_ and by_v_, adds to force_, and where there is a jacobian writes what bristles have in
// it, of the acceleration as generalized forces.
void Linearization::add_contacts(const VectorX& q, const VectorX& v, MatrixX* jacobian) {
  const Eigen::Index nv = v.size();
  by_q_.setZero(nv, nv);
  by_v_.setZero(nv, nv);
  for (int k : loaded_) is_loaded_[k] = 0;
  loaded_.clear();
  if (!scene_.touching()) return;
  scene_.body().place_axes(q);
  const std::vector<ActiveContact>& active = scene_.active();
  for (std::size_t first = 0, next; first < active.size(); first = next) {
    const int p = active[first].pair;
    Chain& chain = chains_[p];
    chain.place(scene_.body(), scene_.states()[p].world_from_j, v);
    Sum sum{Vector6::Zero(), Matrix6::Zero(), Matrix6::Zero()};
    for (next = first; next < active.size() && active[next].pair == p; ++next) {
      const ContactSite site = site_of(active[next], chain.twist());
      find_slopes(active[next], site);
      sum.wrench += slopes_.wrench;
      // The sum over the contacts of a pair first: the chain's products are then made once a pair.
      sum.by_displacement += slopes_.by_place * displacement_of(site);
      sum.by_displacement.rightCols<3>() += slopes_.by_turn;
      sum.by_twist += slopes_.by_twist;
      if (jacobian && active[next].slot >= 0) add_bristle(active[next], site, chain, *jacobian);
      if (jacobian) add_parameters(active[next], site, chain);
    }
    chain.add_force(sum.wrench, force_, by_q_);
    for (int m = 0; m < chain.size(); ++m) {
      // Chain rule: a velocity changes the twist by its axis, a coordinate moves the place by its
      // axis and changes the twist by twist_by_q.
      const Vector6 by_v = sum.by_twist * chain.axes().col(m);
      const Vector6 by_q =
          sum.by_displacement * chain.axes().col(m) + sum.by_twist * chain.twist_by_q().col(m);
      const int column = chain.velocity(m);
      for (int k = 0; k < chain.size(); ++k) {
        by_q_(chain.velocity(k), column) += chain.axes().col(k).dot(by_q);
        by_v_(chain.velocity(k), column) += chain.axes().col(k).dot(by_v);
      }
      if (!is_loaded_[column]) loaded_.push_back(column);
      is_loaded_[column] = 1;
    }
  }
}

void Linearization::find_slopes(const ActiveContact& active, const ContactSite& site) {
  slopes_.depth_by_turn.setZero(), slopes_.by_turn.setZero();
  for (ContactSlopes::Ring& ring : slopes_.rings) ring.rate_by_turn.setZero();
  std::visit([&](const auto& forces) { forces.slopes(scene_, active, site, slopes_); },
             scene_.forces_of(active));
}

void Linearization::add_bristle(const ActiveContact& active, const ContactSite& site,
                                const Chain& chain, MatrixX& jacobian) {
  const Eigen::Index nv = force_.size();
  const int rings = rings_of(active);
  for (int r = 0; r < rings; ++r) {
    const ContactSlopes::Ring& ring = slopes_.rings[r];
    const Eigen::Index z = 3 * (active.slot + r);
    Matrix36 by_displacement = ring.rate_by_place * displacement_of(site);
    by_displacement.rightCols<3>() += ring.rate_by_turn;
    auto rate = jacobian.middleRows<3>(nv + z);
    for (int m = 0; m < chain.size(); ++m) {
      const int k = chain.velocity(m);
      const auto axis = chain.axes().col(m);
      // Joints that mimic another have its velocity.
      rate.col(k) += by_displacement * axis + ring.rate_by_twist * chain.twist_by_q().col(m);
      rate.col(nv + k) += ring.rate_by_twist * axis;
      jacobian.block<1, 3>(k, 2 * nv + z) += axis.transpose() * ring.by_stretch;
    }
    for (int i = 0; i < rings; ++i)
      rate.middleCols<3>(2 * nv + 3 * (active.slot + i)) = ring.rate_by_stretch[i];
  }
}

int Linearization::rings_of(const ActiveContact& active) const {
  return active.slot < 0 ? 0 : scene_.pairs()[active.pair].friction.rings();
}

ContactSite Linearization::site_of(const ActiveContact& active, const Vector6& twist) const {
  const Pair& pair = scene_.pairs()[active.pair];
  const PairState& state = scene_.states()[active.pair];
  const auto& turn = state.world_from_j.rotation();
  ContactSite site{
      active.contact, state.center, pair.has_sphere(),   pair.radius, scene_.disc_radius(active),
      twist,          {},           scene_.shape(active)};
  if (!site.follows) site.place = site.contact.point;
  if (scene_.is_wide(active)) {
    // Derivatives by turns are given besides those by the place.
    site.follows = true, site.place.setZero();
  } else if (pair.on_plane()) {
    // The lowest point, which the body carries along, but for where it is lowest as it turns. The
    // contact is over it, in the plane z = 0.
    static const Mat3 kInPlane = Vec3(1, 1, 0).asDiagonal();
    site.follows = true, site.point_by = &kInPlane;
    site.place -= site.contact.depth * site.contact.normal;
    site.place_by_turn =
        site.contact.dn_dc * cross_matrix(site.contact.normal) / site.contact.weight;
    site.contact.dn_dc.setZero();
  }
  // z is in the shell's frame; that of the first ring was taken to the world for the forces.
  site.stretch[0].setZero();
  if (active.slot >= 0) site.stretch[0] = turn.transpose() * active.kinematics.bristle;
  for (int i = 1; i < rings_of(active); ++i)
    site.stretch[i] = scene_.stretches().segment<3>(3 * (active.slot + i));
  return site;
}

}  // namespace sphshell
