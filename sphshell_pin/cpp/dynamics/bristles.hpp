// Where in the state the stretch of each contact's bristle stands, and what becomes of it when
// contacts come, go, part and flow together.
#pragma once

#include <vector>

#include "contact/tracker.hpp"
#include "dynamics/multibody.hpp"

namespace sphshell {

// Slots of 3 numbers each, in the order of the pairs and of the places of their contacts; behind
// the known contacts of a pair some are spare, for those that a step meets on its way.
class Bristles {
 public:
  explicit Bristles(std::size_t pairs)
      : first_(pairs + 1, 0), next_(pairs + 1, 0), has_(pairs, 0) {}

  // Pair k has bristles from now on.
  void add(std::size_t k);
  bool any() const { return first_.back() > 0; }
  int size() const { return 3 * first_.back(); }
  // Of the contact at this place of pair k, or -1.
  int slot(std::size_t k, int place) const {
    const int slot = first_[k] + place;
    return slot < first_[k + 1] ? slot : -1;
  }

  // Deals the slots anew at an accepted state, pair after pair, from the stretches in z.
  void begin() { dealt_.clear(), next_[0] = 0; }
  void deal_none(std::size_t k);
  // `turned`: the stretches have followed their normals already.
  void deal(std::size_t k, const std::vector<Contact>& contacts, const std::vector<int>& at,
            const ContactTracker& tracker, const VectorX& z, bool torsional, bool turned);
  void end(VectorX& z);

 private:
  Vec3 stretch(std::size_t k, int place, const VectorX& z) const;

  std::vector<int> first_, next_;  // of each pair, and behind the last
  std::vector<Vec3> dealt_;
  std::vector<char> has_;
  std::vector<int> used_;
};

}  // namespace sphshell
