#include "shell/curved/curved.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {

Shell::Shell(std::vector<Vec3> vertices, std::vector<Triangle> triangles, std::vector<int> element,
             double crease_angle, Side side, const CadFaces& cad)
    : vertices_(std::move(vertices)),
      triangles_(std::move(triangles)),
      element_(std::move(element)),
      crease_angle_(crease_angle),
      side_(side),
      topology_(vertices_, triangles_, element_, crease_angle, cad),
      bvh_(vertices_, triangles_, order_) {
  // Facets are stored in the order of the tree's leaves, so that what is visited together lies
  // together in memory; facet_of_ leads from a triangle to its facet.
  size_ = bounds(vertices_, triangles_).diagonal().norm();
  facet_of_.resize(order_.size());
  for (std::size_t f = 0; f < order_.size(); ++f) facet_of_[order_[f]] = static_cast<int>(f);
  build_facets(order_);
  build_cones();
  give_back_freed_memory(triangles_.size());
}

void Shell::build_facets(const std::vector<int>& order) {
  for (const Edge& edge : topology_.edges) {
    if (edge.count == 1 || (edge.count == 2 && edge.kind != EdgeClass::NonManifold)) continue;
    // Edges of more than two triangles, or wound against each other, keep a list of all their half-
    // edges.
    manifold_.emplace_back();
    for (const int h : topology_.around(edge)) manifold_.back().push_back(facet_half_edge(h));
  }
  const std::vector<Owned> owned = assign_owners(
      [&](int t, int u) { return topology_.planar_face[t] == topology_.planar_face[u]; });
  facets_.resize(order.size());
  for_each_in_parallel(order.size(), [&](std::size_t f) {
    const int t = order[f];
    Facet& facet = facets_[f];
    for (int k = 0; k < 3; ++k) facet.corner[k] = vertices_[triangles_[t][k]];
    facet.normal = topology_.face_normal[t];
    facet.owned = owned[f];
    facet.planar_face = topology_.planar_face[t];
    facet.element = element_[t];
  });
}

// The first triangle that has an edge or a vertex owns it.
std::vector<Owned> Shell::assign_owners(const std::function<bool(int t, int u)>& flat) const {
  constexpr Owned kNothing = {{kNotOwned, kNotOwned, kNotOwned}, {kNotOwned, kNotOwned, kNotOwned}};
  std::vector<Owned> owned(triangles_.size(), kNothing);
  std::vector<char> taken(vertices_.size(), 0);
  const auto own_vertex = [&](int h, int corner) {
    const int t = triangle_of(h), v = triangles_[t][corner];
    if (taken[v]) return;
    taken[v] = 1;
    owned[facet_of_[t]].vertex[corner] = v;
  };
  int many_sided = 0;
  for (const Edge& edge : topology_.edges) {
    const int h = topology_.incidence[edge.begin];
    int& twin = owned[facet_of_[triangle_of(h)]].twin[side_of(h)];
    if (edge.count == 2 && edge.kind != EdgeClass::NonManifold) {
      const int g = topology_.incidence[edge.begin + 1];
      if (flat(triangle_of(h), triangle_of(g))) continue;
      twin = facet_half_edge(g);
    } else {
      // The number of a list, as a code below the others.
      twin = edge.count == 1 ? kBoundary : kManifold - many_sided++;
    }
    // A vertex inside a flat region has no edge that reaches this line, and needs no test.
    own_vertex(h, side_of(h));
    own_vertex(h, next_corner(side_of(h)));
  }
  return owned;
}

// Bound on the angle between `axis` and any direction u that points away from all edges at the
// vertex. Seen along the axis the edges leave no gap wider than g, so one of them is within g/2 of
// u's projection; it rises by at most phi, hence tan(angle) <= tan(phi) / cos(g/2).
double Shell::tan_vertex_cone(int vertex, const Vec3& axis, const Tangents* tangents) const {
  constexpr double kAny = std::numeric_limits<double>::infinity();
  if (topology_.vertex_on_rim[vertex]) return kAny;
  // All edges at the vertex, projected along the axis, sorted by their direction around it.
  const Vec3 first = axis.unitOrthogonal(), second = axis.cross(first);
  // A direction in the plane, of unit length; `turn` grows with its angle, by 4 all round and by 2
  // half round.
  struct Bearing {
    double turn, x, y;
    bool operator<(const Bearing& other) const { return turn < other.turn; }
  };
  thread_local std::vector<Bearing> bearing;
  const int begin = topology_.neighbor_begin[vertex], end = topology_.neighbor_begin[vertex + 1];
  const auto count = static_cast<std::size_t>(end - begin);
  bearing.resize(count);
  double rise = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const int at = begin + static_cast<int>(i);
    const Vec3 edge =
        tangents ? (*tangents)[at] : Vec3(vertices_[topology_.neighbors[at]] - vertices_[vertex]);
    double x = edge.dot(first), y = edge.dot(second);
    const double flat = std::sqrt(x * x + y * y);
    if (!(flat > 0)) return kAny;
    rise = std::max(rise, std::abs(edge.dot(axis)) / flat);
    x /= flat, y /= flat;
    // Grows with the angle like atan2, without calling it.
    const double across = x / (std::abs(x) + std::abs(y));
    bearing[i] = {y >= 0 ? 1 - across : 3 + across, x, y};
  }
  std::sort(bearing.begin(), bearing.end());
  double least = 1;  // cosine of the widest gap
  for (std::size_t i = 0; i < count; ++i) {
    const Bearing& here = bearing[i];
    const Bearing& next = bearing[i + 1 < count ? i + 1 : 0];
    if (next.turn - here.turn + (i + 1 < count ? 0 : 4) >= 2) return kAny;
    least = std::min(least, here.x * next.x + here.y * next.y);
  }
  // cos(g / 2) from cos(g).
  const double narrow = std::sqrt(std::max(0.0, 0.5 * (1 + least)));
  return narrow > 0.05 ? rise / narrow : kAny;
}

