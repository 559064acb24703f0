#include "contact/query/tracker.hpp"

namespace sphshell {

// The center can pass a sheet within a step only from deeper than this share of the radius: a step
// moves it by a quarter of the radius at most.
constexpr double kDeep = 0.5;

// Longer lists, which only a contact source gives, go on by their order: all pairs would be too
// many.
constexpr std::size_t kLongest = 1000;

ContactTracker::ContactTracker() {
  for (auto* list : {&places_, &next_}) list->reserve(64);
  pairings_.reserve(256);
  at_.reserve(64);
}

// Pythagoras: the circle in which a plane at that depth cuts the sphere.
double ContactTracker::disc(double depth, double radius) {
  if (radius == 0) return std::numeric_limits<double>::infinity();
  const double distance = radius - depth;
  return std::sqrt(std::max(0.0, radius * radius - distance * distance));
}

ContactTracker::Place ContactTracker::place_of(const Contact& c, double radius, int number) {
  return {c.point,      c.normal, c.depth,   disc(c.depth, radius),
          c.weight < 0, c.rim,    c.feature, number};
}

const std::vector<int>& ContactTracker::match(std::vector<Contact>& contacts, const Vec3& center,
                                              double radius) {
  at_.assign(contacts.size(), -1);
  pushed_through_ = false;
  // On a concave surface a contact moves farther than the center.
  const double moved = 4 * (center - center_).norm();
  pairings_.clear();
  const bool by_order = radius == 0 && std::max(places_.size(), contacts.size()) > kLongest;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    places_[i].taken = false;
    if (by_order) {
      if (i < contacts.size()) pairings_.push_back({0, static_cast<int>(i), static_cast<int>(i)});
      continue;
    }
    for (std::size_t j = 0; j < contacts.size(); ++j) {
      const Contact& c = contacts[j];
      // A minimum does not go on as a saddle.
      if (places_[i].saddle != (c.weight < 0)) continue;
      const double apart = (places_[i].point - c.point).norm();
      if (apart < std::max({places_[i].reach, disc(c.depth, radius), moved}))
        pairings_.push_back({apart, static_cast<int>(i), static_cast<int>(j)});
    }
  }
  // Nearest first, each once.
  std::sort(pairings_.begin(), pairings_.end(), [](const Pairing& a, const Pairing& b) {
    return a.apart != b.apart ? a.apart < b.apart
           : a.from != b.from ? a.from < b.from
                              : a.to < b.to;
  });
  for (const Pairing& pairing : pairings_) {
    Place& place = places_[pairing.from];
    if (place.taken || at_[pairing.to] >= 0) continue;
    place.taken = true;
    at_[pairing.to] = pairing.from;
    // What a stage met on its way says nothing of the side.
    if (pairing.from < static_cast<int>(known_)) keep_side(contacts[pairing.to], place, radius);
  }
  for (std::size_t j = 0; j < contacts.size(); ++j) {
    // A new contact. It is known to later stages of the step, and forgotten by restart().
    if (at_[j] >= 0) continue;
    at_[j] = static_cast<int>(places_.size());
    places_.push_back(place_of(contacts[j], radius, count_++));
  }
  return at_;
}

// Turns the contact back where the normal has flipped although the sphere was deep: then its center
// has passed through the sheet, and the nearest point lies on the far side.
void ContactTracker::keep_side(Contact& c, const Place& place, double radius) {
  if (radius == 0 || place.depth < kDeep * radius || c.normal.dot(place.normal) >= 0) return;
  // Round a border the normal may turn by any angle in a step, and comes to no other side; nor does
  // it round the edge of a thin body.
  const bool on_faces = c.feature == Feature::Face && place.feature == Feature::Face;
  if (c.rim || place.rim || (place.depth <= radius && !on_faces)) return;
  c.normal = -c.normal;
  c.depth = 2 * radius - c.depth;
  c.dn_dc = -c.dn_dc;
  pushed_through_ = true;
}

// The numbers of contacts that went on stay; those of contacts that are gone are never given again.
void ContactTracker::accept(const std::vector<Contact>& contacts, const Vec3& center,
                            double radius) {
  next_.clear();
  deep_ = false;
  for (std::size_t j = 0; j < contacts.size(); ++j) {
    next_.push_back(place_of(contacts[j], radius, places_[at_[j]].number));
    deep_ = deep_ || (radius > 0 && contacts[j].depth > kDeep * radius);
  }
  places_.swap(next_);
  known_ = places_.size();
  next_number_ = count_;
  center_ = center;
}

void ContactTracker::restore(std::vector<Place> places, std::size_t known, const Vec3& center,
                             int next_number, double radius) {
  places_ = std::move(places);
  known_ = known;
  center_ = center;
  next_number_ = next_number;
  count_ = next_number + static_cast<int>(places_.size() - known);
  pushed_through_ = deep_ = false;
  for (std::size_t i = 0; i < places_.size(); ++i) {
    places_[i].reach = disc(places_[i].depth, radius);
    deep_ = deep_ || (i < known && radius > 0 && places_[i].depth > kDeep * radius);
  }
}

}  // namespace sphshell
