#include "dynamics/bristles.hpp"

#include <algorithm>
#include <limits>

namespace sphshell {
namespace {

// Index of the one whose point is nearest, of those that `fits`, or -1.
template <class Item, class Fits>
int nearest(const Vec3& point, const Item* items, std::size_t count, Fits fits) {
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

void Bristles::assign_none(std::size_t k) {
  if (has_[k]) stretches_.resize(stretches_.size() + kSpare, Vec3::Zero());
  next_[k + 1] = static_cast<int>(stretches_.size());
}

Vec3 Bristles::stretch(std::size_t k, int place, const VectorX& z) const {
  const int at = slot(k, place);
  return at < 0 ? Vec3::Zero() : Vec3(z.segment<3>(3 * at));
}

void Bristles::assign(std::size_t k, const std::vector<Contact>& contacts,
                      const std::vector<int>& at, const ContactTracker& tracker, const VectorX& z,
                      bool torsional, bool turned) {
  const auto& places = tracker.places();
  const int known = static_cast<int>(tracker.known());
  const std::size_t begin = stretches_.size();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    Vec3 x = stretch(k, at[i], z);
    const Vec3& normal = contacts[i].normal;
    if (!turned) x = Eigen::Quaterniond::FromTwoVectors(places[at[i]].normal, normal) * x;
    stretches_.push_back(torsional ? x : flattened(x, normal));
  }
  const auto add = [&](std::size_t i, const Vec3& x) {
    stretches_[begin + i] += torsional ? x : flattened(x, contacts[i].normal);
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
    const Vec3 x = stretches_[begin + parent];
    add(saddle, x);
    add(static_cast<std::size_t>(minimum), x);
  }
  // A minimum and a saddle merge and end: the next contact takes over their stretch.
  for (int saddle = 0; saddle < known; ++saddle) {
    if (!places[saddle].saddle || places[saddle].taken) continue;
    const Vec3& point = places[saddle].point;
    const int minimum = nearest(point, places.data(), tracker.known(), [&](std::size_t p) {
      return !places[p].saddle && !places[p].taken && !is_used(static_cast<int>(p));
    });
    const int successor = minimum_near(point, [](int) { return true; });
    if (minimum < 0 || successor < 0) continue;
    used_.push_back(minimum);
    add(static_cast<std::size_t>(successor), stretch(k, minimum, z) - stretch(k, saddle, z));
  }
  assign_none(k);  // the spare slots
}

void Bristles::end(VectorX& z) {
  first_.swap(next_);
  z.resize(size());
  for (std::size_t i = 0; i < stretches_.size(); ++i) z.segment<3>(3 * i) = stretches_[i];
}

}  // namespace sphshell
