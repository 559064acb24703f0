#include "shell/shell.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "shell/triangle.hpp"

namespace sphshell {

Shell::Shell(std::vector<Vec3> vertices, std::vector<Triangle> triangles, std::vector<int> element,
             double crease_angle, Side side)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      element_(std::move(element)),
      side_(side),
      topology_(vertices_, triangles_, element_, crease_angle),
      bvh_(vertices_, triangles_, order_) {
  size_ = bounds(vertices_, triangles_).diagonal().norm();
  facet_of_.resize(order_.size());
  for (std::size_t f = 0; f < order_.size(); ++f) facet_of_[order_[f]] = static_cast<int>(f);
  build_facets(order_);
  build_cones();
}

void Shell::build_facets(const std::vector<int>& order) {
  const Topology& topology = topology_;
  facets_.resize(order.size());
  for (std::size_t f = 0; f < order.size(); ++f) {
    const int t = order[f];
    Facet& facet = facets_[f];
    for (int k = 0; k < 3; ++k) facet.corner[k] = vertices_[triangles_[t][k]];
    facet.normal = topology.face_normal[t];
    facet.planar_face = topology.planar_face[t];
    facet.element = element_[t];
    for (int k = 0; k < 3; ++k) facet.twin[k] = facet.vertex[k] = kNotMine;
  }
  // Each edge and vertex is decided once, by one facet: the first triangle that has it.
  std::vector<char> taken(vertices_.size(), 0);
  const auto half_edge = [&](int h) { return 3 * facet_of_[triangle_of(h)] + side_of(h); };
  const auto claim_vertex = [&](int h, int corner) {
    const int t = triangle_of(h), v = triangles_[t][corner];
    if (taken[v]) return;
    taken[v] = 1;
    facets_[facet_of_[t]].vertex[corner] = v;
  };
  for (const Edge& edge : topology.edges) {
    const int h = topology.incidence[edge.begin];
    int& mine = facets_[facet_of_[triangle_of(h)]].twin[side_of(h)];
    if (edge.count == 2 && edge.kind != EdgeClass::NonManifold) {
      const int g = topology.incidence[edge.begin + 1];
      if (topology.planar_face[triangle_of(h)] == topology.planar_face[triangle_of(g)]) continue;
      mine = half_edge(g);
    } else if (edge.count == 1) {
      mine = kBoundary;
    } else {
      mine = kManifold - static_cast<int>(manifold_.size());
      manifold_.emplace_back();
      for (int i = 0; i < edge.count; ++i)
        manifold_.back().push_back(half_edge(topology.incidence[edge.begin + i]));
    }
    // A vertex inside a planar face has no edge that reaches this line, and needs no decision.
    claim_vertex(h, side_of(h));
    claim_vertex(h, next_corner(side_of(h)));
  }
}

// Bound on the angle between `axis` and any direction u that points away from all edges at the
// vertex. Seen along the axis the edges leave no gap wider than g, so one of them is within g/2 of
// u's shadow; it rises by at most phi, hence tan(angle) <= tan(phi) / cos(g/2).
double Shell::tan_vertex_cone(int vertex, const Vec3& axis) const {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  if (topology_.vertex_on_rim[vertex]) return kAny;
  const Vec3 first = axis.unitOrthogonal(), second = axis.cross(first);
  std::vector<double> bearing;
  double rise = 0;
  for (int i = topology_.neighbour_begin[vertex]; i < topology_.neighbour_begin[vertex + 1]; ++i) {
    const Vec3 edge = vertices_[topology_.neighbours[i]] - vertices_[vertex];
    const double x = edge.dot(first), y = edge.dot(second), flat = std::hypot(x, y);
    if (flat == 0) return kAny;
    rise = std::max(rise, std::abs(edge.dot(axis)) / flat);
    bearing.push_back(std::atan2(y, x));
  }
  std::sort(bearing.begin(), bearing.end());
  double gap = bearing.front() + 2 * M_PI - bearing.back();
  for (std::size_t i = 1; i < bearing.size(); ++i) gap = std::max(gap, bearing[i] - bearing[i - 1]);
  const double narrow = std::cos(0.5 * gap);
  return narrow > 0.05 ? rise / narrow : kAny;
}

void Shell::build_cones() {
  cones_.resize(facets_.size());
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const Facet& facet = facets_[f];
    double tangent = 0;
    for (int k = 0; k < 3; ++k) {
      if (facet.twin[k] >= 0) {
        const Vec3& other = facets_[triangle_of(facet.twin[k])].normal;
        const double cosine = facet.normal.dot(other);
        tangent = std::max(tangent, cosine > 0.05 ? facet.normal.cross(other).norm() / cosine
                                                  : std::numeric_limits<double>::infinity());
      } else if (facet.twin[k] != kNotMine) {
        tangent = std::numeric_limits<double>::infinity();
      }
      if (facet.vertex[k] >= 0)
        tangent = std::max(tangent, tan_vertex_cone(facet.vertex[k], facet.normal));
    }
    const Vec3 middle = (facet.corner[0] + facet.corner[1] + facet.corner[2]) / 3;
    double reach = 0;
    for (const Vec3& corner : facet.corner) reach = std::max(reach, (corner - middle).norm());
    NormalCone& cone = cones_[f];
    for (int k = 0; k < 3; ++k) {
      cone.middle[k] = static_cast<float>(middle[k] - origin()[k]);
      cone.axis[k] = static_cast<float>(facet.normal[k]);
    }
    cone.reach = static_cast<float>(reach + 1e-6 * size_);
    cone.tan_opening = tangent < 1e3 ? static_cast<float>(tangent * 1.00001 + 1e-6) : 1e9f;
  }
}

SurfacePoint Shell::closest_point(const Vec3& point) const {
  double best = std::numeric_limits<double>::infinity();
  ClosestPoint at{};
  int which = 0;
  bvh_.nearest(point, [&](int f) {
    const ClosestPoint c = closest_on_triangle(point, facets_[f].corner, facets_[f].normal);
    const double d2 = (point - c.point).squaredNorm();
    const bool better = d2 < best || (d2 == best && order_[f] < order_[which]);
    if (better) best = d2, at = c, which = f;
    return best;
  });
  const Facet& facet = facets_[which];
  const int t = order_[which];
  Vec3 normal = facet.normal;
  if (at.feature >= 4) {
    normal = topology_.vertex_normal[triangles_[t][at.feature - 4]];
  } else if (at.feature >= 1) {
    const Edge& edge = topology_.edges[topology_.edge_of[3 * t + at.feature - 1]];
    normal.setZero();
    for (int i = 0; i < edge.count; ++i)
      normal += topology_.face_normal[triangle_of(topology_.incidence[edge.begin + i])];
  }
  const double length = normal.norm();
  normal = length > 1e-9 ? Vec3(normal / length) : facet.normal;
  const double distance = std::sqrt(best);
  const double sign = (point - at.point).dot(normal) < 0 ? -1.0 : 1.0;
  return {at.point, normal, sign * distance, facet.element};
}

std::size_t Shell::bytes() const {
  return bvh_.bytes() + facets_.size() * (sizeof(Facet) + sizeof(NormalCone)) +
         vertices_.size() * sizeof(Vec3) + topology_.incidence.size() * 2 * sizeof(int) +
         topology_.edges.size() * sizeof(Edge) + topology_.face_normal.size() * sizeof(Vec3);
}

}  // namespace sphshell
