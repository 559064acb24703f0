// Contacts that flow together: the sphere counts a piece of surface inside it once.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "contact/feet.hpp"
#include "contact/query.hpp"
#include "contact/regions.hpp"
#include "shell/curved.hpp"

namespace sphshell {
namespace {

// Two minima are one contact where the pass between them is no more than this share of its depth
// below both: what that changes of the force is the square of it. Between curved elements, which
// meet at small angles that nobody meant, the share is larger.
constexpr double kShallow = 1e-4, kShallowBent = 1e-2;
// ... and their normals differ from its by no more than this [rad].
constexpr double kAlike = 0.03;

}  // namespace

// The elastic potential of a sphere is the sum of U(depth) over the minima of the distance, less
// U(depth) of each pass that joins two of them: as much as U'(s) times the number of pieces that
// the surface has inside a sphere smaller by s, summed over s. Where a minimum ends it meets a
// pass, with the same depth and normal, so neither the potential nor the force jumps.
void Query::join_minima(const Shell& shell, const Vec3& centre, double radius) {
  list_minima(1e-8 * radius);
  if (rows_.size() > 1) {
    list_links(shell, centre, radius);
    join_over_links(shell, centre, radius);
  }
  contacts.clear();
  const bool one_sided = !carriers_.empty();
  carriers_.clear();
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    Row& row = rows_[i];
    if (row.merged != static_cast<int>(i)) continue;
    if (row.depth != row.contact.depth) {
      row.contact.depth = row.depth;
      row.contact.weight = row.normal.norm();
      row.contact.normal = row.normal / row.contact.weight;
      row.contact.point = centre - (radius - row.depth) * row.contact.normal;
      row.contact.turn = row.turn;
    }
    contacts.push_back(row.contact);
    if (one_sided) carriers_.push_back(row.carrier);
  }
}

// One row per place, deepest first.
void Query::list_minima(double same) {
  std::vector<int>& order = by_x_;
  order.resize(contacts.size());
  std::iota(order.begin(), order.end(), 0);
  const auto x = [&](int i) { return contacts[i].point.x(); };
  std::sort(order.begin(), order.end(), [&](int i, int j) { return x(i) < x(j); });
  const auto deeper = [&](int i, int j) {
    const Contact &a = contacts[i], &b = contacts[j];
    return a.depth != b.depth       ? a.depth > b.depth
           : a.feature != b.feature ? a.feature < b.feature
                                    : a.element < b.element;
  };
  dropped_.assign(contacts.size(), 0);
  for (std::size_t a = 0; a < order.size(); ++a)
    for (std::size_t b = a + 1; b < order.size() && x(order[b]) - x(order[a]) <= same; ++b) {
      const int i = order[a], j = order[b];
      if ((contacts[i].point - contacts[j].point).squaredNorm() <= same * same)
        dropped_[deeper(i, j) ? j : i] = 1;
    }
  std::sort(order.begin(), order.end(), deeper);
  rows_.clear();
  for (int i : order) {
    if (dropped_[i]) continue;
    const Contact& contact = contacts[i];
    const Carrier carrier = carriers_.empty() ? Carrier{Vec3::Zero(), false} : carriers_[i];
    rows_.push_back({contact, carrier, holder_[i], static_cast<int>(rows_.size()), contact.normal,
                     contact.depth, contact.turn});
  }
}

