#include "contact/query/flat_query.hpp"

#include <map>
#include <numeric>

#include "contact/query/regions.hpp"

namespace sphshell {

// Whether a minimum is found at a vertex, on a triangle that one of a fan's corners belongs to.
// tolerance [m]: how far from the vertex the minimum may be.
static bool has_minimum(const Shell& shell, const std::vector<Minimum>& minima, int vertex,
                        const std::vector<int>& fan, double tolerance) {
  return std::any_of(minima.begin(), minima.end(), [&](const Minimum& at) {
    const Vec3 away = at.contact.point - shell.vertices()[vertex];
    const int t = shell.triangle_of_facet(at.facet);
    return away.squaredNorm() <= tolerance * tolerance &&
           std::any_of(fan.begin(), fan.end(), [t](int c) { return triangle_of(c) == t; });
  });
}

FlatQuery::FlatQuery() {
  // Usual numbers, so that first queries do not grow them one by one.
  faces_.reserve(64);
  edges_.reserve(64);
  vertices_.reserve(64);
}

void FlatQuery::find(const Shell& shell, const Sphere& sphere, BroadPhase& broad, bool want_dn_dc,
                     std::vector<Minimum>& minima) {
  // Face, edge and vertex minima of the candidates; then those found twice, those that another
  // element passes through, and vertices where sheets meet in a point only.
  broad.find(shell, shell.cones(), 0, sphere);
  find_features(shell, sphere, broad.candidates);
  if (faces_.empty() && edges_.empty() && vertices_.empty()) return;
  drop_neighbors(shell);
  add_minima(shell, sphere, want_dn_dc, minima);
  const double same = kSamePoint * sphere.radius + 16 * sphere.tolerance;
  const bool pinched = !shell.topology().pinches.empty();
  if (pinched) find_pinched(shell, sphere, broad.overlapping, kPinched * same, minima);
  if (minima.size() > 1) {
    merge_equal_points(same, minima);
    drop_crossed(shell, sphere, broad.overlapping, same, minima);
  }
  if (pinched) add_pinched(shell, sphere, want_dn_dc, kPinched * same, minima);
}

// A face, an edge or a vertex holds a minimum where the center lies in its normal cone with respect
// to every triangle that meets there: triangles are convex, so this is exact.
void FlatQuery::find_features(const Shell& shell, const Sphere& sphere,
                              const std::vector<int>& candidates) {
  faces_.clear(), edges_.clear(), vertices_.clear();
  const Vec3& center = sphere.center;
  const double tolerance2 = sphere.tolerance * sphere.tolerance;
  // Wider by round-off: the exact test is made where the contact is built.
  const double wide_reach2 = sphere.radius * sphere.radius * (1 + 1e-12);
  for (int f : candidates) {
    const Facet& facet = shell.facets()[f];
    const double height = facet.normal.dot(center - facet.corner[0]);
    if (height * height >= wide_reach2) continue;
    SideTest side[3];
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      side[k] = test_side(facet, k, center, tolerance2);
      inside = inside && !side[k].beyond;
    }
    if (inside) faces_.push_back(f);
    for (int k = 0; k < 3; ++k) {
      // Each edge and each vertex is owned by one facet, which alone reports it.
      if (facet.owned.twin[k] != kNotOwned && side[k].not_within && !side[k].past_first &&
          !side[k].past_second) {
        const Vec3& a = facet.corner[k];
        if (sphere.reaches(a + side[k].t * facet.side(k)) &&
            edge_is_minimum(shell, facet.owned.twin[k], center, tolerance2)) {
          const Triangle& t = shell.triangles()[shell.triangle_of_facet(f)];
          edges_.push_back({f, k, t[k], t[next_corner(k)]});
        }
      }
      if (facet.owned.vertex[k] >= 0 && side[k].before && side[previous_corner(k)].after &&
          sphere.reaches(facet.corner[k]) &&
          vertex_is_minimum(shell, facet.owned.vertex[k], center, sphere.tolerance))
        vertices_.push_back({f, k, facet.owned.vertex[k]});
    }
  }
}

