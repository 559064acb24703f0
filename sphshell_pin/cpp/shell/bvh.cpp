#include "shell/bvh.hpp"

#include <coal/BVH/BVH_model.h>

#include <functional>
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
  // From left to right; walks have a stack of fixed size, and so have these functions.
  const std::function<void(int)> add_triangles = [&](int at) {
    const auto& node = source(at);
    if (node.isLeaf()) return order.push_back(node.primitiveId());
    add_triangles(node.leftChild()), add_triangles(node.rightChild());
  };
  const std::function<int(int, int)> add = [&](int at, int depth) {
    if (size[at] <= kLeafSize) {
      add_triangles(at);
      return leaf(static_cast<int>(order.size()) - size[at], size[at]);
    }
    if (depth + 2 >= kMaxDepth)
      throw std::length_error("the bounding-box tree of the shell is too deep");
    const auto& node = source(at);
    const int id = static_cast<int>(nodes_.size()),
              child[2] = {node.leftChild(), node.rightChild()};
    nodes_.emplace_back();
    for (int side = 0; side < 2; ++side) {
      store(nodes_[id], side, source(child[side]).bv);
      const int added = add(child[side], depth + 1);
      nodes_[id].child[side] = added;
    }
    return id;
  };
  nodes_.reserve(size[0] > kLeafSize ? triangles.size() / 2 : 0);
  root_.child[0] = add(0, 0);
  nodes_.shrink_to_fit();
}

}  // namespace sphshell
