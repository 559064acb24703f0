// Corners and sides of curved elements, by facets: corner 3 facet + k, half-edge 3 facet + side.
#pragma once

#include "shell/curved/curved.hpp"

namespace sphshell {

// The unit normal x_u x x_v; where two sides go on into each other at their corner, that of a point
// next to it.
inline Vec3 normal_of(const CubicPatch& patch, double u, double v) {
  const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v), n = xu.cross(xv);
  if (n.squaredNorm() > 1e-16 * xu.squaredNorm() * xv.squaredNorm()) return n.normalized();
  // Moved towards the middle of the element by a thousandth.
  const double a = u + 1e-3 * (1.0 / 3 - u), b = v + 1e-3 * (1.0 / 3 - v);
  return patch.along_u(a, b).cross(patch.along_v(a, b)).normalized();
}

// (0, 0), (1, 0), (0, 1).
inline std::pair<double, double> corner_parameters(int k) {
  return {k == 1 ? 1.0 : 0.0, k == 2 ? 1.0 : 0.0};
}

// Whether two unit normals are one: those of a smooth vertex agree to round-off.
inline bool is_one_normal(const Vec3& a, const Vec3& b) { return a.dot(b) > 1 - 1e-10; }

// Whether surfaces with these unit normals go on into each other, by less than 3 degrees: tangent
// joints of CAD are off by up to a degree, and curved elements leave small angles too.
inline bool is_smooth(const Vec3& a, const Vec3& b) { return a.dot(b) > 0.99863; }

// The vertex at a corner.
inline int vertex_of(const Shell& shell, int corner) {
  return shell.vertex(shell.half_edge(corner));
}

// The normal of an element at its corner.
inline Vec3 normal_at(const Shell& shell, int corner) {
  const auto [u, v] = corner_parameters(corner % 3);
  const int facet = corner / 3;
  return normal_of(shell.curved()->facets()[facet].patch(shell.facets()[facet]), u, v);
}

// The edge that a facet's side is.
inline const Edge& edge_at(const Shell& shell, int facet, int side) {
  return shell.topology().edge_at(shell.half_edge(3 * facet + side));
}

// The corner at a vertex of the element that a half-edge belongs to.
inline int corner_of(const Shell& shell, int half_edge, int vertex) {
  const int first = 3 * triangle_of(half_edge);
  for (int corner = first; corner < first + 3; ++corner)
    if (vertex_of(shell, corner) == vertex) return corner;
  return -1;
}

// Calls visit(other) for the corners at the same vertex of the elements beside a corner's.
template <class Visit>
void for_each_beside(const Shell& shell, int corner, Visit&& visit) {
  const Topology& topology = shell.topology();
  const int vertex = vertex_of(shell, corner);
  for (int side : {corner % 3, previous_corner(corner % 3)}) {
    const Edge& edge = edge_at(shell, corner / 3, side);
    for (int n = 0; n < edge.count; ++n) {
      const int h = shell.facet_half_edge(topology.incidence[edge.begin + n]);
      if (triangle_of(h) != corner / 3) visit(corner_of(shell, h, vertex), edge);
    }
  }
}

// The corners at the same vertex that a first one leads to, breadth first, from element to element
// where joins(corner, other, edge).
template <class Joins>
void connected_corners(const Shell& shell, int first, std::vector<int>& out, Joins&& joins) {
  out.assign(1, first);
  for (std::size_t i = 0; i < out.size(); ++i) {
    const int c = out[i];
    for_each_beside(shell, c, [&](int other, const Edge& edge) {
      if (std::find(out.begin(), out.end(), other) == out.end() && joins(c, other, edge))
        out.push_back(other);
    });
  }
}

// The half-edge, given in facets, of the neighbor that a facet goes on into over a side; -1: none.
inline int smooth_over(const Shell& shell, int facet, int side) {
  const int h = shell.topology().other_half_edge(shell.half_edge(3 * facet + side));
  if (h < 0) return -1;
  const int other = shell.facet_half_edge(h);
  for (int corner : {3 * facet + side, 3 * facet + next_corner(side)})
    if (!is_smooth(normal_at(shell, corner),
                   normal_at(shell, corner_of(shell, other, vertex_of(shell, corner)))))
      return -1;
  return other;
}

}  // namespace sphshell
