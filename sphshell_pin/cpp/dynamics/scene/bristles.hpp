// Which slot of the state holds the stretch of each contact's bristle, and what becomes of it when
// contacts begin, end, split and merge.
#pragma once

#include "contact/query/tracker.hpp"
#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// Slots of 3 numbers each, in the order of the pairs and of the places of their contacts, of a
// bristle of several rings as many slots one behind the other; behind the known contacts of a group
// of pairs are spare ones, for contacts that begin within a step.
class Bristles {
 public:
  // The number of each pair's group; pairs of a group stand together.
  explicit Bristles(std::vector<int> groups);

  // Pair k has bristles of so many rings from now on.
  void add(std::size_t k, int rings);
  bool any() const { return size_ > 0; }
  int size() const { return 3 * size_; }
  // The first of the contact at this place of pair k, or -1: the contacts of a group that begin
  // first in a step get its spare slots.
  int slot(std::size_t k, int place);
  bool is_spare(std::size_t k, int slot) const { return slot >= pools_[groups_[k]].first; }
  // The slots of so many known contacts of each pair, and none else.
  void restore(const std::vector<std::size_t>& contacts);
  // Forgets which contacts have begun since the accepted state.
  void restart();

  // At an accepted state all slots are assigned anew: begin(), then each pair in its order, then
  // end(), which puts the stretches z in that order.
  void begin() { stretches_.clear(); }
  // Of a pair without contacts, or without bristles.
  void assign_none(std::size_t k);
  // `turned`: the stretches have followed their normals already.
  void assign(std::size_t k, const std::vector<Contact>& contacts, const std::vector<int>& at,
              const ContactTracker& tracker, const VectorX& z, bool torsional, bool turned);
  void end(VectorX& z);

 private:
  static constexpr int kSpare = 4, kMostSpare = 16;  // of a pair, of a group

  // The slots of a pair's known contacts.
  struct Known {
    int first = 0, count = 0;  // slot, contacts
  };
  // The spare slots of a group, and, where it is of several pairs, who has taken them.
  struct Pool {
    int first = 0, count = 0, rings = 1;  // slot, contacts, slots of each
    bool shared = false;
    std::vector<std::pair<std::size_t, int>> taken;  // pair, place
  };

  // That of a contact in z, zero where it has no slot.
  Vec3 stretch(std::size_t k, int place, int ring, const VectorX& z);
  // Ends the slots of pair k.
  void close(std::size_t k, std::size_t begin);

  std::vector<int> groups_;
  std::vector<Known> known_;
  std::vector<Pool> pools_;
  int size_ = 0;  // slots
  std::vector<Vec3> stretches_;
  std::vector<int> rings_;  // of each pair; 0: it has no bristles
  std::vector<int> used_;
};

}  // namespace sphshell
