// What is kept of the contacts of a scene: rows of runs, and its memory as numbers.

#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

// The numbers of a memory: of each pair how many contacts it has had, how many places are known,
// how many there are with those of the step under way, and the center of its sphere (3) [m]; then,
// pair by pair, of each place the contact's id, 4 feature + 2 rim + saddle, its depth, point and
// normal (3 each, in the shell's frame), and its stretch (3 for each ring); then the stretches of
// joints.
constexpr std::size_t kOfPair = 6, kOfPlace = 9;

// A whole number of those that a memory counts with.
static std::optional<int> count_at(const double* from) {
  if (!(*from >= 0 && *from < 1e9 && *from == std::floor(*from))) return {};
  return static_cast<int>(*from);
}

std::vector<double> SceneData::save(const VectorX& z) {
  std::vector<double> out;
  const auto add = [&](const auto& x) { out.insert(out.end(), x.begin(), x.end()); };
  for (const ContactTracker& tracker : trackers_) {
    for (const double x :
         {double(tracker.next_number()), double(tracker.known()), double(tracker.places().size())})
      out.push_back(x);
    add(tracker.center());
  }
  for (std::size_t k = 0; k < pairs_.size(); ++k)
    for (std::size_t i = 0; i < trackers_[k].places().size(); ++i) {
      const ContactTracker::Place& place = trackers_[k].places()[i];
      const int kind = 4 * static_cast<int>(place.feature) + 2 * place.rim + place.saddle;
      for (const double x : {double(place.number), double(kind), place.depth}) out.push_back(x);
      add(place.point), add(place.normal);
      const int slot = bristles_.slot(k, static_cast<int>(i)), rings = pairs_[k].friction.rings();
      if (!pairs_[k].friction.has_state()) continue;
      if (slot < 0)
        out.resize(out.size() + 3 * static_cast<std::size_t>(rings), 0.0);
      else
        add(z.segment(3 * slot, 3 * rings));
    }
  add(z.tail(joints_.size()));
  return out;
}

bool SceneData::load(const double* from, std::size_t count, VectorX& z) {
  const double *pair = from, *const end = from + count;
  const double* place = from + kOfPair * pairs_.size();
  if (place > end || !std::all_of(from, end, [](double x) { return std::isfinite(x); }))
    return false;
  // All of it is checked before anything is changed.
  std::vector<std::vector<ContactTracker::Place>> places(pairs_.size());
  std::vector<std::size_t> known;
  std::vector<const double*> stretches;
  for (std::size_t k = 0; k < pairs_.size(); ++k, pair += kOfPair) {
    const FrictionLaw& friction = pairs_[k].friction;
    const std::size_t size =
        kOfPlace + (friction.has_state() ? 3 * static_cast<std::size_t>(friction.rings()) : 0);
    const auto next = count_at(pair), first = count_at(pair + 1), all = count_at(pair + 2);
    if (!next || !first || !all || *first > *all ||
        static_cast<std::size_t>(end - place) / size < static_cast<std::size_t>(*all))
      return false;
    known.push_back(static_cast<std::size_t>(*first));
    for (int i = 0; i < *all; ++i, place += size) {
      const auto number = count_at(place), kind = count_at(place + 1);
      if (!number || !kind || *kind / 4 > static_cast<int>(Feature::Ring)) return false;
      places[k].push_back({Vec3(place + 3), Vec3(place + 6), place[2], 0, (*kind & 1) != 0,
                           (*kind & 2) != 0, static_cast<Feature>(*kind / 4), *number});
      stretches.push_back(place + kOfPlace);
    }
  }
  if (end - place != joints_.size()) return false;
  bristles_.restore(known);
  z.setZero(bristle_size());
  auto stretch = stretches.begin();
  pair = from;
  for (std::size_t k = 0; k < pairs_.size(); ++k, pair += kOfPair) {
    for (std::size_t i = 0; i < places[k].size(); ++i, ++stretch) {
      const int slot = bristles_.slot(k, static_cast<int>(i)), rings = pairs_[k].friction.rings();
      if (slot >= 0)
        z.segment(3 * slot, 3 * rings) = Eigen::Map<const VectorX>(*stretch, 3 * rings);
    }
    const Vec3 center(pair + 3);
    trackers_[k].restore(std::move(places[k]), known[k], center, static_cast<int>(pair[0]),
                         pairs_[k].radius);
    excursions_[k] = {center, 0, false};
  }
  z.tail(joints_.size()) = Eigen::Map<const VectorX>(place, joints_.size());
  return true;
}

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
    // Sums over the group, or of a contact by itself: forces as vectors, corrected depths with
    // their weights.
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
