#include "shell/topology.hpp"

#include <limits>
#include <map>

#include "shell/disjoint_sets.hpp"
#include "shell/half_edges.hpp"

namespace sphshell {
namespace {

// Two triangles are one planar face when they share a plane to the round-off of their coordinates:
// this share of the box and of its distance from the origin. A real bump, however low, is kept.
constexpr double kPlanarTolerance = 16 * std::numeric_limits<double>::epsilon();

// Normals of two CAD faces that were made equal where they join may have been rounded since [rad].
constexpr double kEqualNormals = 1e-6;

// What coordinates are rounded in proportion to [m].
double coordinate_scale(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles) {
  const Eigen::AlignedBox3d box = bounds(vertices, triangles);
  return box.diagonal().norm() + box.min().cwiseAbs().cwiseMax(box.max().cwiseAbs()).maxCoeff();
}

// Twice the area vector: the cross product of the two shorter edges, so that the rounding of a
// needle's longest one does not enter.
Vec3 area_vector(const std::vector<Vec3>& v, const Triangle& t) {
  int apex = 0;  // opposite the longest edge
  double longest = -1;
  for (int k = 0; k < 3; ++k) {
    const double length2 = (v[t[previous_corner(k)]] - v[t[next_corner(k)]]).squaredNorm();
    if (length2 > longest) longest = length2, apex = k;
  }
  const Vec3& p = v[t[apex]];
  return (v[t[next_corner(apex)]] - p).cross(v[t[previous_corner(apex)]] - p);
}

void build_edges(std::size_t vertices, const std::vector<Triangle>& triangles, Topology& out) {
  const std::size_t half_edges = 3 * triangles.size();
  out.edge_of.resize(half_edges);
  out.incidence.reserve(half_edges);
  // Enough unless most are on borders; what is not needed is never touched.
  out.edges.reserve(half_edges * 5 / 8);
  const auto ends = [&](std::size_t h) {
    const Triangle& t = triangles[h / 3];
    const int k = static_cast<int>(h % 3);
    return std::pair(t[k], t[next_corner(k)]);
  };
  const auto add = [&](int low, int high, const std::uint64_t* first, const std::uint64_t* last) {
    // Half-edges with the same two vertices are one edge: for_each_edge() sorts them together.
    Edge edge{};
    edge.first_vertex = low, edge.last_vertex = high;
    edge.begin = static_cast<int>(out.incidence.size());
    edge.count = static_cast<int>(last - first);
    edge.kind = EdgeClass::Boundary;
    for (const std::uint64_t* word = first; word != last; ++word) {
      const int h = static_cast<int>(static_cast<std::uint32_t>(*word));
      out.incidence.push_back(h);
      out.edge_of[h] = static_cast<int>(out.edges.size());
    }
    out.edges.push_back(edge);
  };
  for_each_edge(half_edges, vertices, ends, add);
}

// Coplanar neighbors become one face with one normal: that of their summed areas, so that a
// sliver's own, ill-defined normal does no harm. A union that drifts off its plane (a long chain of
// nearly flat steps) is taken apart again.
void build_planar_faces(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
                        const std::vector<int>& element, double tolerance, Topology& out) {
  const int n = static_cast<int>(triangles.size());
  LargeArray<Vec3> area(n);
  for (int t = 0; t < n; ++t) area[t] = area_vector(vertices, triangles[t]);
  DisjointSets sets(triangles.size());
  for (Edge& edge : out.edges) {
    if (edge.count != 2) continue;
    const auto [h, g] = out.half_edges(edge);
    const int t = triangle_of(h), u = triangle_of(g);
    edge.inner = element[t] == element[u];
    const bool same_direction =
        triangles[t][side_of(h)] == triangles[u][side_of(g)];  // windings disagree
    const Vec3 normal = (same_direction ? Vec3(area[t] - area[u]) : Vec3(area[t] + area[u]));
    const double length = normal.norm();
    // A sheet folded back onto itself lies in one plane, but is no planar face.
    if (!(area[t].dot(area[u]) * (same_direction ? -1 : 1) > 0)) continue;
    const Vec3& p = vertices[edge.first_vertex];
    const Vec3& q = vertices[edge.last_vertex];
    const Vec3& a = vertices[triangles[t][previous_corner(side_of(h))]];
    const Vec3& b = vertices[triangles[u][previous_corner(side_of(g))]];
    const auto off = [&](const Vec3& x) { return std::abs((x - p).dot(normal)) / length; };
    const bool flat = std::max({off(a), off(b), off(q)}) <= tolerance;
    if (edge.inner || (flat && !same_direction)) sets.merge(t, u);
  }
  const std::vector<int> label = sets.labels();
  int count = sets.count();
  std::vector<Vec3> normal(count, Vec3::Zero()), origin(count);
  std::vector<char> seen(count, 0), warped(count, 0);
  for (int t = 0; t < n; ++t) {
    normal[label[t]] += area[t];
    if (!seen[label[t]]) origin[label[t]] = vertices[triangles[t][0]], seen[label[t]] = 1;
  }
  // Of the summed areas of each face.
  for (Vec3& m : normal) m.normalize();
  for (int t = 0; t < n; ++t)
    for (int v : triangles[t])
      if (std::abs((vertices[v] - origin[label[t]]).dot(normal[label[t]])) > 10 * tolerance)
        warped[label[t]] = 1;
  out.planar_face.resize(n);
  out.face_normal.resize(n);
  for (int t = 0; t < n; ++t) {
    const bool alone = warped[label[t]];
    out.planar_face[t] = alone ? count++ : label[t];
    out.face_normal[t] = alone ? area[t].normalized() : normal[label[t]];
  }
}

// Kinds of edges that are not boundaries: not manifold, or smooth or a crease by the angle, within
// CAD faces by their normals.
void classify_edges(const std::vector<Triangle>& triangles, double crease_angle,
                    const CadFaces& cad, Topology& out) {
  for (Edge& edge : out.edges) {
    if (edge.count == 1) continue;  // boundary already
    if (edge.count > 2) {
      edge.kind = EdgeClass::NonManifold;
      continue;
    }
    const auto [h, g] = out.half_edges(edge);
    const int t = triangle_of(h), u = triangle_of(g);
    if (triangles[t][side_of(h)] == triangles[u][side_of(g)]) {
      edge.kind = EdgeClass::NonManifold;  // no common orientation (a Moebius strip's seam)
      continue;
    }
    const bool smooth =
        out.planar_face[t] == out.planar_face[u] ||
        (cad.face.empty() ? angle_between(out.face_normal[t], out.face_normal[u]) < crease_angle
                          : cad.smooth(h, g));
    edge.kind = smooth ? EdgeClass::Smooth : EdgeClass::Crease;
  }
}

// Elements that smooth or inner edges connect: one region of the surface without a crease.
void build_patches(const std::vector<int>& element, Topology& out) {
  const std::size_t count = element.empty() ? 0 : static_cast<std::size_t>(element.back()) + 1;
  DisjointSets sets(count);
  for (const Edge& edge : out.edges)
    if (edge.inner || edge.kind == EdgeClass::Smooth)
      sets.merge(element[triangle_of(out.incidence[edge.begin])],
                 element[triangle_of(out.incidence[edge.begin + 1])]);
  out.patch = sets.labels();
  out.num_patches = sets.count();
}

// Compressed rows: the neighbors of vertex v are neighbors[neighbor_begin[v]] up to
// neighbor_begin[v + 1].
void build_vertices(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
                    Topology& out) {
  const std::size_t n = vertices.size();
  out.neighbor_begin.assign(n + 1, 0);
  out.vertex_on_rim.assign(n, 0);
  out.vertex_sharp.assign(n, 0);
  for (const Edge& e : out.edges) {
    ++out.neighbor_begin[e.first_vertex + 1];
    ++out.neighbor_begin[e.last_vertex + 1];
    if (!e.inner && e.kind != EdgeClass::Smooth)
      out.vertex_sharp[e.first_vertex] = out.vertex_sharp[e.last_vertex] = 1;
    if (e.on_rim()) out.vertex_on_rim[e.first_vertex] = out.vertex_on_rim[e.last_vertex] = 1;
  }
  std::partial_sum(out.neighbor_begin.begin(), out.neighbor_begin.end(),
                   out.neighbor_begin.begin());
  out.neighbors.resize(out.neighbor_begin.back());
  std::vector<int> fill(out.neighbor_begin.begin(), out.neighbor_begin.end() - 1);
  for (const Edge& e : out.edges) {
    out.neighbors[fill[e.first_vertex]++] = e.last_vertex;
    out.neighbors[fill[e.last_vertex]++] = e.first_vertex;
  }
  out.vertex_normal.assign(n, Vec3::Zero());
  for (std::size_t t = 0; t < triangles.size(); ++t)
    for (int k = 0; k < 3; ++k) {
      const Vec3& p = vertices[triangles[t][k]];
      const Vec3 a = vertices[triangles[t][next_corner(k)]] - p;
      const Vec3 b = vertices[triangles[t][previous_corner(k)]] - p;
      // Weighted with the angle at the vertex, so that the sum does not depend on the
      // triangulation.
      out.vertex_normal[triangles[t][k]] += angle_between(a, b) * out.face_normal[t];
    }
}

// Corners that edges connect are one fan. A vertex with several fans joins sheets in a point only.
void find_pinches(std::size_t vertices, const std::vector<Triangle>& triangles, Topology& out) {
  const int corners = static_cast<int>(3 * triangles.size());
  DisjointSets fans(corners);
  const auto vertex = [&](int c) { return triangles[triangle_of(c)][side_of(c)]; };
  for (const Edge& edge : out.edges)
    for (const int g : out.around(edge)) {
      const int h = out.incidence[edge.begin];
      const bool opposed = vertex(h) != vertex(g);
      fans.merge(h, opposed ? corner_after(g) : g);
      fans.merge(corner_after(h), opposed ? g : corner_after(g));
    }
  // The first corner of a fan stands for it: a vertex with two of those is pinched.
  std::vector<char> fans_at(vertices, 0);
  std::map<int, std::map<int, std::vector<int>>> found;
  for (int c = 0; c < corners; ++c)
    if (fans.find(c) == c && fans_at[vertex(c)]++ == 1) fans_at[vertex(c)] = 2, found[vertex(c)];
  if (found.empty()) return;
  for (int c = 0; c < corners; ++c)
    if (fans_at[vertex(c)] > 1) found[vertex(c)][fans.find(c)].push_back(c);
  DisjointSets pieces(triangles.size());
  for (const Edge& edge : out.edges)
    for (const int g : out.around(edge))
      pieces.merge(triangle_of(out.incidence[edge.begin]), triangle_of(g));
  for (auto& [at, around] : found) {
    Pinch& pinch = out.pinches.emplace_back();
    pinch.vertex = at;
    for (auto& [first, members] : around) {
      pinch.piece.push_back(pieces.find(triangle_of(first)));
      pinch.fans.push_back(std::move(members));
    }
  }
}

}  // namespace

Eigen::AlignedBox3d bounds(const std::vector<Vec3>& vertices,
                           const std::vector<Triangle>& triangles) {
  Eigen::AlignedBox3d box;
  for (const Triangle& t : triangles)
    for (int v : t) box.extend(vertices[v]);
  return box;
}

const Pinch* Topology::pinch_at(int vertex) const {
  const auto at = std::lower_bound(pinches.begin(), pinches.end(), vertex,
                                   [](const Pinch& p, int v) { return p.vertex < v; });
  return at == pinches.end() || at->vertex != vertex ? nullptr : &*at;
}

// Within a face of CAD everything is smooth; between two where their normals are the same at both
// ends.
bool CadFaces::smooth(int h, int g) const {
  if (face[triangle_of(h)] == face[triangle_of(g)]) return true;
  const auto same = [&](int i, int j) {
    return (normals[i] - normals[j]).squaredNorm() < kEqualNormals * kEqualNormals;
  };
  return same(h, corner_after(g)) && same(corner_after(h), g);
}

Topology::Topology(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
                   const std::vector<int>& element, double crease_angle, const CadFaces& cad) {
  // Each step uses what those before it found.
  build_edges(vertices.size(), triangles, *this);
  build_planar_faces(vertices, triangles, element,
                     kPlanarTolerance * coordinate_scale(vertices, triangles), *this);
  classify_edges(triangles, crease_angle, cad, *this);
  build_patches(element, *this);
  build_vertices(vertices, triangles, *this);
  find_pinches(vertices.size(), triangles, *this);
}

Sheets::Sheets(const Topology& topology) : rim(topology.face_normal.size(), 0) {
  DisjointSets sets(rim.size());
  for (const Edge& edge : topology.edges) {
    if (!edge.on_rim()) {
      sets.merge(triangle_of(topology.incidence[edge.begin]),
                 triangle_of(topology.incidence[edge.begin + 1]));
      continue;
    }
    for (const int h : topology.around(edge))
      rim[triangle_of(h)] |= static_cast<std::uint8_t>(1 << side_of(h));
  }
  // Triangles that edges connect which are no border.
  sheet = sets.labels();
  closed.assign(static_cast<std::size_t>(sets.count()), 1);
  for (std::size_t t = 0; t < rim.size(); ++t)
    // A sheet with any border edge is open.
    if (rim[t]) closed[static_cast<std::size_t>(sheet[t])] = 0;
}

}  // namespace sphshell
