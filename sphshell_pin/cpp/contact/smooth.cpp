// Contacts with curved elements: minima of the distance, and saddles within an element.
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "contact/feet.hpp"
#include "contact/query.hpp"
#include "contact/regions.hpp"
#include "shell/curved.hpp"
#include "shell/triangle.hpp"

namespace sphshell {
namespace {

// The unit tangent that leaves half-edge h's side at its parameter t at a right angle, inward.
Vec3 inward_of(const Shell& shell, int h, double t, const Vec3& along) {
  const int f = triangle_of(h), k = side_of(h);
  const Vec3 inward = shell.curved()->facets()[f].patch(shell.facets()[f]).inward(k, t);
  return (inward - inward.dot(along) * along).normalized();
}

// The parameters u, v of a facet at t on its side k.
std::pair<double, double> on_side(int k, double t) {
  return k == 0 ? std::pair(t, 0.0) : k == 1 ? std::pair(1 - t, t) : std::pair(0.0, 1 - t);
}

// True where an element that the sphere reaches may bend as much as it: its bulge is about an
// eighth of the square of its side by its radius of curvature.
bool is_bent(const Shell& shell, int f, const Vec3& centre, double radius) {
  const Facet& facet = shell.facets()[f];
  const double bulge = shell.curved()->facets()[f].bulge;
  double length2 = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k)
    length2 = std::min(length2, (facet.corner[next_corner(k)] - facet.corner[k]).squaredNorm());
  if (16 * bulge * radius <= length2) return false;
  const Vec3 flat = closest_on_triangle(centre, facet.corner, facet.normal).point;
  return (flat - centre).squaredNorm() < (radius + bulge) * (radius + bulge);
}

}  // namespace

void Query::find_smooth(const Shell& shell, const Vec3& centre, double radius) {
  const double tolerance = kTolerance * (shell.size() + radius);
  carriers_.clear();
  holder_.clear();
  saddles_.clear();
  claim_on_patches(shell, centre, radius, tolerance);
  if (contacts.empty()) claim_nearest(shell, centre, radius);
  if (contacts.empty()) return;
  if (contacts.size() > 1) join_minima(shell, centre, radius);
  if (shell.side() != Side::Both) keep_one_side(shell, centre, radius);
}

// Every minimum of the distance. Whether a vertex or an edge holds one is decided from the elements
// that meet there.
void Query::claim_on_patches(const Shell& shell, const Vec3& centre, double radius,
                             double tolerance) {
  const CurvedShell& surface = *shell.curved();
  gather(shell, surface.cones(), surface.bulge(), centre, radius);
  over_.clear();
  for (int f : near_) {
    const Facet& facet = shell.facets()[f];
    Shadow shadow;
    shadow.facet = f;
    shadow.height = facet.normal.dot(centre - facet.corner[0]);
    shadow.opening = surface.cones()[f].tan_opening;
    shadow.allow(surface.bulge(), tolerance);
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = facet.corner[next_corner(k)] - facet.corner[k];
      shadow.inward[k] = facet.normal.dot(edge.cross(centre - facet.corner[k]));
      shadow.length2[k] = edge.squaredNorm();
    }
    if (shadow.beyond(0) || shadow.beyond(1) || shadow.beyond(2)) continue;
    for (int line = 0; line < int(sizeof(CurvedFacet)); line += 64)
      prefetch(reinterpret_cast<const char*>(&surface.facets()[f]) + line);
    over_.push_back(shadow);
  }
  for (Shadow& shadow : over_) {
    const Facet& facet = shell.facets()[shadow.facet];
    const CurvedFacet& curved = surface.facets()[shadow.facet];
    shadow.allow(curved.bulge, tolerance);
    if (shadow.beyond(0) || shadow.beyond(1) || shadow.beyond(2)) continue;
    if (curved.flat)
      claim_flat(shell, shadow, centre, radius, tolerance);
    else
      claim_curved(shell, shadow, centre, radius);
    for (int k = 0; k < 3; ++k) {
      if (curved.owned.twin[k] != kNotMine && shadow.near_side(k))
        claim_edge(shell, shadow.facet, k, centre, radius, tolerance);
      if (curved.owned.vertex[k] >= 0 && shadow.near_side(k) &&
          shadow.near_side(previous_corner(k)) &&
          (centre - facet.corner[k]).squaredNorm() < radius * radius)
        claim_vertex(shell, shadow.facet, k, centre, radius, tolerance);
    }
  }
}

void Query::claim_flat(const Shell& shell, const Shadow& shadow, const Vec3& centre, double radius,
                       double tolerance) {
  const Facet& facet = shell.facets()[shadow.facet];
  if (std::abs(shadow.height) >= radius) return;
  for (int k = 0; k < 3; ++k)
    if (test_side(facet, k, centre, tolerance * tolerance).beyond) return;
  contacts.push_back({centre - shadow.height * facet.normal,
                      shadow.height < 0 ? Vec3(-facet.normal) : facet.normal,
                      radius - std::abs(shadow.height), facet.element, Feature::Face});
  if (turns_) contacts.back().turn.setZero();
  holder_.push_back(shadow.facet);
  if (shell.side() != Side::Both) carriers_.push_back({facet.normal, false});
}

