#include "shell/bvh.hpp"

#include <functional>
#include <numeric>
#include <stdexcept>

namespace sphshell {

Bvh::Bvh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
         std::vector<int>& order) {
  using Box = Eigen::AlignedBox3d;
  const Box all = bounds(vertices, triangles);
  origin_ = 0.5 * (all.min() + all.max());
  // Rounding a box to single precision, and the sphere's center when it is near the box, each err
  // by less than this.
  const float widen = static_cast<float>(4e-7 * all.sizes().maxCoeff());
  const auto store = [&](Node& node, int side, const Box& box) {
    for (int k = 0; k < 3; ++k) {
      node.low[side][k] = static_cast<float>(box.min()[k] - origin_[k]) - widen;
      node.high[side][k] = static_cast<float>(box.max()[k] - origin_[k]) + widen;
    }
  };
  store(root_, 0, all);
  order.resize(triangles.size());
  std::iota(order.begin(), order.end(), 0);

  // Divides triangles by the mean of their middles, along the longest side of their box; in halves
  // where they have the same one. How many come first, and the boxes of both parts.
  const auto divide = [&](int first, int count, const Box& box, Box(&part)[2]) {
    int* const here = order.data() + first;
    const Vec3 size = box.sizes();
    const int axis = size[0] >= size[1] && size[0] >= size[2] ? 0 : size[1] >= size[2] ? 1 : 2;
    // Three times the middle.
    const auto middle = [&](const Triangle& t) {
      return vertices[t[0]][axis] + vertices[t[1]][axis] + vertices[t[2]][axis];
    };
    double sum = 0;
    for (int i = 0; i < count; ++i) sum += middle(triangles[here[i]]);
    const double mean = sum / 3 / count;
    part[0].setEmpty(), part[1].setEmpty();
    int left = 0;
    for (int i = 0; i < count; ++i) {
      const Triangle& t = triangles[here[i]];
      const bool right = middle(t) / 3 > mean;
      for (const int v : t) part[right].extend(vertices[v]);
      if (!right) std::swap(here[i], here[left++]);
    }
    if (left > 0 && left < count) return left;
    left = count / 2;
    part[0].setEmpty(), part[1].setEmpty();
    for (int i = 0; i < count; ++i)
      for (const int v : triangles[here[i]]) part[i >= left].extend(vertices[v]);
    return left;
  };
  // A few triangles become a leaf, as they are tested faster than their boxes, but are divided all
  // the same: what is near then lies side by side in memory. Walks have a stack of fixed size, and
  // so has this function.
  const std::function<int(int, int, const Box&, int)> add = [&](int first, int count,
                                                                const Box& box, int depth) {
    if (depth + 1 >= kMaxDepth)
      throw std::length_error("the bounding-box tree of the shell is too deep");
    const bool is_node = count > kLeafSize;
    const int id = is_node ? static_cast<int>(nodes_.size()) : leaf(first, count);
    if (is_node) nodes_.emplace_back();
    if (count < 2) return id;
    Box part[2];
    const int left = divide(first, count, box, part);
    for (int side = 0; side < 2; ++side) {
      const int added = add(first + side * left, side ? count - left : left, part[side], depth + 1);
      if (is_node) store(nodes_[id], side, part[side]), nodes_[id].child[side] = added;
    }
    return id;
  };
  nodes_.reserve(order.size() > kLeafSize ? order.size() / 2 : 0);
  root_.child[0] = add(0, static_cast<int>(order.size()), all, 0);
  nodes_.shrink_to_fit();
}

}  // namespace sphshell
