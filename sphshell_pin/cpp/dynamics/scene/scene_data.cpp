#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

SceneData::SceneData(const pinocchio::Model& model, std::vector<Pair> pairs,
                     JointForces::Effects joints)
    : body_(model),
      joints_(std::move(joints), model.nv),
      pairs_(std::move(pairs)),
      clusters_(clusters_of(pairs_)),
      queries_(pairs_.size(), Query(true)),
      forces_(pairs_.size()),
      shapes_(pairs_.size()),
      trackers_(pairs_.size()),
      states_(pairs_.size()),
      excursions_(pairs_.size()),
      external_(static_cast<std::size_t>(model.njoints), pinocchio::Force::Zero()),
      bristles_(group_numbers(pairs_)) {
  if (joints_.effects()) body_.use(joints_.effects()->compiled);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    needs_velocity_ = needs_velocity_ || pair.needs_velocity();
    if (pair.law.foundation()) forces_[k] = FoundationForces();
    if (pair.friction.has_state()) {
      bristles_.add(k, pair.friction.rings());
      // The states behind the first ring are not kept in the contacts: stretches_ keeps z.
      several_rings_ = several_rings_ || pair.friction.rings() > 1;
      if (pair.has_dn_dc()) queries_[k].want_dn_dc();
    }
    // Only joints that carry something are placed, and only they receive forces.
    for (int j : {pair.joint_i, pair.joint_j}) {
      body_.need(j);
      if (j > 0 && std::find(loaded_.begin(), loaded_.end(), j) == loaded_.end())
        loaded_.push_back(j);
    }
  }
  bristle_rates_.setZero(bristle_size());
  active_.reserve(64);
}

void SceneData::change(std::vector<Pair> pairs, JointForces::Effects joints) {
  pairs_ = std::move(pairs);
  clusters_ = clusters_of(pairs_);
  joints_.change(std::move(joints));
  for (const Pair& pair : pairs_) needs_velocity_ = needs_velocity_ || pair.needs_velocity();
}

void SceneData::need_velocity_of(int joint) {
  body_.need(joint);
  needs_velocity_ = true;
}

// Contacts, and the spare slots of bristles, that only rejected stages or steps have seen.
void SceneData::restart() {
  for (ContactTracker& tracker : trackers_) tracker.restart();
  bristles_.restart();
  for (Excursion& excursion : excursions_) excursion.moved = 0, excursion.touched = false;
}

void SceneData::want_dn_dc() {
  wants_second_ = true;
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    if (pairs_[k].has_dn_dc() || pairs_[k].on_plane()) queries_[k].want_dn_dc();
}

void SceneData::evaluate(const VectorX& q, const VectorX& v, const VectorX& z, bool identify) {
  active_.clear();
  if (needs_velocity_)
    body_.kinematics(q, v);
  else if (!pairs_.empty())
    body_.kinematics(q);
  auto cluster = clusters_.begin();
  bool far = false;  // whether the cluster of the pair is
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    PairState& state = states_[k];
    state = PairState();
    // Pairs of a cluster share the placement of the shell and one test against its box.
    if (cluster != clusters_.end() && k > cluster->last) ++cluster, far = false;
    // Pairs of a cluster are neighbors in the list.
    const bool clustered = cluster != clusters_.end() && k >= cluster->first;
    if (clustered && k > cluster->first) {
      state.world_from_j = states_[k - 1].world_from_j;
    } else {
      state.world_from_j = body_.world_from(pair.joint_j, pair.placement_j);
      if (clustered)
        far = cluster->is_far(pair, cluster->center_in_shell(body_, pair, state.world_from_j));
    }
    std::vector<Contact>& contacts = find_contacts(k, far);
    Excursion& excursion = excursions_[k];
    excursion.moved = std::max(excursion.moved, (state.center - excursion.from).norm());
    excursion.touched = excursion.touched || !contacts.empty();
    ContactTracker& tracker = trackers_[k];
    // Identities cost a search: they are looked up where something depends on them, which is a deep
    // contact, whose side must be kept, or a bristle.
    if (!contacts.empty() && (identify || tracker.deep() || pair.friction.has_state())) {
      const std::vector<int>& at = tracker.match(contacts, state.center, pair.radius);
      for (std::size_t i = 0; i < contacts.size(); ++i)
        add_contact(k, contacts[i], bristles_.slot(k, at[i]), tracker.places()[at[i]].number);
      state.pushed_through = tracker.pushed_through();
    } else {
      for (std::size_t i = 0; i < contacts.size(); ++i)
        add_contact(k, contacts[i], -1, static_cast<int>(i));
    }
  }
  evaluate_joints(q, v, z);
  compute_forces(z);
}

