// Bounding-box tree over the triangles of a shell, divided at the mean of their middles along the
// longest side of their box.
#pragma once

#include <limits>

#include "shell/large_array.hpp"
#include "shell/topology.hpp"

namespace sphshell {

// Asks for a line of memory that is read soon; changes nothing else.
inline void prefetch(const void* address) {
#if defined(__GNUC__) || defined(__clang__)
  __builtin_prefetch(address);
#else
  (void)address;
#endif
}

// The same of all lines of an object.
template <class T>
void prefetch_all(const T& object) {
  for (std::size_t line = 0; line < sizeof(T); line += 64)
    prefetch(reinterpret_cast<const char*>(&object) + line);
}

// Axis-aligned boxes in single precision, rounded outward, about the middle of the shell.
class Bvh {
 public:
  // `order` receives the triangles in the order of the tree's leaves: store them so, and what the
  // walk visits together lies together in memory.
  Bvh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
      std::vector<int>& order);

  // Appends the positions in `order` of the triangles in all leaves whose box meets the ball. Never
  // misses one that meets it itself; adds its companions in the leaf. touch(first position) is
  // called as soon as a leaf is known, so that its memory can be on its way while the walk goes on.
  template <class Touch>
  void find_overlapping(const Vec3& center, double radius, std::vector<int>& out,
                        Touch&& touch) const {
    const Eigen::Vector3f c = (center - origin_).cast<float>();
    const float reach = float(radius) * 1.000001f;
    const float limit = reach * reach;
    walk([&](const Node& n, int side) { return distance2(n, side, c) <= limit; }, out, touch);
  }

  // The same of all leaves whose box comes below a plane, at `offset` along its unit normal.
  template <class Touch>
  void find_below(const Vec3& normal, double offset, std::vector<int>& out, Touch&& touch) const {
    const Eigen::Vector3f n = normal.cast<float>();
    const double local = offset - normal.dot(origin_);
    float size = 0;
    for (int k = 0; k < 3; ++k) size += root_.high[0][k] - root_.low[0][k];
    // A sum in single precision is off by less than this share of the numbers in it.
    const float limit = float(local + 1e-6 * (size + std::abs(local)));
    const auto comes_below = [&](const Node& node, int side) {
      float lowest = 0;
      for (int k = 0; k < 3; ++k)
        lowest += std::min(n[k] * node.low[side][k], n[k] * node.high[side][k]);
      return lowest <= limit;
    };
    walk(comes_below, out, touch);
  }

  // Calls visit(position) -> squared distance, nearest boxes first; returns when no box can hold
  // anything nearer than the least squared distance returned so far.
  template <class Visit>
  void nearest(const Vec3& point, Visit&& visit) const {
    const Vec3 local = point - origin_;
    const Eigen::Vector3f c = local.cast<float>();
    double best = std::numeric_limits<double>::infinity();
    const auto visit_leaf = [&](int leaf) {
      const int first = first_of(leaf), end = first + count_of(leaf);
      for (int i = first; i < end; ++i) best = std::min(best, visit(i));
    };
    if (nodes_.empty()) return visit_leaf(root_.child[0]);
    // Boxes are widened by the round-off at the surface, the point's own is added here.
    const double slack = 1e-6 * local.norm();
    struct Entry {
      int node;
      double bound;
    };
    Entry stack[kMaxDepth];
    int top = 0;
    stack[top++] = {0, 0.0};
    while (top > 0) {
      const Entry entry = stack[--top];
      if (entry.bound > best) continue;
      const Node& n = nodes_[entry.node];
      double bound[2];
      for (int side = 0; side < 2; ++side) {
        const double d = std::max(0.0, std::sqrt(double(distance2(n, side, c))) - slack);
        bound[side] = d * d;
      }
      const int near = bound[0] <= bound[1] ? 0 : 1;
      if (bound[near] <= best && n.child[near] < 0) visit_leaf(n.child[near]);
      if (bound[1 - near] <= best) {
        if (n.child[1 - near] < 0)
          visit_leaf(n.child[1 - near]);
        else
          stack[top++] = {n.child[1 - near], bound[1 - near]};
      }
      if (bound[near] <= best && n.child[near] >= 0) stack[top++] = {n.child[near], bound[near]};
    }
  }

  // False where no triangle meets the ball: the box of all of them does not.
  bool may_meet(const Vec3& center, double radius) const {
    const Eigen::Vector3f c = (center - origin_).cast<float>();
    const float reach = float(radius) * 1.000001f;
    return distance2(root_, 0, c) <= reach * reach;
  }

  const Vec3& origin() const { return origin_; }

 private:
  static constexpr int kMaxDepth = 1024;  // checked when the tree is built
  static constexpr int kLeafSize = 4;     // triangles in a leaf, at most

  // A leaf is stored as the complement of 8 * first position + count.
  static int leaf(int first, int count) { return ~(8 * first + count); }
  static int first_of(int leaf) { return ~leaf >> 3; }
  static int count_of(int leaf) { return ~leaf & 7; }

  // One cache line: the boxes of both children relative to origin_, rounded outward.
  struct alignas(64) Node {
    float low[2][3], high[2][3];
    int child[2];  // >= 0 a node, < 0 a leaf
  };

  template <class Meets, class Touch>
  void walk(Meets&& meets, std::vector<int>& out, Touch&& touch) const {
    if (!meets(root_, 0)) return;
    const auto take = [&](int leaf) {
      const int first = first_of(leaf), end = first + count_of(leaf);
      touch(first);
      for (int i = first; i < end; ++i) out.push_back(i);
    };
    if (nodes_.empty()) return take(root_.child[0]);
    int stack[kMaxDepth], top = 0, node = 0;
    for (;;) {
      const Node& n = nodes_[node];
      int next = -1;
      for (int side = 0; side < 2; ++side) {
        if (!meets(n, side)) continue;
        const int child = n.child[side];
        if (child < 0) {
          take(child);
        } else if (next < 0) {
          next = child;
        } else {
          prefetch(&nodes_[child]);
          stack[top++] = child;
        }
      }
      if (next >= 0)
        node = next;
      else if (top > 0)
        node = stack[--top];
      else
        return;
    }
  }

  // The square of the distance from c to a child's box, 0 inside.
  static float distance2(const Node& n, int side, const Eigen::Vector3f& c) {
    float sum = 0;
    for (int k = 0; k < 3; ++k) {
      const float d = std::max(std::max(n.low[side][k] - c[k], c[k] - n.high[side][k]), 0.0f);
      sum += d * d;
    }
    return sum;
  }

  Vec3 origin_;
  Node root_;  // side 0 holds the box of everything: a far sphere costs this one test
  LargeArray<Node> nodes_;
};

}  // namespace sphshell
