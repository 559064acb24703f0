#include "dynamics/scene.hpp"

#include <algorithm>
#include <utility>

namespace sphshell {

Scene::Scene(const pinocchio::Model& model, std::vector<Pair> pairs)
    : body_(model),
      pairs_(std::move(pairs)),
      queries_(pairs_.size(), Query(true)),
      trackers_(pairs_.size()),
      states_(pairs_.size()),
      external_(static_cast<std::size_t>(model.njoints), pinocchio::Force::Zero()) {
  for (const Pair& pair : pairs_) {
    body_.need(pair.joint_i);
    body_.need(pair.joint_j);
    needs_velocity_ = needs_velocity_ || pair.needs_velocity();
    for (int j : {pair.joint_i, pair.joint_j})
      if (j > 0 && std::find(pushed_.begin(), pushed_.end(), j) == pushed_.end())
        pushed_.push_back(j);
  }
}

void Scene::need_velocity_of(int joint) {
  body_.need(joint);
  needs_velocity_ = true;
}

void Scene::evaluate(const VectorX& q, const VectorX& v, bool audit, std::vector<ContactRow>* log,
                     bool accepted) {
  touching_ = false;
  powers_ = Powers();
  if (needs_velocity_ || log != nullptr)
    body_.kinematics(q, v);
  else if (!pairs_.empty())
    body_.kinematics(q);
  bool cleared = false;
  for (std::size_t k = 0; k < pairs_.size(); ++k) {
    const Pair& pair = pairs_[k];
    PairState& state = states_[k];
    state = PairState();
    const SE3 world_from_j = pair.joint_j == 0
                                 ? pair.placement_j
                                 : body_.world_from_joint(pair.joint_j) * pair.placement_j;
    const std::vector<Contact>& contacts = find(pair, queries_[k], world_from_j);
    const std::vector<int>* numbers = nullptr;
    if (accepted) numbers = &trackers_[k].follow(contacts, pair.radius);
    if (contacts.empty()) continue;
    if (!cleared) {
      for (int j : pushed_) external_[j].setZero();
      cleared = touching_ = true;
    }
    for (std::size_t i = 0; i < contacts.size(); ++i) {
      const Contact& contact = contacts[i];
      const bool in_world = pair.source != nullptr;
      const Vec3 point = in_world ? contact.point : world_from_j.act(contact.point);
      const Vec3 normal =
          in_world ? contact.normal : Vec3(world_from_j.rotation() * contact.normal);
      Vec3 relative = Vec3::Zero();
      if (pair.needs_velocity() || log != nullptr)
        relative = velocity_at(pair.joint_i, point) - velocity_at(pair.joint_j, point);
      const ContactForce f =
          contact_force(pair.law, pair.friction, contact.depth, normal, relative, contact.weight);
      const Vec3 total = f.normal * normal + f.friction;
      apply(pair.joint_i, point, total);
      apply(pair.joint_j, point, -total);
      if (contact.weight > 0) ++state.count;
      state.depth = std::max(state.depth, contact.depth);
      state.normal_force += f.normal;
      if (audit) {
        powers_.damping += f.damping_power;
        powers_.friction += f.friction_power;
        powers_.elastic += contact.energy_weight() * pair.law.energy(contact.depth);
      }
      if (log != nullptr)
        log->push_back({double(k),
                        {point.x(), point.y(), point.z()},
                        {normal.x(), normal.y(), normal.z()},
                        contact.depth,
                        f.normal,
                        {f.friction.x(), f.friction.y(), f.friction.z()},
                        {f.slip.x(), f.slip.y(), f.slip.z()},
                        double(contact.element),
                        double(contact.feature),
                        double(numbers ? (*numbers)[i] : int(i))});
    }
  }
}

const VectorX& Scene::acceleration(const VectorX& q, const VectorX& v, const VectorX& tau) {
  return touching_ ? body_.acceleration(q, v, tau, external_) : body_.acceleration(q, v, tau);
}

const std::vector<Contact>& Scene::find(const Pair& pair, Query& query, const SE3& world_from_j) {
  if (pair.source) {
    query.contacts.clear();
    pair.source(pair.joint_i == 0 ? pair.placement_i
                                  : body_.world_from_joint(pair.joint_i) * pair.placement_i,
                world_from_j, query.contacts);
    return query.contacts;
  }
  const Vec3& centre = pair.placement_i.translation();
  const Vec3 centre_world =
      pair.joint_i == 0 ? centre : body_.world_from_joint(pair.joint_i).act(centre);
  return query.find(*pair.shell, world_from_j.actInv(centre_world), pair.radius, pair.method);
}

void Scene::apply(int joint, const Vec3& point_world, const Vec3& force_world) {
  if (joint == 0) return;  // nothing feels a force on the world
  const SE3& pose = body_.world_from_joint(joint);
  const Vec3 force = pose.rotation().transpose() * force_world;
  external_[joint].linear() += force;
  external_[joint].angular() += pose.actInv(point_world).cross(force);
}

Vec3 Scene::velocity_at(int joint, const Vec3& point_world) const {
  if (joint == 0) return Vec3::Zero();
  const SE3& pose = body_.world_from_joint(joint);
  const pinocchio::Motion& v = body_.velocity(joint);
  return pose.rotation() * (v.linear() + v.angular().cross(pose.actInv(point_world)));
}

}  // namespace sphshell
