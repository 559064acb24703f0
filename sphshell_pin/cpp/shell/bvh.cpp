#include "shell/bvh.hpp"

#include <coal/BVH/BVH_model.h>

#include <cmath>
#include <stdexcept>

namespace sphshell {

Bvh::Bvh(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
         std::vector<int>& order) {
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
  // Rounding a box to single precision, and the sphere's centre when it is near the box, each err
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
  order.clear();
  order.reserve(triangles.size());
  if (triangles.size() == 1) {
    order.push_back(0);
    return;
  }

  nodes_.reserve(triangles.size() - 1);
  struct Task {
    int source, parent, side, depth;
  };
  std::vector<Task> tasks{{0, -1, 0, 0}};
  while (!tasks.empty()) {
    const Task task = tasks.back();
    tasks.pop_back();
    const auto& source = tree.getBV(static_cast<unsigned int>(task.source));
    int id;
    if (source.isLeaf()) {
      id = ~static_cast<int>(order.size());
      order.push_back(source.primitiveId());
    } else {
      if (task.depth + 2 >= kMaxDepth)
        throw std::length_error("the bounding-box tree of the shell is too deep");
      id = static_cast<int>(nodes_.size());
      nodes_.emplace_back();
      store(nodes_[id], 0, tree.getBV(static_cast<unsigned int>(source.leftChild())).bv);
      store(nodes_[id], 1, tree.getBV(static_cast<unsigned int>(source.rightChild())).bv);
      tasks.push_back({source.rightChild(), id, 1, task.depth + 1});
      tasks.push_back({source.leftChild(), id, 0, task.depth + 1});
    }
    if (task.parent >= 0) nodes_[task.parent].child[task.side] = id;
  }
}

}  // namespace sphshell