// A facet is convex: where its face holds the nearest point, its own edges and corners cannot, and
// likewise an edge and its ends. Both are found only within round-off of their common border.
void FlatQuery::drop_neighbors(const Shell& shell) {
  if (edges_.empty() && vertices_.empty()) return;
  // Edges and vertices of faces that hold a minimum, then the ends of edges that do: those of the
  // list are dropped.
  taken_edges_.clear();
  taken_vertices_.clear();
  for (int face : faces_) {
    const Triangle& t = shell.triangles()[shell.triangle_of_facet(face)];
    for (int k = 0; k < 3; ++k) {
      taken_edges_.push_back(std::minmax(t[k], t[next_corner(k)]));
      taken_vertices_.push_back(t[k]);
    }
  }
  std::sort(taken_edges_.begin(), taken_edges_.end());
  // Vertex numbers, lower one first, name an edge.
  const auto edge_taken = [&](const OnEdge& e) {
    return std::binary_search(taken_edges_.begin(), taken_edges_.end(),
                              std::pair<int, int>(std::minmax(e.from, e.to)));
  };
  edges_.erase(std::remove_if(edges_.begin(), edges_.end(), edge_taken), edges_.end());
  for (const OnEdge& e : edges_) {
    taken_vertices_.push_back(e.from);
    taken_vertices_.push_back(e.to);
  }
  std::sort(taken_vertices_.begin(), taken_vertices_.end());
  const auto vertex_taken = [&](const OnVertex& v) {
    return std::binary_search(taken_vertices_.begin(), taken_vertices_.end(), v.vertex);
  };
  vertices_.erase(std::remove_if(vertices_.begin(), vertices_.end(), vertex_taken),
                  vertices_.end());
}

// Closed forms: dx/dc is the projection on the plane for a face (its normal stays), on the line for
// an edge, zero for a vertex.
void FlatQuery::add_minima(const Shell& shell, const Sphere& sphere, bool want_dn_dc,
                           std::vector<Minimum>& minima) {
  const Vec3& center = sphere.center;
  const LargeArray<Facet>& facets = shell.facets();
  const auto add = [&](int f, int index, const Contact& contact, bool behind, const Mat3& dx_dc) {
    minima.push_back({contact, f, index, behind});
    Contact& added = minima.back().contact;
    if (want_dn_dc && added.feature != Feature::Face) added.dn_dc = slopes_of(added, sphere, dx_dc);
  };
  // A planar face has one nearest point, whichever of its facets hold it.
  std::sort(faces_.begin(), faces_.end(), [&](int x, int y) {
    const Facet &a = facets[x], &b = facets[y];
    return a.planar_face != b.planar_face ? a.planar_face < b.planar_face : a.element < b.element;
  });
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Facet& facet = facets[faces_[i]];
    if (i > 0 && facets[faces_[i - 1]].planar_face == facet.planar_face) continue;
    const double height = facet.normal.dot(center - facet.corner[0]);
    if (std::abs(height) >= sphere.radius) continue;
    const Vec3 normal = height < 0 ? Vec3(-facet.normal) : facet.normal;
    add(faces_[i], 0,
        {center - height * facet.normal, normal, sphere.radius - std::abs(height), facet.element,
         Feature::Face},
        height < 0, Mat3::Zero());
  }
  for (const OnEdge& on : edges_) {
    const Facet& facet = facets[on.facet];
    const Vec3& a = facet.corner[on.side];
    const Vec3 along = facet.side(on.side);
    const double t = std::clamp((center - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
    add(on.facet, on.side,
        contact_at(a + t * along, facet.normal, sphere, facet.element, Feature::Edge), false,
        along * along.transpose() / along.squaredNorm());
  }
  for (const OnVertex& on : vertices_) {
    const Facet& facet = facets[on.facet];
    add(on.facet, on.corner,
        contact_at(shell.vertices()[on.vertex], facet.normal, sphere, facet.element,
                   Feature::Vertex),
        false, Mat3::Zero());
  }
}

void FlatQuery::remove_dropped(std::vector<Minimum>& minima) const {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size(); ++i)
    if (!dropped_[i]) minima[kept++] = minima[i];
  minima.resize(kept);
}

// The simplest feature wins (face, edge, vertex: the order in which minima were listed).
void FlatQuery::merge_equal_points(double tolerance, std::vector<Minimum>& minima) {
  by_x_.resize(minima.size());
  std::iota(by_x_.begin(), by_x_.end(), 0);
  const auto x = [&](int i) { return minima[i].contact.point.x(); };
  std::sort(by_x_.begin(), by_x_.end(), [&](int i, int j) { return x(i) < x(j); });
  dropped_.assign(minima.size(), 0);
  for (std::size_t a = 0; a < by_x_.size(); ++a)
    for (std::size_t b = a + 1; b < by_x_.size() && x(by_x_[b]) - x(by_x_[a]) <= tolerance; ++b) {
      const auto [first, second] = std::minmax(by_x_[a], by_x_[b]);
      Contact& kept = minima[first].contact;
      const Contact& other = minima[second].contact;
      if ((kept.point - other.point).squaredNorm() > tolerance * tolerance) continue;
      kept.element = std::min(kept.element, other.element);
      dropped_[second] = 1;
    }
  remove_dropped(minima);
}