void Query::claim_curved(const Shell& shell, const Shadow& shadow, const Vec3& centre,
                         double radius) {
  const Facet& facet = shell.facets()[shadow.facet];
  const CubicPatch patch = shell.curved()->facets()[shadow.facet].patch(facet);
  // One foot; or several, and saddles, where the element bends more than the sphere.
  feet_.clear();
  PatchPoint foot;
  bool convex;
  const auto look_from = [&](const std::pair<double, double>& start, Stationary kind) {
    if (!foot_on_patch(patch, centre, start, kind, foot, convex)) return;
    for (const auto& [known, of] : feet_)
      if (std::abs(known.u - foot.u) + std::abs(known.v - foot.v) < 1e-6) return;
    feet_.push_back({foot, kind});
  };
  look_from(start_on(facet, centre), Stationary::Minimum);
  constexpr std::pair<double, double> kStarts[] = {
      {0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0, 0.5}, {0.5, 0.5}, {1.0 / 3, 1.0 / 3}};
  const auto convex_at = [&](const std::pair<double, double>& at) {
    return is_convex_at(patch, at.first, at.second, centre);
  };
  if (is_bent(shell, shadow.facet, centre, radius) &&
      !std::all_of(std::begin(kStarts), std::end(kStarts), convex_at))
    for (const auto& start : kStarts)
      for (Stationary kind : {Stationary::Minimum, Stationary::Saddle}) look_from(start, kind);
  for (const auto& [at, kind] : feet_) {
    if ((centre - at.point).squaredNorm() >= radius * radius) continue;
    const Vec3 outward = patch.along_u(at.u, at.v).cross(patch.along_v(at.u, at.v));
    Contact contact =
        contact_at(at.point, outward.normalized(), centre, radius, facet.element, Feature::Face);
    if (turns_) contact.turn = turn_of(contact, radius, slide_of(patch, at.u, at.v, centre));
    if (kind == Stationary::Minimum)
      add_minimum(shell, contact, shadow.facet, {outward, false});
    else
      saddles_.push_back({{contact,
                           {outward, false},
                           shadow.facet,
                           0,
                           contact.normal,
                           contact.depth,
                           contact.turn},
                          downhill(patch, at, centre)});
  }
}

void Query::claim_edge(const Shell& shell, int f, int k, const Vec3& centre, double radius,
                       double tolerance) {
  const Facet& facet = shell.facets()[f];
  const CubicCurve side = shell.curved()->facets()[f].side(facet, k);
  const Vec3 d = facet.corner[next_corner(k)] - facet.corner[k];
  double t = std::clamp((centre - facet.corner[k]).dot(d) / d.squaredNorm(), 0.0, 1.0);
  const auto convex_at = [&](double at) {
    return side.tangent(at).squaredNorm() + (side.point(at) - centre).dot(side.second(at)) > 0;
  };
  if (!is_bent(shell, f, centre, radius) || (convex_at(0) && convex_at(0.5) && convex_at(1))) {
    if (foot_on_side(side, centre, t)) claim_on_side(shell, f, k, t, centre, radius, tolerance);
    return;
  }
  double known[5];
  int count = 0;
  for (int i = 0; i < 5; ++i) {
    t = 0.25 * i;
    if (!foot_on_side(side, centre, t)) continue;
    const auto same = [&](double other) { return std::abs(other - t) < 1e-6; };
    if (std::any_of(known, known + count, same)) continue;
    known[count++] = t;
    claim_on_side(shell, f, k, t, centre, radius, tolerance);
  }
}

void Query::claim_on_side(const Shell& shell, int f, int k, double t, const Vec3& centre,
                          double radius, double tolerance) {
  const Facet& facet = shell.facets()[f];
  const CubicCurve side = shell.curved()->facets()[f].side(facet, k);
  const Vec3 point = side.point(t), along = side.tangent(t).normalized();
  if ((centre - point).squaredNorm() >= radius * radius) return;
  const auto rises = [&](int h) {
    const Facet& other = shell.facets()[triangle_of(h)];
    const CurvedFacet& beyond = shell.curved()->facets()[triangle_of(h)];
    const double s = other.corner[side_of(h)] == facet.corner[k] ? t : 1 - t;
    const double fall = (centre - point).dot(inward_of(shell, h, s, along));
    if (fall > tolerance) return false;
    // Where the element goes on level, its curvature decides.
    const double level = 4 * kOverlap * (facet.corner[next_corner(k)] - facet.corner[k]).norm();
    if (fall < -level || beyond.flat) return true;
    const auto [u, v] = on_side(side_of(h), s);
    return is_convex_at(beyond.patch(other), u, v, centre);
  };
  const int code = shell.curved()->facets()[f].owned.twin[k];
  if (!rises(3 * f + k) || (code >= 0 && !rises(code))) return;
  if (code <= kManifold) {
    const std::vector<int>& all = shell.half_edges_of(kManifold - code);
    if (!std::all_of(all.begin(), all.end(), rises)) return;
  }
  Contact contact = contact_at(point, facet.normal, centre, radius, facet.element, Feature::Edge);
  if (turns_) contact.turn = turn_of(contact, radius, slide_of(side, t, centre));
  const Topology& topology = shell.topology();
  const Edge& edge = topology.edges[topology.edge_of[3 * shell.triangle_of_facet(f) + k]];
  add_minimum(shell, contact, f, {topology.edge_normal(edge), edge.on_rim()});
}

