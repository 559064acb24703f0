// Union-find whose root is always the lowest index of its set.
#pragma once

#include <cstddef>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

namespace sphshell {

// Numbers from 0 to count - 1, each a set of its own at first.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) {
    std::iota(parent_.begin(), parent_.end(), 0);
  }

  // Path halving.
  std::int32_t find(std::int32_t i) {
    while (parent_[i] != i) {
      parent_[i] = parent_[parent_[i]];
      i = parent_[i];
    }
    return i;
  }

  // The lower root stays, so that results do not depend on the order of merges.
  void merge(std::int32_t a, std::int32_t b) {
    a = find(a);
    b = find(b);
    if (a > b) std::swap(a, b);
    parent_[b] = a;
  }

  // Per member the number of its set: consecutive, in the order of first appearance. To be called
  // last: the numbers take the place of the sets.
  std::vector<std::int32_t> labels() {
    // Parents are lower than their children.
    for (std::int32_t i = 0; i < static_cast<std::int32_t>(parent_.size()); ++i)
      parent_[i] = parent_[i] == i ? count_++ : parent_[parent_[i]];
    return std::move(parent_);
  }
  // How many sets labels() found.
  std::int32_t count() const { return count_; }

 private:
  std::vector<std::int32_t> parent_;
  std::int32_t count_ = 0;
};

}  // namespace sphshell
