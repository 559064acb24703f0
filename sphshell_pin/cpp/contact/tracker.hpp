// Which contact goes on from which, from one accepted step to the next.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "contact/query.hpp"

namespace sphshell {

// Contacts keep their number while they move over elements and smooth edges, in the shell's frame,
// and while they move less in a step than the radius of their contact disc, sqrt(r^2 - (r - d)^2).
class ContactTracker {
 public:
  ContactTracker() {
    for (auto* list : {&known_, &next_}) list->reserve(64);
    links_.reserve(256);
  }

  // Numbers beside the contacts; radius 0: of no sphere, any distance is near.
  const std::vector<int>& follow(const std::vector<Contact>& contacts, double radius) {
    next_.clear();
    for (const Contact& c : contacts)
      next_.push_back({c.point, reach(c, radius), c.weight < 0, -1});
    links_.clear();
    for (std::size_t i = 0; i < known_.size(); ++i)
      for (std::size_t j = 0; j < next_.size(); ++j) {
        const double apart = (known_[i].point - next_[j].point).norm();
        if (known_[i].pass == next_[j].pass && apart < std::max(known_[i].reach, next_[j].reach))
          links_.push_back({apart, static_cast<int>(i), static_cast<int>(j)});
      }
    // Nearest first, each once.
    std::sort(links_.begin(), links_.end(), [](const Link& a, const Link& b) {
      return a.apart != b.apart ? a.apart < b.apart
             : a.from != b.from ? a.from < b.from
                                : a.to < b.to;
    });
    for (const Link& link : links_) {
      Place &from = known_[link.from], &to = next_[link.to];
      if (from.number < 0 || to.number >= 0) continue;
      to.number = from.number;
      from.number = -1;
    }
    numbers_.clear();
    for (Place& place : next_) {
      if (place.number < 0) place.number = count_++;
      numbers_.push_back(place.number);
    }
    known_.swap(next_);
    return numbers_;
  }

 private:
  struct Place {
    Vec3 point;
    double reach;
    bool pass;
    int number;
  };
  struct Link {
    double apart;
    int from, to;
  };

  static double reach(const Contact& contact, double radius) {
    if (radius == 0) return std::numeric_limits<double>::infinity();
    const double distance = radius - contact.depth;
    return std::sqrt(std::max(0.0, radius * radius - distance * distance));
  }

  std::vector<Place> known_, next_;
  std::vector<Link> links_;
  std::vector<int> numbers_;
  int count_ = 0;
};

}  // namespace sphshell