void Query::claim_vertex(const Shell& shell, int f, int k, const Vec3& centre, double radius,
                         double tolerance) {
  const CurvedShell& surface = *shell.curved();
  const Topology& topology = shell.topology();
  const Facet& facet = shell.facets()[f];
  const int vertex = surface.facets()[f].owned.vertex[k];
  const Vec3 from = centre - facet.corner[k];
  // No direction between two edges leads lower than both: their angle is below 180 degrees.
  for (int i = topology.neighbour_begin[vertex]; i < topology.neighbour_begin[vertex + 1]; ++i)
    if (from.dot(surface.tangents()[i]) > tolerance * surface.tangents()[i].norm()) return;
  for (int c : surface.corners_of(vertex)) {
    const Facet& other = shell.facets()[triangle_of(c)];
    const CurvedFacet& curved = surface.facets()[triangle_of(c)];
    if (curved.flat) continue;
    const int j = side_of(c);
    const Vec3 out = curved.side(other, j).tangent(0);
    const Vec3 in = curved.side(other, previous_corner(j)).tangent(1);
    const auto level = [&](const Vec3& tangent) {
      return std::abs(from.dot(tangent)) < 4 * kOverlap * tangent.squaredNorm();
    };
    if (!level(out) || !level(in)) continue;
    const auto [u, v] = on_side(j, 0);
    if (!is_convex_at(curved.patch(other), u, v, centre)) return;
  }
  Contact contact =
      contact_at(facet.corner[k], facet.normal, centre, radius, facet.element, Feature::Vertex);
  if (turns_) contact.turn = turn_of(contact, radius, Mat3::Zero());
  add_minimum(shell, contact, f,
              {topology.vertex_normal[vertex], bool(topology.vertex_on_rim[vertex])});
}

// Where the centre is nearly as far from a whole piece of the surface, as in a socket of the
// sphere's own size, round-off hides the minimum: the nearest place is the contact.
void Query::claim_nearest(const Shell& shell, const Vec3& centre, double radius) {
  const CurvedShell& surface = *shell.curved();
  double nearest = radius;
  Contact contact{};
  Carrier carrier{};
  int holder = -1;
  for (int f : near_) {
    const Facet& facet = shell.facets()[f];
    const Vec3 flat = closest_on_triangle(centre, facet.corner, facet.normal).point;
    if ((flat - centre).norm() > nearest + surface.facets()[f].bulge) continue;
    const CubicPatch patch = surface.facets()[f].patch(facet);
    const PatchPoint at = nearest_on_patch(patch, centre);
    const double distance = (at.point - centre).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    holder = f;
    const Vec3 outward = patch.along_u(at.u, at.v).cross(patch.along_v(at.u, at.v));
    contact =
        contact_at(at.point, outward.normalized(), centre, radius, facet.element, Feature::Face);
    // The foot slides ahead of the centre without bound here, as good as not at all.
    if (turns_) contact.turn = turn_of(contact, radius, Mat3::Zero());
    carrier = carrier_at(shell, f, at, outward);
  }
  if (nearest < radius) add_minimum(shell, contact, holder, carrier);
}

// What tells outside from inside at a place of facet f: its own normal `outward`, but on a side or
// in a corner those of all elements that meet there.
Query::Carrier Query::carrier_at(const Shell& shell, int f, const PatchPoint& at,
                                 const Vec3& outward) {
  constexpr double kBorder = 1e-6;
  const Topology& topology = shell.topology();
  const int t = shell.triangle_of_facet(f);
  const bool on[3] = {at.v < kBorder, at.u + at.v > 1 - kBorder, at.u < kBorder};
  for (int k = 0; k < 3; ++k) {
    if (!on[k] || !on[previous_corner(k)]) continue;
    const int vertex = shell.triangles()[t][k];
    return {topology.vertex_normal[vertex], bool(topology.vertex_on_rim[vertex])};
  }
  for (int k = 0; k < 3; ++k) {
    if (!on[k]) continue;
    const Edge& edge = topology.edges[topology.edge_of[3 * t + k]];
    return {topology.edge_normal(edge), edge.on_rim()};
  }
  return {outward, false};
}

void Query::add_minimum(const Shell& shell, const Contact& contact, int facet,
                        const Carrier& carrier) {
  contacts.push_back(contact);
  contacts.back().rim = carrier.rim;
  holder_.push_back(facet);
  if (shell.side() != Side::Both) carriers_.push_back(carrier);
}

}  // namespace sphshell
