// k-d tree over points of the plane or of space: leaves hold a few, every node knows its box.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

namespace sphshell {

template <int D>
class PointTree {
 public:
  using Point = std::array<double, D>;
  struct Box {
    Point low, high;
  };

  PointTree() = default;

  // points (n, D), which must outlive the tree; members: indices of those it holds.
  PointTree(const double* points, std::vector<std::int32_t> members)
      : points_(points), members_(std::move(members)) {
    if (!members_.empty()) build(0, members_.size());
  }

  std::size_t size() const { return members_.size(); }

  // Calls visit(member) for the points of every leaf whose own box and those above it meets(box)
  // holds for, until one returns true. `turn` varies which child comes first.
  template <typename Meets, typename Visit>
  bool search(Meets meets, Visit visit, std::uint32_t turn = 0) const {
    if (nodes_.empty()) return false;
    stack_.assign(1, 0);
    while (!stack_.empty()) {
      const std::int32_t self = stack_.back();
      const Node& node = nodes_[static_cast<std::size_t>(self)];
      stack_.pop_back();
      if (!meets(node.box)) continue;
      if (node.right < 0) {
        for (std::size_t k = node.from; k < node.to; ++k)
          if (visit(members_[k])) return true;
      } else {
        std::int32_t first = self + 1, second = node.right;
        turn = turn * 1664525U + 1013904223U;  // the linear congruence of Numerical Recipes
        if (turn >> 31) std::swap(first, second);
        stack_.push_back(first);
        stack_.push_back(second);
      }
    }
    return false;
  }

 private:
  // from, to: the members in the node's subtree.
  struct Node {
    Box box;
    std::size_t from, to;
    std::int32_t right;  // the left child follows its parent; -1 in a leaf
  };

  // Halved at the median along the widest side of the box.
  void build(std::size_t from, std::size_t to) {
    const std::size_t self = nodes_.size();
    Node node{{}, from, to, -1};
    node.box.low.fill(std::numeric_limits<double>::infinity());
    node.box.high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t k = from; k < to; ++k) {
      for (int axis = 0; axis < D; ++axis) {
        const double x = at(members_[k], axis);
        node.box.low[axis] = std::min(node.box.low[axis], x);
        node.box.high[axis] = std::max(node.box.high[axis], x);
      }
    }
    nodes_.push_back(node);
    if (to - from <= 8) return;
    int widest = 0;
    for (int axis = 1; axis < D; ++axis)
      if (node.box.high[axis] - node.box.low[axis] > node.box.high[widest] - node.box.low[widest])
        widest = axis;
    const std::size_t middle = from + (to - from) / 2;
    std::nth_element(members_.begin() + static_cast<std::ptrdiff_t>(from),
                     members_.begin() + static_cast<std::ptrdiff_t>(middle),
                     members_.begin() + static_cast<std::ptrdiff_t>(to),
                     [&](std::int32_t i, std::int32_t j) { return at(i, widest) < at(j, widest); });
    build(from, middle);
    nodes_[self].right = static_cast<std::int32_t>(nodes_.size());
    build(middle, to);
  }

  double at(std::int32_t member, int axis) const {
    return points_[D * static_cast<std::size_t>(member) + static_cast<std::size_t>(axis)];
  }

  const double* points_ = nullptr;
  std::vector<std::int32_t> members_;
  std::vector<Node> nodes_;
  mutable std::vector<std::int32_t> stack_;
};

}  // namespace sphshell
