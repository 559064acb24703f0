#include "dynamics/scene.hpp"

#include <algorithm>
#include <utility>

namespace sphshell {
namespace {

bool turns_known(const Pair& pair) { return !pair.source && pair.method != Method::Elements; }

}  // namespace

Scene::Scene(const pinocchio::Model& model, std::vector<Pair> pairs)
    : body_(model),
      pairs_(std::move(pairs)),
      queries_(pairs_.size(), Query(true)),
      trackers_(pairs_.size()),
      states_(pairs_.size()),
      excursions_(pairs_.size()),
      external_(static_cast<std::size_t>(model.njoints), pinocchio::Force::Zero()),
      bristles_(pairs_.size()) {
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    body_.need(pair.joint_i);
    body_.need(pair.joint_j);
    needs_velocity_ = needs_velocity_ || pair.needs_velocity();
    if (pair.friction.has_state()) {
      bristles_.add(k);
      if (turns_known(pair)) queries_[k].want_dn_dc();
    }
    for (int j : {pair.joint_i, pair.joint_j})
      if (j > 0 && std::find(pushed_.begin(), pushed_.end(), j) == pushed_.end())
        pushed_.push_back(j);
  }
  bristle_rates_.setZero(bristle_size());
  active_.reserve(64);
}

void Scene::change(std::vector<Pair> pairs) {
  pairs_ = std::move(pairs);
  for (const Pair& pair : pairs_) needs_velocity_ = needs_velocity_ || pair.needs_velocity();
}

void Scene::need_velocity_of(int joint) {
  body_.need(joint);
  needs_velocity_ = true;
}

void Scene::restart() {
  for (ContactTracker& tracker : trackers_) tracker.restart();
  for (Excursion& excursion : excursions_) excursion.moved = 0, excursion.touched = false;
}

void Scene::want_turns() {
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    if (turns_known(pairs_[k])) queries_[k].want_dn_dc();
}

void Scene::evaluate(const VectorX& q, const VectorX& v, const VectorX& z, bool numbered) {
  active_.clear();
  if (needs_velocity_)
    body_.kinematics(q, v);
  else if (!pairs_.empty())
    body_.kinematics(q);
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    PairState& state = states_[k];
    state = PairState();
    state.world_from_j = pair.joint_j == 0
                             ? pair.placement_j
                             : body_.world_from_joint(pair.joint_j) * pair.placement_j;
    std::vector<Contact>& contacts = find(k);
    Excursion& excursion = excursions_[k];
    excursion.moved = std::max(excursion.moved, (state.centre - excursion.from).norm());
    excursion.touched = excursion.touched || !contacts.empty();
    ContactTracker& tracker = trackers_[k];
    const bool matched =
        !contacts.empty() && (numbered || tracker.deep() || pair.friction.has_state());
    if (matched) {
      const std::vector<int>& at = tracker.match(contacts, state.centre, pair.radius);
      for (std::size_t i = 0; i < contacts.size(); ++i)
        add(k, contacts[i], bristles_.slot(k, at[i]), tracker.places()[at[i]].number);
      state.pushed_through = tracker.pushed_through();
    } else {
      for (std::size_t i = 0; i < contacts.size(); ++i)
        add(k, contacts[i], -1, static_cast<int>(i));
    }
  }
  exert(z);
}

void Scene::revisit(const VectorX& q, const VectorX& v, const VectorX& z) {
  if (active_.empty()) return;
  if (needs_velocity_) body_.kinematics(q, v);
  exert(z);
}

void Scene::accept(VectorX& z) {
  if (bristles_.any()) bristles_.begin();
  std::size_t next = 0;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    std::vector<Contact>& contacts = queries_[k].contacts;
    excursions_[k].from = states_[k].centre;
    ContactTracker& tracker = trackers_[k];
    if (contacts.empty() && tracker.places().empty()) {
      tracker.move_to(states_[k].centre);
      if (bristles_.any()) bristles_.deal_none(k);
      continue;
    }
    const std::vector<int>& at = tracker.match(contacts, states_[k].centre, pair.radius);
    if (bristles_.any() && pair.friction.has_state())
      bristles_.deal(k, contacts, at, tracker, z, pair.friction.torsional(), turns_known(pair));
    else if (bristles_.any())
      bristles_.deal_none(k);
    tracker.accept(contacts, states_[k].centre, pair.radius);
    for (std::size_t i = 0; i < contacts.size(); ++i)
      active_[next++].number = tracker.places()[i].number;
  }
  if (!bristles_.any()) return;
  bristles_.end(z);
  // From now on, the place of a contact is its place in the list.
  for (std::size_t i = 0, place = 0; i < active_.size(); ++i) {
    place = i > 0 && active_[i].pair == active_[i - 1].pair ? place + 1 : 0;
    active_[i].slot = bristles_.slot(active_[i].pair, static_cast<int>(place));
  }
  exert(z);
}

