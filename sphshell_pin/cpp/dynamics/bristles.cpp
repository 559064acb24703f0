#include "dynamics/bristles.hpp"

#include <algorithm>
#include <limits>

namespace sphshell {
namespace {

constexpr int kSpare = 4;

// Index of the nearest of `count` places that `fits`, or -1.
template <class Fits, class PointOf>
int nearest(const Vec3& point, std::size_t count, Fits fits, PointOf point_of) {
  int best = -1;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < count; ++i) {
    if (!fits(i)) continue;
    const double apart = (point_of(i) - point).squaredNorm();
    if (apart < least) least = apart, best = static_cast<int>(i);
  }
  return best;
}

// Brings x back into the plane of the normal at its full length.
Vec3 flattened(const Vec3& x, const Vec3& normal) {
  const Vec3 flat = x - x.dot(normal) * normal;
  const double length = flat.norm();
  return length > 0 ? Vec3(flat * (x.norm() / length)) : flat;
}

}  // namespace

void Bristles::add(std::size_t k) {
  has_[k] = 1;
  for (std::size_t i = k + 1; i < first_.size(); ++i) first_[i] += kSpare;
}

void Bristles::deal_none(std::size_t k) {
  if (has_[k]) dealt_.resize(dealt_.size() + kSpare, Vec3::Zero());
  next_[k + 1] = static_cast<int>(dealt_.size());
}

Vec3 Bristles::stretch(std::size_t k, int place, const VectorX& z) const {
  const int at = slot(k, place);
  return at < 0 ? Vec3::Zero() : Vec3(z.segment<3>(3 * at));
}

void Bristles::deal(std::size_t k, const std::vector<Contact>& contacts, const std::vector<int>& at,
                    const ContactTracker& tracker, const VectorX& z, bool torsional, bool turned) {
  const auto& places = tracker.places();
  const int known = static_cast<int>(tracker.known());
  const std::size_t begin = dealt_.size();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Vec3 x = stretch(k, at[i], z);
    const Vec3& normal = contacts[i].normal;
    if (!turned) x = Eigen::Quaterniond::FromTwoVectors(places[at[i]].normal, normal) * x;
    dealt_.push_back(torsional ? x : flattened(x, normal));
  }
  const auto point_of_contact = [&](std::size_t i) -> const Vec3& { return contacts[i].point; };
  const auto point_of_place = [&](std::size_t p) -> const Vec3& { return places[p].point; };

  // A contact is the twin of one pass only.
  used_.clear();
  const auto is_used = [&](int place) {
    return std::find(used_.begin(), used_.end(), place) != used_.end();
  };

  // Where a contact parts in two, a minimum and the pass to it come to be together, with equal and
  // opposite force: both begin as the contact that they part from, and nothing jumps.
  for (std::size_t pass = 0; pass < contacts.size(); ++pass) {
    if (contacts[pass].weight > 0 || at[pass] < known) continue;
    const int twin = nearest(
        contacts[pass].point, contacts.size(),
        [&](std::size_t i) { return contacts[i].weight > 0 && at[i] >= known && !is_used(at[i]); },
        point_of_contact);
    const int parent = nearest(
        contacts[pass].point, contacts.size(),
        [&](std::size_t i) { return contacts[i].weight > 0 && at[i] < known; }, point_of_contact);
    if (twin < 0 || parent < 0) continue;
    used_.push_back(at[twin]);
    const Vec3 x = dealt_[begin + parent];
    for (std::size_t i : {pass, static_cast<std::size_t>(twin)})
      dealt_[begin + i] += torsional ? x : flattened(x, contacts[i].normal);
  }
  // Where a minimum and a pass meet and end, what was stretched in them goes to the next contact.
  for (int pass = 0; pass < known; ++pass) {
    if (!places[pass].saddle || places[pass].taken) continue;
    const int twin = nearest(
        places[pass].point, known,
        [&](std::size_t p) {
          return !places[p].saddle && !places[p].taken && !is_used(static_cast<int>(p));
        },
        point_of_place);
    const int heir = nearest(
        places[pass].point, contacts.size(), [&](std::size_t i) { return contacts[i].weight > 0; },
        point_of_contact);
    if (twin < 0 || heir < 0) continue;
    used_.push_back(twin);
    const Vec3 left = stretch(k, twin, z) - stretch(k, pass, z);
    dealt_[begin + heir] += torsional ? left : flattened(left, contacts[heir].normal);
  }
  dealt_.resize(dealt_.size() + kSpare, Vec3::Zero());
  next_[k + 1] = static_cast<int>(dealt_.size());
}

void Bristles::end(VectorX& z) {
  first_.swap(next_);
  z.resize(size());
  for (std::size_t i = 0; i < dealt_.size(); ++i) z.segment<3>(3 * i) = dealt_[i];
}

}  // namespace sphshell
