// k-d tree over points of the plane or of space: leaves hold a few, every node knows its box.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <vector>

namespace sphshell {

template <int D>
class PointTree {
 public:
  using Point = Eigen::Matrix<double, D, 1>;
  using Box = Eigen::AlignedBox<double, D>;

  PointTree() = default;

  // points (n, D), which must outlive the tree; members: indices of those it holds.
  PointTree(const double* points, std::vector<std::int32_t> members)
      : points_(points), members_(std::move(members)) {
    if (!members_.empty()) build(0, members_.size());
  }

  // Calls visit(member) for the points of every leaf whose own box and those above it meets(box)
  // holds for, until one returns true.
  template <typename Meets, typename Visit>
  void search(Meets meets, Visit visit) const {
    stack_.assign(nodes_.empty() ? 0 : 1, 0);
    while (!stack_.empty()) {
      const std::int32_t self = stack_.back();
      const Node& node = nodes_[static_cast<std::size_t>(self)];
      stack_.pop_back();
      if (!meets(node.box)) continue;
      if (node.right < 0) {
        for (std::size_t k = node.from; k < node.to; ++k)
          if (visit(members_[k])) return;
      } else {
        stack_.push_back(self + 1);
        stack_.push_back(node.right);
      }
    }
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
    for (std::size_t k = from; k < to; ++k) node.box.extend(at(members_[k]));
    nodes_.push_back(node);
    if (to - from <= 8) return;
    int widest;
    node.box.sizes().maxCoeff(&widest);
    const std::size_t middle = from + (to - from) / 2;
    const auto first = members_.begin();
    std::nth_element(first + std::ptrdiff_t(from), first + std::ptrdiff_t(middle),
                     first + std::ptrdiff_t(to),
                     [&](std::int32_t i, std::int32_t j) { return at(i)[widest] < at(j)[widest]; });
    build(from, middle);
    nodes_[self].right = static_cast<std::int32_t>(nodes_.size());
    build(middle, to);
  }

  Eigen::Map<const Point> at(std::int32_t member) const {
    return Eigen::Map<const Point>(points_ + D * std::size_t(member));
  }

  const double* points_ = nullptr;
  std::vector<std::int32_t> members_;
  std::vector<Node> nodes_;
  mutable std::vector<std::int32_t> stack_;
};

}  // namespace sphshell
