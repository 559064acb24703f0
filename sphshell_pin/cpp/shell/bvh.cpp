#include "shell/bvh.hpp"

#include <coal/BVH/BVH_model.h>

#include <cmath>
#include <stdexcept>

namespace sphshell {

Bvh::Bvh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
         std::vector<int>& order) {
  // Built by Coal, and copied: boxes in single precision, about the middle, with both children's
  // boxes in one node.
  coal::BVHModel<coal::AABB> tree;
  coal::MatrixX3s points(vertices.size(), 3);
  for (std::size_t i = 0; i < vertices.size(); ++i) points.row(i) = vertices[i].transpose();
  coal::Matrixx3i corners(triangles.size(), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k)
      corners(t, k) = static_cast<coal::Matrixx3i::Scalar>(triangles[t][k]);
  tree.beginModel(static_cast<unsigned int>(triangles.size()),
                  static_cast<unsigned int>(vertices.size()));
  tree.addVertices(points);
  tree.addTriangles(corners);
  tree.endModel();

  const auto& all = tree.getBV(0).bv;
  origin_ = 0.5 * (all.min_ + all.max_);
  // Rounding a box to single precision, and the sphere's center when it is near the box, each err
  // by less than this.
  const double reach = (all.max_ - all.min_).cwiseAbs().maxCoeff();
  const float widen = static_cast<float>(4e-7 * reach);
  const auto store = [&](Node& node, int side, const coal::AABB& box) {
    for (int k = 0; k < 3; ++k) {
      node.low[side][k] = static_cast<float>(box.min_[k] - origin_[k]) - widen;
      node.high[side][k] = static_cast<float>(box.max_[k] - origin_[k]) + widen;
    }
  };
  store(root_, 0, all);

  // Subtrees of a few triangles become leaves: their triangles are tested faster than their boxes.
  const int count = static_cast<int>(tree.getNumBVs());
  const auto source = [&](int i) -> decltype(auto) {
    return tree.getBV(static_cast<unsigned int>(i));
  };
  std::vector<int> size(static_cast<std::size_t>(count), 1);
  for (int i = count - 1; i >= 0; --i)  // children stand behind their parent
    if (!source(i).isLeaf()) size[i] = size[source(i).leftChild()] + size[source(i).rightChild()];
  order.clear();
  order.reserve(triangles.size());
  std::vector<int> stack;
  // Appends the triangles of a subtree to `order`, from left to right.
  const auto make_leaf = [&](int root) {
    const int first = static_cast<int>(order.size());
    stack.assign(1, root);
    while (!stack.empty()) {
      const auto& node = source(stack.back());
      stack.pop_back();
      if (node.isLeaf()) {
        order.push_back(node.primitiveId());
      } else {
        stack.push_back(node.rightChild());
        stack.push_back(node.leftChild());
      }
    }
    return leaf(first, static_cast<int>(order.size()) - first);
  };
  if (size[0] <= kLeafSize) {
    root_.child[0] = make_leaf(0);
    return;
  }
  nodes_.reserve(triangles.size() / 2);
  struct Task {
    int source, parent, side, depth;
  };
  // Depth first with a stack of its own: degenerate trees are deep.
  std::vector<Task> tasks{{0, -1, 0, 0}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    int id;
    if (size[task.source] <= kLeafSize) {
      id = make_leaf(task.source);
    } else {
      // Walks have a stack of fixed size.
      if (task.depth + 2 >= kMaxDepth)
        throw std::length_error("the bounding-box tree of the shell is too deep");
      const auto& node = source(task.source);
      id = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
      store(nodes_[id], 0, source(node.leftChild()).bv);
      store(nodes_[id], 1, source(node.rightChild()).bv);
      tasks.push_back({node.rightChild(), id, 1, task.depth + 1});
      tasks.push_back({node.leftChild(), id, 0, task.depth + 1});
    }
    if (task.parent >= 0) nodes_[task.parent].child[task.side] = id;
  }
  nodes_.shrink_to_fit();
}

}  // namespace sphshell
