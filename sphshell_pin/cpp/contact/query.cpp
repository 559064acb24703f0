#include "contact/query.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "contact/regions.hpp"
#include "shell/triangle.hpp"

namespace sphshell {

Query::Query(bool follow) : follow_(follow) {
  reached_.reserve(1024);
  near_.reserve(256);
  contacts.reserve(64);
  faces_.reserve(64);
  edges_.reserve(64);
  vertices_.reserve(64);
  carriers_.reserve(64);
}

const std::vector<Contact>& Query::find(const Shell& shell, const Vec3& centre, double radius,
                                        Method method) {
  contacts.clear();
  switch (method) {
    case Method::Facets:
      find_facets(shell, centre, radius);
      break;
    case Method::Elements:
      find_elements(shell, centre, radius);
      break;
    case Method::Smooth:
      find_smooth(shell, centre, radius);
      break;
  }
  return contacts;
}

// The exact polyhedron: one contact at every local minimum of the distance over the surface.
// A face, an edge or a vertex holds one when the centre lies in its normal cone with respect to
// every triangle that meets there (the triangles are convex, so this is exact).
void Query::find_facets(const Shell& shell, const Vec3& centre, double radius) {
  faces_.clear(), edges_.clear(), vertices_.clear();
  const double tolerance = kTolerance * (shell.size() + radius);
  collect_claims(shell, centre, radius, tolerance);
  if (faces_.empty() && edges_.empty() && vertices_.empty()) return;
  drop_claims_of_neighbours(shell);
  claims_to_contacts(shell, centre, radius);
  if (contacts.size() > 1) {
    const double same = kSamePoint * radius + 16 * tolerance;
    merge_equal_points(same);
    drop_crossed(shell, centre, same);
  }
  if (shell.side() != Side::Both && !contacts.empty()) keep_one_side(shell, centre, radius);
  // Deepest first: the order must not depend on the numbering of the elements.
  if (contacts.size() > 1)
    std::sort(contacts.begin(), contacts.end(), [](const Contact& a, const Contact& b) {
      return a.depth != b.depth ? a.depth > b.depth : a.element < b.element;
    });
}

// Fills reached_ and near_, unless they still hold from an earlier call.
void Query::gather(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                   const Vec3& centre, double radius) {
  double margin = 0;
  if (follow_) {
    const bool same = followed_ == &shell && followed_radius_ == radius;
    const double moved = same ? (centre - last_).norm() : radius;
    last_ = centre;
    if (same && (centre - anchor_).squaredNorm() <= margin_ * margin_) return;
    // A slow sphere stays near for many calls; for a fast one a wider ball does not pay.
    if (moved < 0.01 * radius) margin = std::clamp(16 * moved, 1e-3 * radius, 0.1 * radius);
    followed_ = &shell;
    followed_radius_ = radius;
    anchor_ = centre;
    margin_ = margin;
  }
  reached_.clear();
  const NormalCone* all = cones.data();
  shell.bvh().near(centre, radius + margin + bulge, reached_, [all](int first) {
    prefetch(all + first);
    prefetch(all + first + 3);
  });
  keep_in_cone(shell, cones, centre, radius, margin, bulge);
}

// Leaves in near_ the facets that may hold a contact: the centre may stand inside the cone of
// normals of the features that they decide about (Johnson and Cohen 2001), wherever it is within
// the margin and however far within it the element bulges from its triangle.
void Query::keep_in_cone(const Shell& shell, const LargeArray<NormalCone>& cones,
                         const Vec3& centre, double radius, double margin, double bulge) {
  const Facet* facets = shell.facets().data();
  const Vec3 local = centre - shell.origin();
  const float c[3] = {float(local.x()), float(local.y()), float(local.z())};
  const float near = 1e-6f * (float(shell.size()) + float(radius)) + 1.000001f * float(margin);
  const float slack = near + 1.000001f * float(bulge);
  near_.clear();
  for (int f : reached_) {
    const NormalCone& cone = cones[f];
    const float x = c[0] - cone.middle[0], y = c[1] - cone.middle[1], z = c[2] - cone.middle[2];
    const float height = std::abs(x * cone.axis[0] + y * cone.axis[1] + z * cone.axis[2]);
    const float allowed = cone.reach + slack + (height + slack) * cone.tan_opening;
    const float square = x * x + y * y + z * z;
    // The ball of a cone holds all of a bent element.
    const float farthest = float(radius) * 1.000001f + cone.reach + near;
    if (square * 0.999999f > farthest * farthest) continue;
    if (square * 0.999999f - height * height > allowed * allowed) continue;
    prefetch(&facets[f]);
    prefetch(reinterpret_cast<const char*>(&facets[f]) + 64);
    near_.push_back(f);
  }
}

void Query::collect_claims(const Shell& shell, const Vec3& centre, double radius,
                           double tolerance) {
  const double tolerance2 = tolerance * tolerance;
  const double reach2 = radius * radius;
  const double wide_reach2 = reach2 * (1 + 1e-12);
  gather(shell, shell.cones(), 0, centre, radius);
  for (int f : near_) {
    const Facet& facet = shell.facets()[f];
    const double height = facet.normal.dot(centre - facet.corner[0]);
    if (height * height >= wide_reach2) continue;
    SideTest side[3];
    bool inside = true;
    for (int k = 0; k < 3; ++k) {
      side[k] = test_side(facet, k, centre, tolerance2);
      inside = inside && !side[k].beyond;
    }
    if (inside) faces_.push_back({f});
    for (int k = 0; k < 3; ++k) {
      if (facet.owned.twin[k] != kNotMine && side[k].not_within && !side[k].past_first &&
          !side[k].past_second) {
        const Vec3& a = facet.corner[k];
        const Vec3 foot = a + side[k].t * (facet.corner[next_corner(k)] - a);
        if ((centre - foot).squaredNorm() < reach2 &&
            edge_is_minimum(shell, facet.owned.twin[k], centre, tolerance2)) {
          const Triangle& t = shell.triangles()[shell.triangle_of_facet(f)];
          edges_.push_back({f, k, t[k], t[next_corner(k)]});
        }
      }
      if (facet.owned.vertex[k] >= 0 && side[k].before && side[previous_corner(k)].after &&
          (centre - facet.corner[k]).squaredNorm() < reach2 &&
          vertex_is_minimum(shell, facet.owned.vertex[k], centre, tolerance))
        vertices_.push_back({f, facet.owned.vertex[k]});
    }
  }
}

// A facet is convex: where its face holds the nearest point, its own edges and corners cannot, and
// likewise an edge and its ends. Both claim only within round-off of their common border.
void Query::drop_claims_of_neighbours(const Shell& shell) {
  if (edges_.empty() && vertices_.empty()) return;
  taken_edges_.clear();
  taken_vertices_.clear();
  for (const FaceClaim& face : faces_) {
    const Triangle& t = shell.triangles()[shell.triangle_of_facet(face.facet)];
    for (int k = 0; k < 3; ++k) {
      taken_edges_.push_back(std::minmax(t[k], t[next_corner(k)]));
      taken_vertices_.push_back(t[k]);
    }
  }
  std::sort(taken_edges_.begin(), taken_edges_.end());
  const auto edge_taken = [&](const EdgeClaim& e) {
    return std::binary_search(taken_edges_.begin(), taken_edges_.end(),
                              std::pair<int, int>(std::minmax(e.from, e.to)));
  };
  edges_.erase(std::remove_if(edges_.begin(), edges_.end(), edge_taken), edges_.end());
  for (const EdgeClaim& e : edges_) {
    taken_vertices_.push_back(e.from);
    taken_vertices_.push_back(e.to);
  }
  std::sort(taken_vertices_.begin(), taken_vertices_.end());
  const auto vertex_taken = [&](const VertexClaim& v) {
    return std::binary_search(taken_vertices_.begin(), taken_vertices_.end(), v.vertex);
  };
  vertices_.erase(std::remove_if(vertices_.begin(), vertices_.end(), vertex_taken),
                  vertices_.end());
}

void Query::claims_to_contacts(const Shell& shell, const Vec3& centre, double radius) {
  const Topology& topology = shell.topology();
  const bool one_sided = shell.side() != Side::Both;
  carriers_.clear();
  // A planar face has one foot point, whichever of its facets claim it.
  const LargeArray<Facet>& facets = shell.facets();
  std::sort(faces_.begin(), faces_.end(), [&](const FaceClaim& x, const FaceClaim& y) {
    const Facet &a = facets[x.facet], &b = facets[y.facet];
    return a.planar_face != b.planar_face ? a.planar_face < b.planar_face : a.element < b.element;
  });
  for (std::size_t i = 0; i < faces_.size(); ++i) {
    const Facet& facet = facets[faces_[i].facet];
    if (i > 0 && facets[faces_[i - 1].facet].planar_face == facet.planar_face) continue;
    const double height = facet.normal.dot(centre - facet.corner[0]);
    if (std::abs(height) >= radius) continue;
    const Vec3 normal = height < 0 ? Vec3(-facet.normal) : facet.normal;
    contacts.push_back({centre - height * facet.normal, normal, radius - std::abs(height),
                        facet.element, Feature::Face});
    if (turns_) contacts.back().turn.setZero();
    if (one_sided) carriers_.push_back({facet.normal, false});
  }
  for (const EdgeClaim& claim : edges_) {
    const Facet& facet = shell.facets()[claim.facet];
    const Vec3& a = facet.corner[claim.side];
    const Vec3 along = facet.corner[next_corner(claim.side)] - a;
    const double t = std::clamp((centre - a).dot(along) / along.squaredNorm(), 0.0, 1.0);
    const Vec3 point = a + t * along;
    const int h = 3 * shell.triangle_of_facet(claim.facet) + claim.side;
    const Edge& edge = topology.edges[topology.edge_of[h]];
    contacts.push_back(
        contact_at(point, facet.normal, centre, radius, facet.element, Feature::Edge));
    if (turns_)
      contacts.back().turn =
          turn_of(contacts.back(), radius, along * along.transpose() / along.squaredNorm());
    contacts.back().rim = edge.on_rim();
    if (one_sided) carriers_.push_back({topology.edge_normal(edge), edge.on_rim()});
  }
  for (const VertexClaim& claim : vertices_) {
    const Vec3& point = shell.vertices()[claim.vertex];
    const Facet& facet = shell.facets()[claim.facet];
    contacts.push_back(
        contact_at(point, facet.normal, centre, radius, facet.element, Feature::Vertex));
    if (turns_) contacts.back().turn = turn_of(contacts.back(), radius, Mat3::Zero());
    contacts.back().rim = topology.vertex_on_rim[claim.vertex];
    if (one_sided)
      carriers_.push_back(
          {topology.vertex_normal[claim.vertex], bool(topology.vertex_on_rim[claim.vertex])});
  }
}

// Keeps the contacts (and their carriers) that are not marked in dropped_.
void Query::remove_dropped() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (dropped_[i]) continue;
    contacts[kept] = contacts[i];
    if (!carriers_.empty()) carriers_[kept] = carriers_[i];
    ++kept;
  }
  contacts.resize(kept);
  if (!carriers_.empty()) carriers_.resize(kept);
}

