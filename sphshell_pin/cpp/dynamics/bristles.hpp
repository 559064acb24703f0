// Which slot of the state holds the stretch of each contact's bristle, and what becomes of it when
// contacts begin, end, split and merge.
#pragma once

#include <vector>

#include "contact/tracker.hpp"
#include "dynamics/multibody.hpp"

namespace sphshell {

// Slots of 3 numbers each, in the order of the pairs and of the places of their contacts; behind
// the known contacts of a pair are spare ones, for contacts that begin within a step.
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
  bool is_spare(std::size_t k, int slot) const { return slot >= first_[k + 1] - kSpare; }

  // At an accepted state all slots are assigned anew: begin(), then each pair in its order, then
  // end(), which puts the stretches z in that order.
  void begin() { stretches_.clear(), next_[0] = 0; }
  void assign_none(std::size_t k);
  // `turned`: the stretches have followed their normals already.
  void assign(std::size_t k, const std::vector<Contact>& contacts, const std::vector<int>& at,
              const ContactTracker& tracker, const VectorX& z, bool torsional, bool turned);
  void end(VectorX& z);

 private:
  static constexpr int kSpare = 4;

  Vec3 stretch(std::size_t k, int place, const VectorX& z) const;

  std::vector<int> first_, next_;  // of each pair, and behind the last
  std::vector<Vec3> stretches_;
  std::vector<char> has_;
  std::vector<int> used_;
};

}  // namespace sphshell
