// What runs record of the contacts of a scene.
#include <algorithm>

#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

// Contacts of one place as one, with the sum of their forces.
void SceneData::log(const VectorX& q, const VectorX& v, std::vector<ContactRow>& rows,
                    std::vector<PatchRow>* patches) {
  if (active_.empty()) return;
  if (!needs_velocity_) body_.kinematics(q, v);
  const auto write = [](double* to, const Vec3& x) { std::copy_n(x.data(), 3, to); };
  for (std::size_t i = 0, begin = 0; i < active_.size(); ++i) {
    const ActiveContact& active = active_[i];
    if (i > 0 && active.pair != active_[i - 1].pair) begin = i;
    const std::vector<Contact>& contacts = queries_[active.pair].contacts;
    if (!leads(contacts, i - begin)) continue;
    const Pair& pair = pairs_[active.pair];
    const PairState& state = states_[active.pair];
    const Contact whole = whole_of(contacts, i - begin, state.center, pair.radius);
    const Vec3 point = state.world_from_j.act(whole.point);
    const Vec3 normal = state.world_from_j.rotation() * whole.normal;
    // Those of a plane are of its own body, as a sphere's are.
    const double side = pair.on_plane() ? -1 : 1;
    Vec3 push = Vec3::Zero(), friction = Vec3::Zero();
    double depth = 0;  // corrected, where the shape counts
    // One without a place stands alone.
    // Sums over the group: forces as vectors, corrected depths with their weights.
    const std::size_t first = i - begin, last = whole.group < 0 ? first + 1 : contacts.size();
    for (std::size_t k = first; k < last; ++k) {
      if (k != first && contacts[k].group != whole.group) continue;
      const ActiveContact& other = active_[begin + k];
      push += other.contact.weight * other.force.normal * other.kinematics.normal;
      if (other.shape >= 0) depth += other.contact.weight * other.kinematics.depth;
      friction += other.contact.weight * other.force.friction;
    }
    const Vec3 relative = relative_velocity(pair, point);
    ContactRow& row = rows.emplace_back();
    write(row.point, point);
    write(row.normal, side * normal);
    row.depth = active.shape < 0 ? whole.depth : whole.group < 0 ? active.kinematics.depth : depth;
    // Around a ring the normals cancel in part.
    row.normal_force = whole.feature == Feature::Ring ? active.force.normal : push.dot(normal);
    write(row.friction_force, side * friction);
    write(row.slip_velocity, side * (relative - relative.dot(normal) * normal));
    row.pair = active.pair;
    row.element = whole.element;
    row.contact_id = active.contact_id;
    row.feature = whole.feature;
    if (patches)
      std::visit([&](const auto& f) { patches->push_back(f.patch(*this, active, row)); },
                 forces_[active.pair]);
  }
}

// Contacts of one group share the row of the one that leads it.
int SceneData::rows_of_contacts(std::vector<int>& rows) const {
  rows.assign(active_.size(), -1);
  int count = 0;
  for (std::size_t i = 0, begin = 0; i < active_.size(); ++i) {
    if (i > 0 && active_[i].pair != active_[i - 1].pair) begin = i;
    const std::vector<Contact>& contacts = queries_[active_[i].pair].contacts;
    if (!leads(contacts, i - begin)) continue;
    const int group = contacts[i - begin].group;
    for (std::size_t k = i - begin; k < contacts.size(); ++k)
      if (begin + k == i || (group >= 0 && contacts[k].group == group)) rows[begin + k] = count;
    ++count;
  }
  return count;
}

}  // namespace sphshell