// The simplest feature wins (face, edge, vertex: the order in which contacts were made).
void Query::merge_equal_points(double tolerance) {
  by_x_.resize(contacts.size());
  std::iota(by_x_.begin(), by_x_.end(), 0);
  const auto x = [&](int i) { return contacts[i].point.x(); };
  std::sort(by_x_.begin(), by_x_.end(), [&](int i, int j) { return x(i) < x(j); });
  dropped_.assign(contacts.size(), 0);
  for (std::size_t a = 0; a < by_x_.size(); ++a)
    for (std::size_t b = a + 1; b < by_x_.size() && x(by_x_[b]) - x(by_x_[a]) <= tolerance; ++b) {
      const auto [first, second] = std::minmax(by_x_[a], by_x_[b]);
      Contact& kept = contacts[first];
      if ((kept.point - contacts[second].point).squaredNorm() > tolerance * tolerance) continue;
      kept.element = std::min(kept.element, contacts[second].element);
      dropped_[second] = 1;
    }
  remove_dropped();
}

// Elements may overlap or cross without sharing an edge. Where another one passes through a contact
// point and comes nearer to the centre, the distance has no minimum there. The deepest contact is
// the nearest point of all, so a single one needs no such test.
void Query::drop_crossed(const Shell& shell, const Vec3& centre, double tolerance) {
  if (contacts.size() < 2) return;
  const auto crossed = [&](const Vec3& point, const std::vector<int>& facets) {
    const double nearer = std::max(0.0, (centre - point).norm() - tolerance);
    return std::any_of(facets.begin(), facets.end(), [&](int f) {
      const Facet& facet = shell.facets()[f];
      if (std::abs(facet.normal.dot(point - facet.corner[0])) > tolerance) return false;
      const Vec3 here = closest_on_triangle(point, facet.corner, facet.normal).point;
      if ((point - here).squaredNorm() > tolerance * tolerance) return false;
      const Vec3 best = closest_on_triangle(centre, facet.corner, facet.normal).point;
      return (centre - best).squaredNorm() < nearer * nearer;
    });
  };
  // With many facets at hand it is cheaper to ask the tree for those at each point.
  const bool ask = reached_.size() > 256;
  dropped_.assign(contacts.size(), 0);
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (ask) {
      at_point_.clear();
      shell.bvh().near(contacts[i].point, 2 * tolerance, at_point_, [](int) {});
    }
    dropped_[i] = crossed(contacts[i].point, ask ? at_point_ : reached_);
  }
  remove_dropped();
}

