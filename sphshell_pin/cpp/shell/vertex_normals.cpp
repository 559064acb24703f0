#include "shell/vertex_normals.hpp"

#include <algorithm>
#include <cmath>

#include "shell/disjoint_sets.hpp"

namespace sphshell {
namespace {

// Corners 3 triangle + k joined where they share a vertex and a smooth edge.
DisjointSets fans_of(const Shell& shell) {
  const std::vector<Triangle>& triangles = shell.triangles();
  const Topology& topology = shell.topology();
  DisjointSets fans(3 * triangles.size());
  for (const Edge& edge : topology.edges) {
    if (edge.count != 2 || !(edge.inner || edge.kind == EdgeClass::Smooth)) continue;
    const int h = topology.incidence[edge.begin], g = topology.incidence[edge.begin + 1];
    const int h0 = h, h1 = 3 * triangle_of(h) + next_corner(side_of(h));
    const int g0 = g, g1 = 3 * triangle_of(g) + next_corner(side_of(g));
    const auto vertex = [&](int c) { return triangles[c / 3][c % 3]; };
    const bool opposed = vertex(h0) == vertex(g1);
    fans.join(h0, opposed ? g1 : g0);
    fans.join(h1, opposed ? g0 : g1);
  }
  return fans;
}

}  // namespace

// Max (J. Graphics Tools 4 (1999) 1). A fan whose triangles spread more than its creases may (a
// cone's tip) keeps each triangle's own.
std::vector<Vec3> estimate_normals(const Shell& shell) {
  const std::vector<Triangle>& triangles = shell.triangles();
  const std::vector<Vec3>& p = shell.vertices();
  const Topology& topology = shell.topology();
  const std::size_t corners = 3 * triangles.size();
  DisjointSets fans = fans_of(shell);
  std::vector<Vec3> sum(corners, Vec3::Zero());
  for (std::size_t c = 0; c < corners; ++c) {
    const Triangle& t = triangles[c / 3];
    const int k = static_cast<int>(c % 3);
    const Vec3 a = p[t[next_corner(k)]] - p[t[k]], b = p[t[previous_corner(k)]] - p[t[k]];
    const double weight = 1 / (a.squaredNorm() * b.squaredNorm());
    sum[fans.find(static_cast<int>(c))] += weight * a.cross(b).norm() * topology.face_normal[c / 3];
  }
  std::vector<double> widest(corners, 1);  // cosine
  for (std::size_t c = 0; c < corners; ++c) {
    const int fan = fans.find(static_cast<int>(c));
    widest[fan] = std::min(widest[fan], sum[fan].normalized().dot(topology.face_normal[c / 3]));
  }
  const double limit = std::cos(shell.crease_angle());
  std::vector<Vec3> normals(corners);
  for (std::size_t c = 0; c < corners; ++c) {
    const int fan = fans.find(static_cast<int>(c));
    normals[c] = widest[fan] < limit ? topology.face_normal[c / 3] : Vec3(sum[fan].normalized());
  }
  return normals;
}

}  // namespace sphshell