void Scene::add(std::size_t k, const Contact& contact, int slot, int number) {
  active_.emplace_back();
  ActiveContact& active = active_.back();
  active.pair = static_cast<int>(k);
  active.slot = slot;
  active.number = number;
  active.contact = contact;
}

// The forces of the active contacts.
void Scene::exert(const VectorX& z) {
  powers_ = Powers();
  bristle_rates_.setZero(bristle_size());
  touching_ = !active_.empty();
  if (!touching_) return;
  for (int j : pushed_) external_[j].setZero();
  for (PairState& state : states_) state.clear();
  for (ActiveContact& active : active_) {
    meet(active, z);
    push(active);
  }
}

std::vector<Contact>& Scene::find(std::size_t k) {
  const Pair& pair = pairs_[k];
  PairState& state = states_[k];
  Query& query = queries_[k];
  if (pair.source) {
    query.contacts.clear();
    pair.source(pair.joint_i == 0 ? pair.placement_i
                                  : body_.world_from_joint(pair.joint_i) * pair.placement_i,
                state.world_from_j, query.contacts);
    // As a shell's: in the frame of body j.
    for (Contact& contact : query.contacts) {
      contact.point = state.world_from_j.actInv(contact.point);
      contact.normal = state.world_from_j.rotation().transpose() * contact.normal;
    }
    state.centre.setZero();
    return query.contacts;
  }
  const Vec3& centre = pair.placement_i.translation();
  state.centre = state.world_from_j.actInv(
      pair.joint_i == 0 ? centre : body_.world_from_joint(pair.joint_i).act(centre));
  query.find(*pair.shell, state.centre, pair.radius, pair.method);
  // Friction belongs to a place, and its spring should not part and join at every border between
  // elements: contacts that are nearly one are one. The elastic energy is that of their depths'
  // sum, off by the square of what they differ by, 1e-4 at most.
  if (pair.friction.active() && query.contacts.size() > 1) {
    merge_places(query.contacts, state.centre, pair.radius, merged_);
    query.contacts.swap(merged_);
  }
  return query.contacts;
}

// The force of a contact, and how its bristle goes on.
void Scene::meet(ActiveContact& active, const VectorX& z) {
  const Pair& pair = pairs_[active.pair];
  const SE3& world_from_j = states_[active.pair].world_from_j;
  const Contact& contact = active.contact;
  const auto& turn = world_from_j.rotation();
  Meeting<double>& m = active.meeting;
  m.depth = contact.depth;
  active.point = world_from_j.act(contact.point);
  m.normal = turn * contact.normal;
  m.relative.setZero();
  if (pair.needs_velocity()) m.relative = relative_velocity(pair, active.point);
  if (pair.friction.torsional())
    m.spin = m.normal.dot(spin_of(pair.joint_i) - spin_of(pair.joint_j));
  if (active.slot >= 0) m.bristle = turn * z.segment<3>(3 * active.slot);
  active.force = contact_force(pair.law, pair.friction, pair.radius, relaxation(pair), m);
  if (active.slot >= 0)
    bristle_rates_.segment<3>(3 * active.slot) = turn.transpose() * active.force.bristle_rate +
                                                 turning(active, z.segment<3>(3 * active.slot));
}

// How fast a stretch turns with the normal, in the shell's frame.
Vec3 Scene::turning(const ActiveContact& active, const Vec3& stretch) const {
  const Pair& pair = pairs_[active.pair];
  if (!turns_known(pair)) return Vec3::Zero();
  const PairState& state = states_[active.pair];
  const Vec3 centre_rate = state.world_from_j.rotation().transpose() *
                           relative_velocity(pair, state.world_from_j.act(state.centre));
  const Contact& contact = active.contact;
  const Vec3 normal_rate = contact.dn_dc * centre_rate / contact.weight;
  return contact.normal.cross(normal_rate).cross(stretch);
}