void SceneData::evaluate_joints(const VectorX& q, const VectorX& v, const VectorX& z) {
  if (joints_.act()) joints_.evaluate(q, v, z.tail(joints_.size()), relaxation_);
}

// Contacts depend on q alone, so only velocities and forces are computed anew.
void SceneData::revisit(const VectorX& q, const VectorX& v, const VectorX& z) {
  if (active_.empty() && !joints_.act()) return;
  if (needs_velocity_) body_.kinematics(q, v);
  evaluate_joints(q, v, z);
  compute_forces(z);
}

void SceneData::accept(VectorX& z) {
  bristles_.begin();
  std::size_t next = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    std::vector<Contact>& contacts = queries_[k].contacts;
    const Vec3& center = states_[k].center;
    excursions_[k].from = center;
    ContactTracker& tracker = trackers_[k];
    assign_bristles(bristles_, k, z);
    // The common case of a pair far away.
    if (contacts.empty() && tracker.places().empty()) {
      tracker.move_to(center);
      continue;
    }
    if (!pair.friction.has_state()) tracker.match(contacts, center, pair.radius);
    tracker.accept(contacts, center, pair.radius);
    for (std::size_t i = 0; i < contacts.size(); ++i)
      active_[next++].contact_id = tracker.places()[i].number;
  }
  if (!bristles_.any()) return;
  end_bristles(bristles_, z);
  // From now on, the place of a contact is its place in the list.
  for (std::size_t i = 0, place = 0; i < active_.size(); ++i) {
    place = i > 0 && active_[i].pair == active_[i - 1].pair ? place + 1 : 0;
    active_[i].slot = bristles_.slot(active_[i].pair, static_cast<int>(place));
  }
  compute_forces(z);
}

// As accept() does it, with a copy of the slots.
void SceneData::reorder_bristles(VectorX& z) {
  if (!bristles_.any()) return;
  Bristles bristles = bristles_;
  bristles.begin();
  for (std::size_t k = 0; k < pairs_.size(); ++k) assign_bristles(bristles, k, z);
  end_bristles(bristles, z);
}

void SceneData::assign_bristles(Bristles& bristles, std::size_t k, const VectorX& z) {
  const Pair& pair = pairs_[k];
  std::vector<Contact>& contacts = queries_[k].contacts;
  ContactTracker& tracker = trackers_[k];
  if (!pair.friction.has_state() || (contacts.empty() && tracker.places().empty())) {
    bristles.assign_none(k);
    return;
  }
  const std::vector<int>& at = tracker.match(contacts, states_[k].center, pair.radius);
  bristles.assign(k, contacts, at, tracker, z, pair.friction.torsional(), pair.has_dn_dc());
}

// Stretches of joints stay behind those of contacts.
void SceneData::end_bristles(Bristles& bristles, VectorX& z) const {
  // z is (bristles of contacts, springs of joints); the first part changes its size.
  const VectorX joints = z.tail(joints_.size());
  bristles.end(z);
  z.conservativeResize(bristles.size() + joints.size());
  z.tail(joints.size()) = joints;
}

std::vector<Contact>& SceneData::find_contacts(std::size_t k, bool far) {
  const Pair& pair = pairs_[k];
  PairState& state = states_[k];
  Query& query = queries_[k];
  if (pair.has_sphere())
    state.center =
        state.world_from_j.actInv(body_.world_from(pair.joint_i, pair.placement_i.translation()));
  if (far) {
    query.contacts.clear();
    return query.contacts;
  }
  const auto pose_i = [&] { return body_.world_from(pair.joint_i, pair.placement_i); };
  std::visit(
      [&](auto& forces) {
        forces.find(pair, pose_i, state.world_from_j, state.center, wants_second_, query);
      },
      forces_[k]);
  if (pair.needs_shape()) find_shapes(k);
  // Friction belongs to a place, and its spring should not be split and merged at every border
  // between elements: contacts that are nearly one are one. The elastic energy is that of their
  // depths' sum, off by the square of the depths' difference, 1e-4 at most.
  if (pair.friction.active() && query.contacts.size() > 1) {
    merge_groups(query.contacts, state.center, pair.radius, merged_);
    if (pair.needs_shape()) {
      // The shapes are merged like their contacts.
      merge_shapes(query.contacts, shapes_[k], merged_shapes_);
      shapes_[k].swap(merged_shapes_);
    }
    query.contacts.swap(merged_);
  }
  return query.contacts;
}