// The facets in reach, and an upper bound of the depth at which those that share a side touch.
void Query::list_links(const Shell& shell, const Vec3& centre, double radius) {
  const Topology& topology = shell.topology();
  nodes_.clear();
  const Vec3 local = centre - shell.origin();
  for (int f : reached_) {
    // The ball of a cone holds the whole element.
    const NormalCone& cone = shell.curved()->cones()[f];
    const Vec3 middle(cone.middle[0], cone.middle[1], cone.middle[2]);
    const double reach = (radius + cone.reach) * (1 + 1e-6) + 1e-6 * shell.size();
    if ((local - middle).squaredNorm() < reach * reach) nodes_.push_back(f);
  }
  std::sort(nodes_.begin(), nodes_.end());
  links_.clear();
  for (std::size_t i = 0; i < saddles_.size(); ++i)
    links_.push_back({saddles_[i].pass.depth, true, static_cast<int>(nodes_.size() + i),
                      node_of(saddles_[i].pass.facet), -1, static_cast<int>(i), 0});
  for (int f : nodes_) {
    const Facet& facet = shell.facets()[f];
    const CurvedFacet& curved = shell.curved()->facets()[f];
    const double reach = radius + curved.bulge;
    if (std::abs(facet.normal.dot(centre - facet.corner[0])) >= reach) continue;
    for (int k = 0; k < 3; ++k) {
      const int code = curved.owned.twin[k];
      if (code == kBoundary || (code == kNotMine && !curved.flat)) continue;
      const Vec3 d = facet.corner[next_corner(k)] - facet.corner[k];
      const double t = std::clamp((centre - facet.corner[k]).dot(d) / d.squaredNorm(), 0.0, 1.0);
      const double distance = (facet.corner[k] + t * d - centre).norm();
      if (distance >= reach) continue;
      const auto link_to = [&](int other) {
        links_.push_back({reach - distance, curved.flat, f, other, f, k, t});
      };
      if (code >= 0) {
        link_to(triangle_of(code));
      } else if (code <= kManifold) {
        for (int h : shell.half_edges_of(kManifold - code))
          if (triangle_of(h) != f) link_to(triangle_of(h));
      } else {
        // Between two facets of a plane nobody decides about the side.
        const Edge& edge = topology.edges[topology.edge_of[3 * shell.triangle_of_facet(f) + k]];
        for (int i = 0; i < edge.count; ++i) {
          const int g = triangle_of(shell.facet_half_edge(topology.incidence[edge.begin + i]));
          if (g > f && shell.facets()[g].planar_face == facet.planar_face) link_to(g);
        }
      }
    }
  }
}

// Puts the place of a link in place of its bound; false where the sphere does not reach it.
bool Query::settle(const Shell& shell, Link& link, const Vec3& centre, double radius) const {
  const Facet& facet = shell.facets()[link.facet];
  const CubicCurve side = shell.curved()->facets()[link.facet].side(facet, link.side);
  if (!link.exact) link.t = nearest_on_side(side, centre);
  const Vec3 point = side.point(link.t);
  link.depth = radius - (point - centre).norm();
  link.exact = true;
  link.a = node_of(link.a, point);
  link.b = node_of(link.b, point);
  return link.depth > 0 && link.a >= 0 && link.b >= 0;
}

int Query::node_of(int facet) const {
  const auto at = std::lower_bound(nodes_.begin(), nodes_.end(), facet);
  return at != nodes_.end() && *at == facet ? static_cast<int>(at - nodes_.begin()) : -1;
}

// A facet with a saddle is two nodes: one below it on either side.
int Query::node_of(int facet, const Vec3& point) const {
  for (std::size_t i = 0; i < saddles_.size(); ++i)
    if (saddles_[i].pass.facet == facet &&
        (point - saddles_[i].pass.contact.point).dot(saddles_[i].downhill) > 0)
      return static_cast<int>(nodes_.size() + i);
  return node_of(facet);
}

