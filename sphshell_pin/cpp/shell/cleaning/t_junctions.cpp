// Vertices that lie on the open edges of other polygons, found with a k-d tree.

#include "shell/cleaning/mending.hpp"
#include "shell/point_tree.hpp"

namespace sphshell {

// Slab test of the segment against the box grown by the tolerance: never misses a point.
static bool meets(const PointTree<3>::Box& box, const Vec3& a, const Vec3& b, double tolerance) {
  double enter = 0.0, leave = 1.0;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = box.min()[axis] - tolerance, high = box.max()[axis] + tolerance;
    const double d = b[axis] - a[axis];
    if (d == 0.0) {
      if (a[axis] < low || a[axis] > high) return false;
      continue;
    }
    // Where the line enters and leaves the slab of this axis.
    const double one = (low - a[axis]) / d, two = (high - a[axis]) / d;
    enter = std::max(enter, std::min(one, two));
    leave = std::min(leave, std::max(one, two));
    // A little slack: the quotients carry rounding.
    if (enter > leave + 1e-9) return false;
  }
  return true;
}

Insertions find_t_junctions(const PolygonView& polygons, Points points,
                            Rows<std::int64_t> open_slots, Indices open_polygons,
                            Indices candidates, double tolerance, std::size_t most) {
  Insertions out;
  const std::size_t n = candidates.count;
  const PointTree<3> tree(points.data, {candidates.data, candidates.data + n});
  struct Hit {
    double parameter;
    std::int32_t vertex;
  };
  std::vector<Hit> hits;
  // Per vertex the last polygon that has it as a corner.
  std::vector<std::int32_t> owner(n == 0 ? 0 : candidates[n - 1] + 1, -1);
  for (std::size_t k = 0; k < open_slots.count && out.slot.size() <= most; ++k) {
    const auto polygon = static_cast<std::size_t>(open_polygons[k]);
    const std::int64_t from = polygons.offsets[polygon], to = polygons.offsets[polygon + 1];
    const std::int64_t slot = open_slots[k];
    if (k == 0 || open_polygons[k] != open_polygons[k - 1]) {
      for (std::int64_t s = from; s < to; ++s) {
        const auto corner = static_cast<std::size_t>(polygons.corners[s]);
        // A polygon's own corners are no T-junctions on its edges.
        if (corner < owner.size()) owner[corner] = open_polygons[k];
      }
    }
    const Vec3 a = place(points, polygons.corners[slot]);
    const Vec3 b = place(points, polygons.corners[polygons.next(polygon, slot)]), d = b - a;
    hits.clear();
    const auto near = [&](const PointTree<3>::Box& box) { return meets(box, a, b, tolerance); };
    tree.search(near, [&](std::int32_t vertex) {
      if (owner[static_cast<std::size_t>(vertex)] == open_polygons[k]) return false;
      const Vec3 e = place(points, vertex) - a;
      const double t = e.dot(d) / d.squaredNorm();
      if (t > 0.0 && t < 1.0 && (e - t * d).norm() <= tolerance) hits.push_back({t, vertex});
      // More than `most` are not wanted: the search ends.
      return out.slot.size() + hits.size() > most;
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