// The shapes of the gaps at a pair's contacts.
void SceneData::find_shapes(std::size_t k) {
  shapes_[k].clear();
  for (const Contact& contact : queries_[k].contacts)
    shapes_[k].push_back(shape_of(k, pairs_[k], contact));
}

ContactShape SceneData::shape_of(std::size_t k, const Pair& pair, const Contact& contact) {
  // Of geometry with one curvature everywhere the gap is that of two spheres, 1 / r_1 + 1 / r_2;
  // else it is looked up.
  const Shell* shell = pair.ask([](const auto& one) { return one.smooth_shell(); });
  if (!shell) {
    const double curvature =
        1 / pair.radius + pair.ask([](const auto& one) { return one.curvature(); });
    ContactShape out = shape_of_gap(curvature * Mat3::Identity(), contact.normal, pair.radius);
    out.depth = contact.depth;
    return out;
  }
  const auto at = std::find_if(curvatures_.begin(), curvatures_.end(),
                               [&](const Curvature& one) { return one.is_of(*shell); });
  Curvature& curvature = at == curvatures_.end() ? curvatures_.emplace_back(*shell) : *at;
  return curvature.shape(contact, states_[k].center, pair.radius, wants_second_);
}

void SceneData::add_contact(std::size_t k, const Contact& contact, int slot, int contact_id) {
  ActiveContact& active = active_.emplace_back();
  active.pair = static_cast<int>(k);
  active.slot = slot;
  active.contact_id = contact_id;
  active.contact = contact;
  active.index = static_cast<int>(&contact - queries_[k].contacts.data());
  if (pairs_[k].needs_shape()) active.shape = active.index;
}

void SceneData::compute_forces(const VectorX& z) {
  // z is the state of the bristles at which the joints were evaluated, too.
  powers_ = joints_.powers();
  bristle_rates_.setZero(bristle_size());
  bristle_rates_.tail(joints_.size()) = joints_.rates();
  touching_ = !active_.empty();
  if (!touching_) return;
  if (several_rings_) stretches_ = z;
  for (int j : loaded_) external_[j].setZero();
  for (PairState& state : states_) state.clear_sums();
  for (ActiveContact& active : active_) {
    compute_kinematics(active, z);
    compute_force(active, z);
    add_force(active);
  }
}

void SceneData::compute_kinematics(ActiveContact& active, const VectorX& z) {
  const Pair& pair = pairs_[active.pair];
  const SE3& world_from_j = states_[active.pair].world_from_j;
  ContactKinematics<double>& m = active.kinematics;
  active.point = world_from_j.act(active.contact.point);
  // All kinematics in the world: the laws need no frame, as they depend on scalar products only.
  m.depth = active.contact.depth;
  m.normal = world_from_j.rotation() * active.contact.normal;
  m.relative.setZero();
  if (pair.needs_velocity()) m.relative = relative_velocity(pair, active.point);
  if (pair.friction.torsional()) m.spin = m.normal.dot(relative_spin(pair));
  // Hertz's law takes the corrected depth of the shape.
  if (const ContactShape* gap = shape(active)) m.scale = gap->scale, m.depth = gap->depth;
  if (pair.friction.rolls()) {
    const Vec3 spin = relative_spin(pair);
    m.rolling = spin - spin.dot(m.normal) * m.normal;
  }
  if (active.slot >= 0) m.bristle = world_from_j.rotation() * z.segment<3>(3 * active.slot);
}

void SceneData::compute_force(ActiveContact& active, const VectorX& z) {
  const Pair& pair = pairs_[active.pair];
  const auto& rotation = states_[active.pair].world_from_j.rotation();
  const int at = 3 * active.slot, rings = active.slot >= 0 ? pair.friction.rings() : 1;
  Vec3 outer[kMostRings - 1], outer_rate[kMostRings - 1];
  ContactKinematics<double>& m = active.kinematics;
  if (rings > 1) {
    for (int i = 1; i < rings; ++i) outer[i - 1] = rotation * z.segment<3>(at + 3 * i);
    m.outer = outer;
    m.outer_rate = outer_rate;
  }
  active.force = contact_force(pair.law, pair.friction, disc_radius(active), relaxation(pair), m);
  std::visit([&](const auto& forces) { forces.complete(*this, active); }, forces_[active.pair]);
  m.outer = nullptr, m.outer_rate = nullptr;  // not beyond this evaluation
  // The energy also changes with the shape, as the sphere moves along the shell. It depends on the
  // sphere's center alone: that is where the force acts.
  if (const HertzLaw* hertz = pair.law.hertz(); hertz && active.shape >= 0) {
    const ContactShape& gap = *shape(active);
    active.climb =
        rotation * (active.force.elastic * gap.tilt - hertz->energy(gap.depth, 1) * gap.gradient);
  }
  if (active.slot < 0) return;
  bristle_rates_.segment<3>(at) =
      rotation.transpose() * active.force.bristle_rate + rate_of_turning(active, z.segment<3>(at));
  for (int i = 1; i < rings; ++i)
    bristle_rates_.segment<3>(at + 3 * i) = rotation.transpose() * outer_rate[i - 1] +
                                            rate_of_turning(active, z.segment<3>(at + 3 * i));
}

