// Vertices that lie on the open edges of other polygons, found with a k-d tree.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "shell/mending.hpp"

namespace sphshell {
namespace {

// k-d tree over some of the points; leaves hold a few, every node knows its box.
class PointTree {
 public:
  PointTree(const double* points, const std::vector<std::int32_t>& members)
      : points_(points), members_(members) {
    if (!members_.empty()) build(0, members_.size());
  }

  // Calls visit(vertex) for every point whose node's box comes within `tolerance` of segment ab.
  template <typename Visit>
  void near_segment(const double* a, const double* b, double tolerance, Visit visit) const {
    if (nodes_.empty()) return;
    std::vector<std::int32_t>& stack = stack_;
    stack.assign(1, 0);
    while (!stack.empty()) {
      const Node& node = nodes_[stack.back()];
      const std::int32_t self = stack.back();
      stack.pop_back();
      if (!meets(node, a, b, tolerance)) continue;
      if (node.right < 0) {
        for (std::size_t k = node.from; k < node.to; ++k) visit(members_[k]);
      } else {
        stack.push_back(self + 1);
        stack.push_back(node.right);
      }
    }
  }

 private:
  struct Node {
    std::array<double, 3> low, high;
    std::size_t from, to;
    std::int32_t right;  // the left child follows its parent; -1 in a leaf
  };

  void build(std::size_t from, std::size_t to) {
    const auto self = static_cast<std::int32_t>(nodes_.size());
    Node node{{}, {}, from, to, -1};
    node.low.fill(std::numeric_limits<double>::infinity());
    node.high.fill(-std::numeric_limits<double>::infinity());
    for (std::size_t k = from; k < to; ++k) {
      for (int axis = 0; axis < 3; ++axis) {
        const double x = at(members_[k], axis);
        node.low[axis] = std::min(node.low[axis], x);
        node.high[axis] = std::max(node.high[axis], x);
      }
    }
    nodes_.push_back(node);
    if (to - from <= 8) return;
    int widest = 0;
    for (int axis = 1; axis < 3; ++axis) {
      if (node.high[axis] - node.low[axis] > node.high[widest] - node.low[widest]) widest = axis;
    }
    const std::size_t middle = from + (to - from) / 2;
    std::nth_element(members_.begin() + static_cast<std::ptrdiff_t>(from),
                     members_.begin() + static_cast<std::ptrdiff_t>(middle),
                     members_.begin() + static_cast<std::ptrdiff_t>(to),
                     [&](std::int32_t i, std::int32_t j) { return at(i, widest) < at(j, widest); });
    build(from, middle);
    nodes_[self].right = static_cast<std::int32_t>(nodes_.size());
    build(middle, to);
  }

  // Slab test of the segment against the box grown by the tolerance: never misses a point.
  static bool meets(const Node& node, const double* a, const double* b, double tolerance) {
    double enter = 0.0, leave = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
      const double low = node.low[axis] - tolerance, high = node.high[axis] + tolerance;
      const double d = b[axis] - a[axis];
      if (d == 0.0) {
        if (a[axis] < low || a[axis] > high) return false;
        continue;
      }
      const double one = (low - a[axis]) / d, two = (high - a[axis]) / d;
      enter = std::max(enter, std::min(one, two));
      leave = std::min(leave, std::max(one, two));
      // A little slack: the quotients carry rounding.
      if (enter > leave + 1e-9) return false;
    }
    return true;
  }

  double at(std::int32_t vertex, int axis) const {
    return points_[3 * static_cast<std::size_t>(vertex) + static_cast<std::size_t>(axis)];
  }

  const double* points_;
  std::vector<std::int32_t> members_;
  std::vector<Node> nodes_;
  mutable std::vector<std::int32_t> stack_;
};

}  // namespace

Insertions find_t_junctions(const PolygonView& polygons, const double* points,
                            const std::vector<std::int64_t>& open_slots,
                            const std::vector<std::int32_t>& open_polygons,
                            const std::vector<std::int32_t>& candidates, double tolerance) {
  Insertions out;
  const PointTree tree(points, candidates);
  struct Hit {
    double parameter;
    std::int32_t vertex;
  };
  std::vector<Hit> hits;
  for (std::size_t k = 0; k < open_slots.size(); ++k) {
    const auto polygon = static_cast<std::size_t>(open_polygons[k]);
    const std::int64_t from = polygons.offsets[polygon], to = polygons.offsets[polygon + 1];
    const std::int64_t slot = open_slots[k];
    const double* a = points + 3 * static_cast<std::size_t>(polygons.corners[slot]);
    const double* b =
        points + 3 * static_cast<std::size_t>(polygons.corners[polygons.next(polygon, slot)]);
    const std::array<double, 3> d{b[0] - a[0], b[1] - a[1], b[2] - a[2]};
    const double squared = d[0] * d[0] + d[1] * d[1] + d[2] * d[2];
    hits.clear();
    tree.near_segment(a, b, tolerance, [&](std::int32_t vertex) {
      const double* p = points + 3 * static_cast<std::size_t>(vertex);
      const std::array<double, 3> e{p[0] - a[0], p[1] - a[1], p[2] - a[2]};
      const double t = (e[0] * d[0] + e[1] * d[1] + e[2] * d[2]) / squared;
      if (!(t > 0.0 && t < 1.0)) return;
      const double off = std::hypot(e[0] - t * d[0], e[1] - t * d[1], e[2] - t * d[2]);
      if (off > tolerance) return;
      const std::int32_t* first = polygons.corners + from;
      const std::int32_t* last = polygons.corners + to;
      if (std::find(first, last, vertex) == last) hits.push_back({t, vertex});
    });
    std::sort(hits.begin(), hits.end(), [](const Hit& x, const Hit& y) {
      return x.parameter != y.parameter ? x.parameter < y.parameter : x.vertex < y.vertex;
    });
    for (const Hit& hit : hits) {
      out.slot.push_back(slot);
      out.vertex.push_back(hit.vertex);
      out.parameter.push_back(hit.parameter);
    }
  }
  return out;
}

}  // namespace sphshell
