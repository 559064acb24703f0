#include "dynamics/scene/bristles.hpp"

namespace sphshell {

// Index of the one whose point is nearest, of those that `fits`, or -1.
template <class Item, class Fits>
static int nearest(const Vec3& point, const Item* items, std::size_t count, Fits fits) {
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    if (!fits(i)) continue;
    const double apart = (items[i].point - point).squaredNorm();
    if (apart < least) least = apart, best = static_cast<int>(i);
  }
  return best;
}

// Brings x back into the plane of the normal at its full length.
static Vec3 flattened(const Vec3& x, const Vec3& normal) {
  const Vec3 flat = x - x.dot(normal) * normal;
  const double length = flat.norm();
  return length > 0 ? Vec3(flat * (x.norm() / length)) : flat;
}

// One pool of spare slots for each group.
Bristles::Bristles(std::vector<int> groups)
    : groups_(std::move(groups)),
      known_(groups_.size()),
      pools_(groups_.empty() ? 0 : static_cast<std::size_t>(groups_.back()) + 1),
      rings_(groups_.size(), 0) {}

// A group with more pairs has more spare slots, up to kMostSpare; a pool is shared from its second
// pair on.
void Bristles::add(std::size_t k, int rings) {
  rings_[k] = rings;
  Pool& pool = pools_[groups_[k]];
  pool.rings = std::max(pool.rings, rings);
  pool.shared = pool.count > 0;
  pool.count = std::min(pool.count + kSpare, kMostSpare);
  pool.taken.reserve(kMostSpare);
  size_ = 0;
  // Without contacts there are spare slots only, one pool behind the other.
  for (Pool& one : pools_) {
    one.first = size_;
    size_ += one.count * one.rings;
  }
}

// A known contact has its slots; a new one takes a spare, and keeps it for the step, so that the
// stages of a step find the same state. -1: none is left, and the contact has no bristle until the
// step is accepted.
int Bristles::slot(std::size_t k, int place) {
  if (!rings_[k]) return -1;
  const Known& known = known_[k];
  if (place < known.count) return known.first + place * rings_[k];
  Pool& pool = pools_[groups_[k]];
  int spare = place - known.count;
  if (pool.shared) {
    const std::pair<std::size_t, int> contact(k, place);
    const auto at = std::find(pool.taken.begin(), pool.taken.end(), contact);
    spare = static_cast<int>(at - pool.taken.begin());
    if (at == pool.taken.end() && spare < pool.count) pool.taken.push_back(contact);
  }
  return spare < pool.count ? pool.first + spare * pool.rings : -1;
}

void Bristles::restore(const std::vector<std::size_t>& contacts) {
  begin();
  for (std::size_t k = 0; k < contacts.size(); ++k) {
    const std::size_t begin = stretches_.size();
    stretches_.resize(begin + contacts[k] * static_cast<std::size_t>(rings_[k]), Vec3::Zero());
    close(k, begin);
  }
  size_ = static_cast<int>(stretches_.size());
}

void Bristles::restart() {
  for (Pool& pool : pools_) pool.taken.clear();
}

void Bristles::assign_none(std::size_t k) { close(k, stretches_.size()); }

// The stretches from `begin` on are those of pair k; behind the last pair of a group come its spare
// slots.
void Bristles::close(std::size_t k, std::size_t begin) {
  const std::size_t slots = stretches_.size() - begin;
  known_[k] = {static_cast<int>(begin), static_cast<int>(slots) / std::max(rings_[k], 1)};
  if (k + 1 < groups_.size() && groups_[k + 1] == groups_[k]) return;
  Pool& pool = pools_[groups_[k]];
  pool.first = static_cast<int>(stretches_.size());
  pool.taken.clear();
  stretches_.resize(stretches_.size() + pool.count * pool.rings, Vec3::Zero());
}

Vec3 Bristles::stretch(std::size_t k, int place, int ring, const VectorX& z) {
  const int at = slot(k, place);
  return at < 0 ? Vec3::Zero() : Vec3(z.segment<3>(3 * (at + ring)));
}

void Bristles::assign(std::size_t k, const std::vector<Contact>& contacts,
                      const std::vector<int>& at, const ContactTracker& tracker, const VectorX& z,
                      bool torsional, bool turned) {
  const auto& places = tracker.places();
  const int known = static_cast<int>(tracker.known());
  const int rings = rings_[k];
  const std::size_t begin = stretches_.size();
  for (std::size_t i = 0; i < contacts.size(); ++i)
    for (int ring = 0; ring < rings; ++ring) {
      Vec3 x = stretch(k, at[i], ring, z);
      const Vec3& normal = contacts[i].normal;
      // The stretch turns with the normal by the shortest rotation.
      if (!turned) x = Eigen::Quaterniond::FromTwoVectors(places[at[i]].normal, normal) * x;
      stretches_.push_back(torsional ? x : flattened(x, normal));
    }
  const auto add = [&](std::size_t i, int ring, const Vec3& x) {
    stretches_[begin + i * rings + ring] += torsional ? x : flattened(x, contacts[i].normal);
  };
  used_.clear();
  const auto is_used = [&](int place) {
    return std::find(used_.begin(), used_.end(), place) != used_.end();
  };
  const auto minimum_near = [&](const Vec3& point, auto fits) {
    return nearest(point, contacts.data(), contacts.size(),
                   [&](std::size_t i) { return contacts[i].weight > 0 && fits(at[i]); });
  };

  // A contact splits: a minimum and a saddle begin together, with equal and opposite force. Both
  // begin with the stretch of the contact that they split from, so the force does not jump.
  for (std::size_t saddle = 0; saddle < contacts.size(); ++saddle) {
    if (contacts[saddle].weight > 0 || at[saddle] < known) continue;
    const Vec3& point = contacts[saddle].point;
    const int minimum = minimum_near(point, [&](int p) { return p >= known && !is_used(p); });
    const int parent = minimum_near(point, [&](int p) { return p < known; });
    if (minimum < 0 || parent < 0) continue;
    used_.push_back(at[minimum]);
    for (int ring = 0; ring < rings; ++ring) {
      const Vec3 x = stretches_[begin + parent * rings + ring];
      add(saddle, ring, x);
      add(static_cast<std::size_t>(minimum), ring, x);
    }
  }
  // A minimum and a saddle merge and end: the next contact takes over their stretch.
  for (int saddle = 0; saddle < known; ++saddle) {
    if (!places[saddle].saddle || places[saddle].taken) continue;
    const Vec3& point = places[saddle].point;
    const int minimum = nearest(point, places.data(), tracker.known(), [&](std::size_t p) {
      return !places[p].saddle && !places[p].taken && !is_used(static_cast<int>(p));
    });
    // The sum of stretches, a saddle's with its negative weight, is what the successor's must be
    // for the force not to jump.
    const int successor = minimum_near(point, [](int) { return true; });
    if (minimum < 0 || successor < 0) continue;
    used_.push_back(minimum);
    for (int ring = 0; ring < rings; ++ring)
      add(static_cast<std::size_t>(successor), ring,
          stretch(k, minimum, ring, z) - stretch(k, saddle, ring, z));
  }
  close(k, begin);
}

// Slots now are those of the accepted contacts, in their order, each group's spare ones behind
// them.
void Bristles::end(VectorX& z) {
  size_ = static_cast<int>(stretches_.size());
  z.resize(size());
  for (std::size_t i = 0; i < stretches_.size(); ++i) z.segment<3>(3 * i) = stretches_[i];
}

}  // namespace sphshell