void Scene::push(const ActiveContact& active) {
  const Pair& pair = pairs_[active.pair];
  const ContactForce<double>& f = active.force;
  const Meeting<double>& m = active.meeting;
  const double weight = active.contact.weight;
  const Vec3 force = weight * (f.normal * m.normal + f.friction);
  const Vec3 moment = weight * f.torsion * m.normal;
  apply(pair.joint_i, active.point, force, moment);
  apply(pair.joint_j, active.point, -force, -moment);
  PairState& state = states_[active.pair];
  if (weight > 0) ++state.count;
  state.pieces += weight > 0 ? 1 : -1;
  if (f.normal == 0) ++state.clamped;
  state.depth = std::max(state.depth, m.depth);
  state.normal_force += weight * f.normal;
  // The weight of several as one is the length of the sum of their normals.
  const double share = weight > 0 ? 1 : weight;
  powers_.damping += weight * damping_power(f, m);
  powers_.friction += weight * friction_power(f, m);
  powers_.elastic += share * pair.law.energy(m.depth);
  if (active.slot >= 0)
    powers_.bristles += 0.5 * share * pair.friction.bristle()->stiffness * f.bristle.squaredNorm();
}

// Contacts of one place as one, with the sum of their forces.
void Scene::log(const VectorX& q, const VectorX& v, std::vector<ContactRow>& rows) {
  if (active_.empty()) return;
  if (!needs_velocity_) body_.kinematics(q, v);
  for (std::size_t i = 0, begin = 0; i < active_.size(); ++i) {
    const ActiveContact& active = active_[i];
    if (i > 0 && active.pair != active_[i - 1].pair) begin = i;
    const std::vector<Contact>& contacts = queries_[active.pair].contacts;
    if (!leads(contacts, i - begin)) continue;
    const Pair& pair = pairs_[active.pair];
    const PairState& state = states_[active.pair];
    const Contact whole = whole_of(contacts, i - begin, state.centre, pair.radius);
    const Vec3 point = state.world_from_j.act(whole.point);
    const Vec3 normal = state.world_from_j.rotation() * whole.normal;
    Vec3 push = Vec3::Zero(), friction = Vec3::Zero();
    // One that is of no place stands alone.
    const std::size_t first = i - begin, last = whole.place < 0 ? first + 1 : contacts.size();
    for (std::size_t k = first; k < last; ++k) {
      if (k != first && contacts[k].place != whole.place) continue;
      const ActiveContact& other = active_[begin + k];
      push += other.contact.weight * other.force.normal * other.meeting.normal;
      friction += other.contact.weight * other.force.friction;
    }
    const Vec3 relative = relative_velocity(pair, point);
    const Vec3 slip = relative - relative.dot(normal) * normal;
    rows.push_back({double(active.pair),
                    {point.x(), point.y(), point.z()},
                    {normal.x(), normal.y(), normal.z()},
                    whole.depth,
                    push.dot(normal),
                    {friction.x(), friction.y(), friction.z()},
                    {slip.x(), slip.y(), slip.z()},
                    double(whole.element),
                    double(whole.feature),
                    double(active.number)});
  }
}

const VectorX& Scene::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau) {
  return touching_ ? body_.acceleration(q, v, tau, external_) : body_.acceleration(q, v, tau);
}

void Scene::apply(int joint, const Vec3& point_world, const Vec3& force_world,
                  const Vec3& moment_world) {
  if (joint == 0) return;  // nothing feels a force on the world
  const SE3& pose = body_.world_from_joint(joint);
  const Vec3 force = pose.rotation().transpose() * force_world;
  external_[joint].linear() += force;
  external_[joint].angular() +=
      pose.actInv(point_world).cross(force) + pose.rotation().transpose() * moment_world;
}

Vec3 Scene::relative_velocity(const Pair& pair, const Vec3& point_world) const {
  return velocity_at(pair.joint_i, point_world) - velocity_at(pair.joint_j, point_world);
}

Vec3 Scene::velocity_at(int joint, const Vec3& point_world) const {
  if (joint == 0) return Vec3::Zero();
  const SE3& pose = body_.world_from_joint(joint);
  const pinocchio::Motion& v = body_.velocity(joint);
  return pose.rotation() * (v.linear() + v.angular().cross(pose.actInv(point_world)));
}

Vec3 Scene::spin_of(int joint) const {
  if (joint == 0) return Vec3::Zero();
  return body_.world_from_joint(joint).rotation() * body_.velocity(joint).angular();
}

}  // namespace sphshell