// Highest link first, as water rises (Kruskal).
void Query::join_over_links(const Shell& shell, const Vec3& centre, double radius) {
  parent_.resize(nodes_.size() + saddles_.size());
  std::iota(parent_.begin(), parent_.end(), 0);
  deepest_.assign(parent_.size(), -1);
  const auto find = [&](int i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  };
  const auto end_of = [&](int row) {
    while (rows_[row].merged != row) row = rows_[row].merged;
    return row;
  };
  // The shallower of two minima ends at a pass.
  const auto join = [&](int deeper, int shallower, const Row& pass, bool bent) {
    const Row &a = rows_[deeper], &b = rows_[shallower];
    if (pass.contact.depth >= b.contact.depth) {
      rows_[shallower].merged = deeper;
      return;
    }
    const double share = bent ? kShallowBent : kShallow;
    const auto near = [&](const Row& row) {
      return row.contact.depth - pass.contact.depth < share * pass.contact.depth &&
             (row.contact.normal - pass.contact.normal).squaredNorm() < kAlike * kAlike;
    };
    if (near(a) && near(b)) {
      Row& whole = rows_[end_of(deeper)];
      whole.depth += b.depth - pass.contact.depth;
      whole.normal += b.normal - pass.contact.normal;
      whole.turn += b.turn - pass.contact.turn;
      rows_[shallower].merged = deeper;
      return;
    }
    Row row = pass;
    row.merged = static_cast<int>(rows_.size());
    row.contact.weight = -1;
    row.contact.turn *= -1;
    rows_.push_back(row);
  };
  // Two minima on one element that no saddle parts are one.
  const int minima = static_cast<int>(rows_.size());
  for (int i = 0; i < minima; ++i) {
    int& deepest = deepest_[node_of(rows_[i].facet, rows_[i].contact.point)];
    if (deepest < 0)
      deepest = i;
    else
      rows_[i].merged = deepest;
  }
  // Bounds are made exact only where they come up first, and no more once all is joined.
  const auto lower = [](const Link& a, const Link& b) {
    return a.depth != b.depth   ? a.depth < b.depth
           : a.facet != b.facet ? a.facet > b.facet
                                : a.side > b.side;
  };
  int pieces = 0;
  for (int row : deepest_) pieces += row >= 0;
  for (Link& link : links_)
    if (link.exact && link.facet >= 0 && !settle(shell, link, centre, radius)) link.depth = -1;
  std::make_heap(links_.begin(), links_.end(), lower);
  while (pieces > 1 && !links_.empty()) {
    std::pop_heap(links_.begin(), links_.end(), lower);
    Link link = links_.back();
    links_.pop_back();
    if (link.depth <= 0) break;
    if (!link.exact) {
      if (!settle(shell, link, centre, radius)) continue;
      links_.push_back(link);
      std::push_heap(links_.begin(), links_.end(), lower);
      continue;
    }
    const int a = find(link.a), b = find(link.b);
    if (a == b) continue;
    const int i = deepest_[a], j = deepest_[b];
    parent_[b] = a;
    if (i >= 0 && j >= 0) {
      --pieces;
      join(std::min(i, j), std::max(i, j), pass_at(shell, link, centre, radius),
           link.facet < 0 || !shell.curved()->facets()[link.facet].flat);
    }
    deepest_[a] = i < 0 ? j : j < 0 ? i : std::min(i, j);
  }
}

Query::Row Query::pass_at(const Shell& shell, const Link& link, const Vec3& centre,
                          double radius) const {
  if (link.facet < 0) return saddles_[link.side].pass;
  const Topology& topology = shell.topology();
  const Facet& facet = shell.facets()[link.facet];
  const CubicCurve side = shell.curved()->facets()[link.facet].side(facet, link.side);
  const bool vertex = link.t == 0 || link.t == 1;
  Contact contact = contact_at(side.point(link.t), facet.normal, centre, radius, facet.element,
                               vertex ? Feature::Vertex : Feature::Edge);
  if (turns_)
    contact.turn =
        turn_of(contact, radius, vertex ? Mat3(Mat3::Zero()) : slide_of(side, link.t, centre));
  const int h = 3 * shell.triangle_of_facet(link.facet) + link.side;
  const Edge& edge = topology.edges[topology.edge_of[h]];
  return {contact,        {topology.edge_normal(edge), edge.on_rim()},
          link.facet,     0,
          contact.normal, contact.depth,
          contact.turn};
}

}  // namespace sphshell
