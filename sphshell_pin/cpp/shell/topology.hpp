// Edges, planar faces and smooth patches of a clean triangulated surface.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "shell/lists.hpp"

namespace sphshell {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using Triangle = std::array<int, 3>;

// Numbers in rows, which others own: of one number each, or of so many columns.
template <class T, int... columns>
struct Rows {
  const T* data;
  std::size_t count;  // of rows

  const T& operator[](std::size_t i) const { return data[i]; }
};
using Points = Rows<double, 3>;
using Indices = Rows<std::int32_t>;

// Point i.
inline Eigen::Map<const Vec3> place(const Points& points, std::size_t i) {
  return Eigen::Map<const Vec3>(points.data + 3 * i);
}

// Box of the vertices that triangles use.
Eigen::AlignedBox3d bounds(const std::vector<Vec3>& vertices,
                           const std::vector<Triangle>& triangles);

// feature: 0 the face, 1 + k the edge from corner k to the next, 4 + k the corner k.
struct ClosestPoint {
  Vec3 point;
  int feature;
};

// Voronoi regions of a triangle with the unit normal n: the plane's own half-planes decide, which
// stays accurate on needles where barycentric coordinates (Ericson 2005, 5.1.5) lose all digits.
inline ClosestPoint closest_on_triangle(const Vec3& x, const Vec3 corner[3], const Vec3& n) {
  bool inside = true;
  double best = 1e300;
  ClosestPoint out{corner[0], 4};
  for (int k = 0; k < 3; ++k) {
    const Vec3& a = corner[k];
    const Vec3 edge = corner[k == 2 ? 0 : k + 1] - a;
    const Vec3 from = x - a;
    if (n.dot(edge.cross(from)) >= 0) continue;
    inside = false;
    const double length2 = edge.squaredNorm();
    const double t = std::clamp(from.dot(edge) / length2, 0.0, 1.0);
    const Vec3 p = a + t * edge;
    const double d2 = (x - p).squaredNorm();
    if (d2 < best) {
      best = d2;
      out.point = p;
      out.feature = t <= 0 ? 4 + k : t >= 1 ? 4 + (k == 2 ? 0 : k + 1) : 1 + k;
    }
  }
  if (inside) out = {x - (x - corner[0]).dot(n) * n, 0};
  return out;
}

// In [0, pi], accurate at both ends, where acos is not.
inline double angle_between(const Vec3& a, const Vec3& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

enum class EdgeClass : std::uint8_t { Smooth = 0, Crease = 1, Boundary = 2, NonManifold = 3 };

// A half-edge is one side k (corner k to corner k+1) of a triangle t, numbered 3 t + k.
inline int triangle_of(int half_edge) { return half_edge / 3; }
inline int side_of(int half_edge) { return half_edge % 3; }
inline int next_corner(int k) { return k == 2 ? 0 : k + 1; }
inline int previous_corner(int k) { return k == 0 ? 2 : k - 1; }
// The corner after this one (3 triangle + k), in the same triangle, and the one before.
inline int corner_after(int c) { return 3 * triangle_of(c) + next_corner(side_of(c)); }
inline int corner_before(int c) { return 3 * triangle_of(c) + previous_corner(side_of(c)); }

// Numbers one after another, which others own.
struct Span {
  const int *first, *last;
  const int* begin() const { return first; }
  const int* end() const { return last; }
};

struct Edge {
  int first_vertex, last_vertex;  // first < last
  int begin, count : 28;          // its half-edges: incidence[begin .. begin + count)
  EdgeClass kind : 3;
  bool inner : 1;  // the diagonal inside one element: no edge of the surface

  bool on_rim() const { return kind == EdgeClass::Boundary || kind == EdgeClass::NonManifold; }
};

// A vertex that several fans of triangles share, but no side: it joins them like a side of length
// zero.
struct Pinch {
  int vertex;
  std::vector<std::vector<int>> fans;  // the corners (3 triangle + k) of each
  std::vector<int> piece;              // of each: its part of the surface, connected across edges
};

// What CAD knows of the joints between its faces; empty where the surface came without.
struct CadFaces {
  std::vector<int> face;      // per triangle
  std::vector<Vec3> normals;  // unit, per triangle corner; equal across a tangent joint

  // Whether the edge between half-edges h and g, wound alike, is smooth: it lies within a face, or
  // both faces have the same normals at its ends.
  bool smooth(int h, int g) const;
};

// Everything about the surface that follows from vertices, triangles, the crease angle, and CAD's
// faces where they are known: those say what is smooth, whatever the angle.
struct Topology {
  std::vector<Edge> edges;
  std::vector<int> incidence;       // half-edges, grouped by edge
  std::vector<int> edge_of;         // half-edge -> edge
  std::vector<Vec3> face_normal;    // unit, per triangle: that of its whole planar face
  std::vector<int> planar_face;     // per triangle: coplanar, edge-connected triangles share one
  std::vector<int> patch;           // per element: connected through smooth edges
  std::vector<int> neighbor_begin;  // per vertex, into `neighbors` (size: vertices + 1)
  std::vector<int> neighbors;       // vertices joined to a vertex by an edge
  std::vector<Vec3> vertex_normal;  // angle-weighted pseudo-normal (Baerentzen and Aanaes 2005)
  std::vector<char> vertex_on_rim;  // touches a boundary or non-manifold edge
  std::vector<char> vertex_sharp;   // touches an edge that is not smooth
  int num_patches = 0;
  std::vector<Pinch> pinches;  // in ascending order of their vertices

  // Null of a vertex that is none.
  const Pinch* pinch_at(int vertex) const;

  const Edge& edge_at(int half_edge) const { return edges[edge_of[half_edge]]; }
  Span around(const Edge& edge) const {
    return {incidence.data() + edge.begin, incidence.data() + edge.begin + edge.count};
  }
  // The half-edges of an edge that has two.
  std::pair<int, int> half_edges(const Edge& edge) const {
    return {incidence[edge.begin], incidence[edge.begin + 1]};
  }
  // The triangle across a half-edge, at an edge of two; else -1.
  int neighbor(int h) const {
    const int other = other_half_edge(h);
    return other < 0 ? -1 : triangle_of(other);
  }
  // The other one of an edge with two half-edges, else -1.
  int other_half_edge(int h) const {
    const Edge& edge = edge_at(h);
    return edge.count != 2 ? -1 : incidence[edge.begin + (incidence[edge.begin] == h ? 1 : 0)];
  }

  // Pseudo-normal of an edge, not of unit length: the sum of its triangles' normals.
  Vec3 edge_normal(const Edge& edge) const {
    Vec3 sum = Vec3::Zero();
    for (const int h : around(edge)) sum += face_normal[triangle_of(h)];
    return sum;
  }

  // crease_angle [rad]; triangles of one element are contiguous in `element`.
  Topology(const std::vector<Vec3>& vertices, const std::vector<Triangle>& triangles,
           const std::vector<int>& element, double crease_angle, const CadFaces& cad = {});
};

// Triangles that are connected through edges of two half-edges wound alike form a sheet: it has an
// orientation. What is left are its rims: borders, and edges of three or more triangles.
struct Sheets {
  std::vector<int> sheet;         // per triangle
  std::vector<std::uint8_t> rim;  // per triangle, bit k: its side k is on a rim
  std::vector<char> closed;       // per sheet: it has no rim

  explicit Sheets(const Topology& topology);
};

}  // namespace sphshell