// Elements may overlap or cross without sharing an edge. Where another one passes through a contact
// point and comes nearer to the center, the distance has no minimum there. The deepest contact is
// the nearest point of all, so a single one needs no such test.
void FlatQuery::drop_crossed(const Shell& shell, const Sphere& sphere,
                             const std::vector<int>& overlapping, double tolerance,
                             std::vector<Minimum>& minima) {
  if (minima.size() < 2) return;
  const Vec3& center = sphere.center;
  const auto crossed = [&](const Vec3& point, const std::vector<int>& facets) {
    const double nearer = std::max(0.0, (center - point).norm() - tolerance);
    return std::any_of(facets.begin(), facets.end(), [&](int f) {
      const Facet& facet = shell.facets()[f];
      if (std::abs(facet.normal.dot(point - facet.corner[0])) > tolerance) return false;
      const Vec3 here = closest_on_triangle(point, facet.corner, facet.normal).point;
      if ((point - here).squaredNorm() > tolerance * tolerance) return false;
      const Vec3 best = closest_on_triangle(center, facet.corner, facet.normal).point;
      return (center - best).squaredNorm() < nearer * nearer;
    });
  };
  // With many facets at hand it is cheaper to use_tree the tree for those at each point.
  const bool use_tree = overlapping.size() > 256;
  dropped_.assign(minima.size(), 0);
  for (std::size_t i = 0; i < minima.size(); ++i) {
    const Vec3& point = minima[i].contact.point;
    if (use_tree) {
      at_point_.clear();
      shell.bvh().find_overlapping(point, 2 * tolerance, at_point_, [](int) {});
    }
    dropped_[i] = crossed(point, use_tree ? at_point_ : overlapping);
  }
  remove_dropped(minima);
}

// Where fans share a vertex and no side, each has its own minimum there: when that goes over to a
// face, it counts whatever the other fans do. Between pieces of the surface that are not connected
// otherwise the vertex is a saddle, of those between the same two the deepest (Kruskal).
void FlatQuery::find_pinched(const Shell& shell, const Sphere& sphere,
                             const std::vector<int>& overlapping, double tolerance,
                             const std::vector<Minimum>& minima) {
  // The vertices of this kind that the sphere reaches, deepest first, each once.
  pinched_.clear();
  for (int f : overlapping)
    for (int vertex : shell.triangles()[shell.triangle_of_facet(f)])
      if (const Pinch* at = shell.topology().pinch_at(vertex)) {
        const double depth = sphere.radius - (shell.vertices()[vertex] - sphere.center).norm();
        if (depth > 0) pinched_.push_back({at, depth, {}, 0});
      }
  std::sort(pinched_.begin(), pinched_.end(), [](const Pinched& x, const Pinched& y) {
    return x.depth != y.depth ? x.depth > y.depth : x.at < y.at;
  });
  const auto same = [](const Pinched& x, const Pinched& y) { return x.at == y.at; };
  pinched_.erase(std::unique(pinched_.begin(), pinched_.end(), same), pinched_.end());
  std::map<int, int> joined;  // a piece to another one, nearer to the first of those joined
  const auto root = [&](int piece) {
    for (auto at = joined.find(piece); at != joined.end(); at = joined.find(piece))
      piece = at->second;
    return piece;
  };
  for (Pinched& pinched : pinched_)
    for (std::size_t i = 0; i < pinched.at->fans.size(); ++i) {
      const std::vector<int>& fan = pinched.at->fans[i];
      if (has_minimum(shell, minima, pinched.at->vertex, fan, tolerance) ||
          fan_is_minimum(shell, fan, sphere.center, sphere.tolerance))
        pinched.fans.push_back(&fan);
      const int one = root(pinched.at->piece[0]), other = root(pinched.at->piece[i]);
      if (one != other) joined[other] = one, ++pinched.saddles;
    }
}

// Adds the minima of fans that were taken for one with another's, or dropped as no minimum of the
// whole; and the saddles, each of which takes one of these away.
void FlatQuery::add_pinched(const Shell& shell, const Sphere& sphere, bool want_dn_dc,
                            double tolerance, std::vector<Minimum>& minima) const {
  for (const auto& [at, depth, fans, saddles] : pinched_) {
    int more = -saddles;
    for (const std::vector<int>* fan : fans)
      more += !has_minimum(shell, minima, at->vertex, *fan, tolerance);
    const int h = shell.facet_half_edge(at->fans[0][0]);
    const Facet& facet = shell.facets()[triangle_of(h)];
    Contact contact = contact_at(shell.vertices()[at->vertex], facet.normal, sphere, facet.element,
                                 Feature::Vertex);
    contact.weight = more < 0 ? -1 : 1;
    if (want_dn_dc) contact.dn_dc = contact.weight * slopes_of(contact, sphere, Mat3::Zero());
    minima.insert(minima.end(), std::abs(more), {contact, triangle_of(h), side_of(h), false});
  }
}

}  // namespace sphshell
