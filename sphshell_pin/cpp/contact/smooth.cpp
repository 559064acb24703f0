// Contacts with curved elements: what is stationary about the distance to a surface of patches.
#include <algorithm>
#include <cmath>
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

}  // namespace

void Query::find_smooth(const Shell& shell, const Vec3& centre, double radius) {
  const double tolerance = kTolerance * (shell.size() + radius);
  carriers_.clear();
  carrier_face_.clear();
  passes_.clear();
  legs_.clear();
  claim_on_patches(shell, centre, radius, tolerance);
  if (contacts.empty()) claim_nearest(shell, centre, radius);
  if (contacts.empty()) return;
  if (contacts.size() > 1) join_minima(shell, centre, radius);
  if (shell.side() != Side::Both) keep_one_side(shell, centre, radius);
}

// Every minimum of the distance, and every pass from one to another: a place where the distance
// falls on two sides and rises between them (Milnor, Morse Theory (1963), for piecewise smooth
// surfaces). Whether a vertex or an edge is one is decided from the directions that leave it.
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
  carrier_face_.push_back(facet.planar_face);
  if (shell.side() != Side::Both) carriers_.push_back({facet.normal, false});
}

void Query::claim_curved(const Shell& shell, const Shadow& shadow, const Vec3& centre,
                         double radius) {
  const Facet& facet = shell.facets()[shadow.facet];
  const CubicPatch patch = shell.curved()->facets()[shadow.facet].patch(facet);
  PatchPoint foot;
  bool convex;
  const bool minimum = foot_on_patch(facet, patch, centre, Stationary::Minimum, foot, convex);
  // A saddle needs a surface that is more curved than the sphere.
  if (!minimum &&
      (convex || !foot_on_patch(facet, patch, centre, Stationary::Saddle, foot, convex)))
    return;
  if ((centre - foot.point).squaredNorm() >= radius * radius) return;
  const Vec3 outward = patch.along_u(foot.u, foot.v).cross(patch.along_v(foot.u, foot.v));
  Contact contact =
      contact_at(foot.point, outward.normalized(), centre, radius, facet.element, Feature::Face);
  if (turns_) contact.turn = turn_of(contact, radius, slide_of(patch, foot.u, foot.v, centre));
  if (minimum) {
    add_minimum(shell, contact, kCurved, {outward, false});
  } else {
    const Vec3 leg = downhill(patch, foot, centre);
    add_pass(contact, {outward, false}, false, {{leg, shadow.facet}, {-leg, shadow.facet}});
  }
}

void Query::claim_edge(const Shell& shell, int f, int k, const Vec3& centre, double radius,
                       double tolerance) {
  const Facet& facet = shell.facets()[f];
  const CubicCurve side = shell.curved()->facets()[f].side(facet, k);
  double t = 0;
  bool summit = false;
  if (!foot_on_side(side, centre, t, summit)) return;
  const Vec3 point = side.point(t);
  if ((centre - point).squaredNorm() >= radius * radius) return;
  const Topology& topology = shell.topology();
  const Edge& edge = topology.edges[topology.edge_of[3 * shell.triangle_of_facet(f) + k]];
  const bool sharp = edge.kind != EdgeClass::Smooth;
  // Two elements that meet here claim their feet a little beyond the edge, so a pass is one with
  // that much to spare: where it leads to nowhere new it does not count.
  const double spare = 4 * kOverlap * (facet.corner[next_corner(k)] - facet.corner[k]).norm();
  std::size_t sides = 0;
  double steepest = -1;
  bool convex = true, bent = false;
  exits_.clear();
  const Vec3 along = side.tangent(t).normalized();
  const auto look = [&](int h) {
    const Facet& other = shell.facets()[triangle_of(h)];
    const bool same_way = other.corner[side_of(h)] == facet.corner[k];
    const Vec3 inward = inward_of(shell, h, same_way ? t : 1 - t, along);
    const double fall = (centre - point).dot(inward);
    const CurvedFacet& beyond = shell.curved()->facets()[triangle_of(h)];
    bent = bent || !beyond.flat;
    steepest = sides == 0 ? fall : std::max(steepest, fall);
    ++sides;
    if (fall <= -spare) return;
    exits_.push_back({inward, triangle_of(h)});
    // Where the element goes on level, its curvature decides.
    if (fall > spare || beyond.flat || !convex) return;
    const auto [u, v] = on_side(side_of(h), same_way ? t : 1 - t);
    convex = is_convex_at(beyond.patch(other), u, v, centre);
  };
  const int code = shell.curved()->facets()[f].owned.twin[k];
  look(3 * f + k);
  if (code >= 0) look(code);
  if (code <= kManifold) {
    sides = 0;
    exits_.clear();
    for (int h : shell.half_edges_of(kManifold - code)) look(h);
  }
  const bool minimum = !summit && convex && steepest <= tolerance;
  if (summit && steepest <= tolerance) {
    exits_ = {{along, f}, {-along, f}};
  }
  const bool pass = summit ? steepest <= tolerance : exits_.size() >= 2;
  if (!minimum && !pass) return;
  Contact contact = contact_at(point, facet.normal, centre, radius, facet.element, Feature::Edge);
  if (turns_) contact.turn = turn_of(contact, radius, slide_of(side, t, centre));
  const Carrier carrier = {topology.edge_normal(edge), edge.on_rim()};
  if (minimum) add_minimum(shell, contact, sharp || !bent ? kSharp : kCurved, carrier);
  if (pass) add_pass(contact, carrier, sharp, exits_);
}