void Shell::build_cones() {
  cones_.resize(facets_.size());
  for_each_in_parallel(facets_.size(), [&](std::size_t f) {
    const Facet& facet = facets_[f];
    // The normals of an edge are between those of its two facets.
    const double tangent = opening_of(facet, facet.owned, nullptr, [&](int g) {
      const Vec3& other = facets_[g].normal;
      return facet.normal.cross(other).norm() / facet.normal.dot(other);
    });
    const Vec3 middle = facet.middle();
    double reach = 0;
    for (const Vec3& corner : facet.corner) reach = std::max(reach, (corner - middle).norm());
    NormalCone& cone = cones_[f];
    for (int k = 0; k < 3; ++k) {
      // About the tree's origin, in single precision, which `reach` and `tan_opening` allow for.
      cone.middle[k] = static_cast<float>(middle[k] - origin()[k]);
      cone.axis[k] = static_cast<float>(facet.normal[k]);
    }
    cone.reach = static_cast<float>(reach + 1e-6 * size_);
    cone.tan_opening = widened_opening(tangent);
  });
}

// Positive where the surface is convex: the far corner of the second triangle is below the plane of
// the first.
double Shell::angle(const Edge& edge) const {
  if (edge.count != 2 || edge.kind == EdgeClass::NonManifold) return 0;
  const auto [h, g] = topology_.half_edges(edge);
  const Vec3& m = topology_.face_normal[triangle_of(h)];
  const double angle = angle_between(m, topology_.face_normal[triangle_of(g)]);
  const Vec3& far = point(corner_before(g));
  return (far - vertices_[edge.first_vertex]).dot(m) <= 0 ? angle : -angle;
}

SurfacePoint Shell::closest_point(const Vec3& point) const {
  double best = std::numeric_limits<double>::infinity();
  ClosestPoint at{};
  int which = 0;
  bvh_.nearest(point, [&](int f) {
    const ClosestPoint c = closest_on_triangle(point, facets_[f].corner, facets_[f].normal);
    const double d2 = (point - c.point).squaredNorm();
    // Of equal distances the first triangle's point, whatever the order of the tree.
    const bool better = d2 < best || (d2 == best && order_[f] < order_[which]);
    if (better) best = d2, at = c, which = f;
    return best;
  });
  const Facet& facet = facets_[which];
  const int t = order_[which];
  Vec3 normal = facet.normal;
  // closest_on_triangle: 0 the face, 1 to 3 an edge, 4 to 6 a vertex. The pseudo-normal of that
  // feature gives the sign of the distance.
  if (at.feature >= 4)
    normal = topology_.vertex_normal[triangles_[t][at.feature - 4]];
  else if (at.feature >= 1)
    normal = topology_.edge_normal(topology_.edge_at(3 * t + at.feature - 1));
  const double length = normal.norm();
  normal = length > 1e-9 ? Vec3(normal / length) : facet.normal;
  const double distance = std::sqrt(best);
  const double sign = (point - at.point).dot(normal) < 0 ? -1.0 : 1.0;
  return {at.point, normal, sign * distance, facet.element};
}

void Shell::curve(CurveOptions options) {
  if (curved_) return;
  curved_ = std::make_shared<const CurvedShell>(*this, std::move(options));
  ready_.store(curved_.get(), std::memory_order_release);
  give_back_freed_memory(triangles_.size());
}

const Sheets& Shell::sheets() const {
  std::call_once(sheets_found_, [&] { sheets_ = std::make_shared<const Sheets>(topology_); });
  return *sheets_;
}

}  // namespace sphshell