// How fast a stretch z turns with the normal, in the shell's frame: by the normal's angular
// velocity n x n' it changes by (n x n') x z.
Vec3 SceneData::rate_of_turning(const ActiveContact& active, const Vec3& stretch) const {
  const Pair& pair = pairs_[active.pair];
  if (!pair.has_dn_dc()) return Vec3::Zero();
  const PairState& state = states_[active.pair];
  const Vec3 center_rate = state.world_from_j.rotation().transpose() *
                           relative_velocity(pair, state.world_from_j.act(state.center));
  const Contact& contact = active.contact;
  // dn_dc holds the weight of the contact.
  const Vec3 normal_rate = contact.dn_dc * center_rate / contact.weight;
  return contact.normal.cross(normal_rate).cross(stretch);
}

ContactWrench SceneData::wrench(const ActiveContact& active) const {
  const ContactForce<double>& f = active.force;
  const Vec3& normal = active.kinematics.normal;
  const double weight = active.contact.weight;
  // The force at the contact point; what acts at the sphere's center is moved there with its
  // moment.
  ContactWrench out{active.point, weight * (f.normal * normal + f.friction),
                    weight * f.torsion * normal + weight * f.rolling + active.moment};
  if (active.shape >= 0) {
    const PairState& state = states_[active.pair];
    out.force += weight * active.climb;
    out.moment +=
        weight * (state.world_from_j.act(state.center) - active.point).cross(active.climb);
  }
  return out;
}

// Adds a contact to the forces on the joints and to the sums of its pair.
void SceneData::add_force(const ActiveContact& active) {
  const Pair& pair = pairs_[active.pair];
  const ContactForce<double>& f = active.force;
  const ContactKinematics<double>& m = active.kinematics;
  const double weight = active.contact.weight;
  // Newton's third law: equal and opposite at one point.
  const ContactWrench on_i = wrench(active);
  apply(pair.joint_i, active.point, on_i.force, on_i.moment);
  apply(pair.joint_j, active.point, -on_i.force, -on_i.moment);
  PairState& state = states_[active.pair];
  if (weight > 0) ++state.count;
  state.pieces += active.pieces;
  if (active.clamped) ++state.clamped;
  state.depth = std::max(state.depth, m.depth);
  state.normal_force += weight * f.normal;
  powers_.damping += active.damping;
  powers_.friction += active.sliding;
  powers_.elastic += active.elastic;
  if (active.slot >= 0)
    powers_.bristles += 0.5 * (weight > 0 ? 1 : weight) * f.stiffness * f.stretch2;
  if (const ContactShape* gap = shape(active)) {
    state.conformity = std::max(state.conformity, gap->conformity);
    state.half_axis = std::max(state.half_axis, gap->half_axes(m.depth)[0] / pair.radius);
  }
}

void SceneData::apply(int joint, const Vec3& point_world, const Vec3& force_world,
                      const Vec3& moment_world) {
  if (joint == 0) return;  // the world does not move
  const SE3& pose = body_.world_from_joint(joint);
  // As Pinocchio wants it: in the joint's frame, the moment about the joint's origin.
  const Vec3 force = pose.rotation().transpose() * force_world;
  external_[joint].linear() += force;
  external_[joint].angular() +=
      pose.actInv(point_world).cross(force) + pose.rotation().transpose() * moment_world;
}

Vec3 SceneData::relative_velocity(const Pair& pair, const Vec3& point_world) const {
  return body_.velocity_at(pair.joint_i, point_world) -
         body_.velocity_at(pair.joint_j, point_world);
}

Vec3 SceneData::relative_spin(const Pair& pair) const {
  return body_.angular_velocity(pair.joint_i) - body_.angular_velocity(pair.joint_j);
}

// Without touching contacts ABA without external forces, which is faster.
const VectorX& SceneData::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau) {
  const VectorX& all = joints_.act() ? joints_.added(tau) : tau;
  return body_.acceleration(q, v, all, touching_ ? &external_ : nullptr);
}

}  // namespace sphshell
