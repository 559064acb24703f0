// Over which feature of a triangle a sphere's center stands.
#pragma once

#include "shell/shell.hpp"

namespace sphshell {

// Position of the sphere's center against side k of a facet, in the facet's plane.
struct SideTest {
  bool beyond;                   // outside the side by more than round-off
  bool not_within;               // outside it, round-off included
  bool before, after;            // past the side's first, second end (round-off included)
  bool past_first, past_second;  // ... by more than round-off
  double t;                      // closest point along the side, 0 to 1
};

// The sums are left multiplied by the side's length, and compared squared: no root and no division
// is needed. tolerance2: square of the round-off of a coordinate [m^2].
inline SideTest test_side(const Facet& facet, int k, const Vec3& center, double tolerance2) {
  const Vec3 edge = facet.side(k);
  const Vec3 from = center - facet.corner[k];
  const double length2 = edge.squaredNorm();
  const double slack2 = tolerance2 * length2;
  const double inward = facet.normal.dot(edge.cross(from));
  const double along = from.dot(edge), left = length2 - along;
  SideTest out;
  const bool near_line = inward * inward <= slack2;
  out.beyond = inward < 0 && !near_line;
  out.not_within = inward <= 0 || near_line;
  out.past_first = along < 0 && along * along > slack2;
  out.past_second = left < 0 && left * left > slack2;
  out.before = along <= 0 || along * along <= slack2;
  out.after = left <= 0 || left * left <= slack2;
  out.t = std::clamp(along / length2, 0.0, 1.0);
  return out;
}

// `code` of a facet's side: kBoundary, the other half-edge, or, below kManifold, an edge of more
// than two triangles, all of which are asked.
inline bool edge_is_minimum(const Shell& shell, int code, const Vec3& center, double tolerance2) {
  if (code == kBoundary) return true;
  // The distance to a facet does not fall when one leaves its side inward.
  const auto holds = [&](int h) {
    return test_side(shell.facets()[triangle_of(h)], side_of(h), center, tolerance2).not_within;
  };
  if (code >= 0) return holds(code);
  const std::vector<int>& all = shell.half_edges_of(kManifold - code);
  return std::all_of(all.begin(), all.end(), holds);
}

// True where the distance does not fall along the edge from one vertex to another.
inline bool rises_along(const Vec3& edge, const Vec3& from, double tolerance) {
  const double along = from.dot(edge);
  return !(along > 0 && along * along > tolerance * tolerance * edge.squaredNorm());
}

// The center is in the normal cone of the vertex: the polar cone of the edges that leave it.
inline bool vertex_is_minimum(const Shell& shell, int vertex, const Vec3& center,
                              double tolerance) {
  const std::vector<Vec3>& p = shell.vertices();
  const Topology& topology = shell.topology();
  const Vec3 from = center - p[vertex];
  for (int i = topology.neighbor_begin[vertex]; i < topology.neighbor_begin[vertex + 1]; ++i)
    if (!rises_along(p[topology.neighbors[i]] - p[vertex], from, tolerance)) return false;
  return true;
}

// The same among the triangles of one fan (corners 3 triangle + k) alone.
inline bool fan_is_minimum(const Shell& shell, const std::vector<int>& fan, const Vec3& center,
                           double tolerance) {
  return std::all_of(fan.begin(), fan.end(), [&](int c) {
    const Vec3 &at = shell.point(c), from = center - at;
    return rises_along(shell.along(c), from, tolerance) &&
           rises_along(shell.point(corner_before(c)) - at, from, tolerance);
  });
}

}  // namespace sphshell