// side = outside | inside: the nearest contact tells on which side the centre is. On the right side
// count the contacts whose feature faces the centre; on the wrong side the sphere is pushed back
// out through the nearest point.
void Query::keep_one_side(const Shell& shell, const Vec3& centre, double radius) {
  const double sign = shell.side() == Side::Outside ? 1.0 : -1.0;
  const auto faces_centre = [&](std::size_t i) {
    return carriers_[i].rim || sign * carriers_[i].outward.dot(centre - contacts[i].point) >= 0;
  };
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < contacts.size(); ++i)
    if (contacts[i].depth > contacts[nearest].depth) nearest = i;
  if (faces_centre(nearest)) {
    dropped_.resize(contacts.size());
    for (std::size_t i = 0; i < contacts.size(); ++i) dropped_[i] = !faces_centre(i);
    remove_dropped();
    for (std::size_t i = 0; i < contacts.size(); ++i)
      if (contacts[i].depth == radius)
        contacts[i].normal = sign * carriers_[i].outward.normalized();
    return;
  }
  Contact out = contacts[nearest];
  out.normal = -out.normal;
  out.turn = -out.turn;
  out.depth = 2 * radius - out.depth;
  contacts.assign(1, out);
}

// The paper's sum: every element within reach counts, at its closest point.
void Query::find_elements(const Shell& shell, const Vec3& centre, double radius) {
  const double reach2 = radius * radius;
  const std::vector<int>& element = shell.element();
  const auto closest = [&](int t) {
    const Vec3 corner[3] = {shell.vertices()[shell.triangles()[t][0]],
                            shell.vertices()[shell.triangles()[t][1]],
                            shell.vertices()[shell.triangles()[t][2]]};
    return closest_on_triangle(centre, corner, shell.topology().face_normal[t]);
  };
  const int last = static_cast<int>(element.size()) - 1;
  const auto speaks = [&](int t, double d2) {
    // The other triangle of a quad speaks for the element where it is nearer.
    for (int u : {t - 1, t + 1}) {
      if (u < 0 || u > last || element[u] != element[t]) continue;
      const double other2 = (centre - closest(u).point).squaredNorm();
      if (other2 < d2 || (other2 == d2 && u < t)) return false;
    }
    return true;
  };
  gather(shell, shell.cones(), 0, centre, radius);
  for (int f : reached_) {
    const int t = shell.triangle_of_facet(f);
    const ClosestPoint at = closest(t);
    const double d2 = (centre - at.point).squaredNorm();
    if (d2 >= reach2 || !speaks(t, d2)) continue;
    Feature feature = at.feature >= 4   ? Feature::Vertex
                      : at.feature >= 1 ? Feature::Edge
                                        : Feature::Face;
    const Topology& topology = shell.topology();
    if (feature == Feature::Edge && topology.edges[topology.edge_of[3 * t + at.feature - 1]].inner)
      feature = Feature::Face;
    const Vec3& normal = topology.face_normal[t];
    const double height = normal.dot(centre - at.point);
    if (shell.side() == Side::Outside && height < 0) continue;
    if (shell.side() == Side::Inside && height > 0) continue;
    contacts.push_back({at.point, direction(at.point, centre, normal), radius - std::sqrt(d2),
                        element[t], feature});
  }
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& a, const Contact& b) { return a.element < b.element; });
}

}  // namespace sphshell