// The directions downhill from a vertex, seen as a circle, make arcs; their number is that of the
// falling edges less that of the elements between two of them (both ends falling, so is all
// between: their angle is below 180 degrees). No arc: a minimum; two or more: a pass.
void Query::claim_vertex(const Shell& shell, int f, int k, const Vec3& centre, double radius,
                         double tolerance) {
  const CurvedShell& surface = *shell.curved();
  const Topology& topology = shell.topology();
  const Facet& facet = shell.facets()[f];
  const int vertex = surface.facets()[f].owned.vertex[k];
  const Vec3 from = centre - facet.corner[k];
  const bool sharp = topology.vertex_sharp[vertex];
  // Nearly level edges count as falling, or as rising: a pass is what is one either way.
  const auto falls = [&](const Vec3& tangent, bool if_level) {
    const double fall = from.dot(tangent), spare = 4 * kOverlap * tangent.squaredNorm();
    return if_level ? fall > -spare : fall > spare;
  };
  bool minimum = true, bent = false;
  std::size_t falling[2] = {0, 0}, joined[2] = {0, 0};
  for (int i = topology.neighbour_begin[vertex]; i < topology.neighbour_begin[vertex + 1]; ++i) {
    const Vec3& tangent = surface.tangents()[i];
    for (bool level : {false, true}) falling[level] += falls(tangent, level);
    minimum = minimum && from.dot(tangent) <= tolerance * tangent.norm();
  }
  if (!minimum && falling[true] < 2) return;
  exits_.clear();
  for (int c : surface.corners_of(vertex)) {
    const Facet& other = shell.facets()[triangle_of(c)];
    const CurvedFacet& curved = surface.facets()[triangle_of(c)];
    const int j = side_of(c), last = previous_corner(j);
    const Vec3 out = curved.side(other, j).tangent(0), in = -curved.side(other, last).tangent(1);
    bent = bent || !curved.flat;
    if (minimum) {
      if (!falls(out, true) || !falls(in, true) || curved.flat) continue;
      const auto [u, v] = on_side(j, 0);
      if (!is_convex_at(curved.patch(other), u, v, centre)) return;
    } else {
      for (bool level : {false, true}) joined[level] += falls(out, level) && falls(in, level);
      if (falls(out, true)) exits_.push_back({out.normalized(), triangle_of(c)});
      if (falls(in, true)) exits_.push_back({in.normalized(), triangle_of(c)});
    }
  }
  if (!minimum && falling[false] < joined[false] + 2 && falling[true] < joined[true] + 2) return;
  Contact contact =
      contact_at(facet.corner[k], facet.normal, centre, radius, facet.element, Feature::Vertex);
  if (turns_) contact.turn = turn_of(contact, radius, Mat3::Zero());
  const Carrier carrier = {topology.vertex_normal[vertex], bool(topology.vertex_on_rim[vertex])};
  if (minimum)
    add_minimum(shell, contact, sharp || !bent ? kSharp : kCurved, carrier);
  else
    add_pass(contact, carrier, sharp, exits_);
}

// Where the centre is nearly as far from a whole piece of the surface, as in a socket of the
// sphere's own size, round-off hides the minimum: the nearest place is the contact.
void Query::claim_nearest(const Shell& shell, const Vec3& centre, double radius) {
  const CurvedShell& surface = *shell.curved();
  double nearest = radius;
  Contact contact{};
  Carrier carrier{};
  for (int f : near_) {
    const Facet& facet = shell.facets()[f];
    const Vec3 flat = closest_on_triangle(centre, facet.corner, facet.normal).point;
    if ((flat - centre).norm() > nearest + surface.bulge()) continue;
    const CubicPatch patch = surface.facets()[f].patch(facet);
    const PatchPoint at = nearest_on_patch(patch, centre);
    const double distance = (at.point - centre).norm();
    if (distance >= nearest) continue;
    nearest = distance;
    const Vec3 outward = patch.along_u(at.u, at.v).cross(patch.along_v(at.u, at.v));
    contact =
        contact_at(at.point, outward.normalized(), centre, radius, facet.element, Feature::Face);
    // The foot slides ahead of the centre without bound here, as good as not at all.
    if (turns_) contact.turn = turn_of(contact, radius, Mat3::Zero());
    carrier = {outward, false};
  }
  if (nearest < radius) add_minimum(shell, contact, kCurved, carrier);
}

void Query::add_minimum(const Shell& shell, const Contact& contact, int carrier_face,
                        const Carrier& carrier) {
  contacts.push_back(contact);
  carrier_face_.push_back(carrier_face);
  if (shell.side() != Side::Both) carriers_.push_back(carrier);
}

void Query::add_pass(const Contact& contact, const Carrier& carrier, bool sharp,
                     const std::vector<Leg>& exits) {
  const int begin = static_cast<int>(legs_.size());
  legs_.insert(legs_.end(), exits.begin(), exits.end());
  passes_.push_back({contact, carrier, sharp, begin, static_cast<int>(legs_.size())});
}

}  // namespace sphshell
