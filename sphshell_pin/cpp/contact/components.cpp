#include "contact/components.hpp"

#include <algorithm>
#include <numeric>

#include "contact/closest_on_cell.hpp"
#include "contact/closest_on_side.hpp"
#include "shell/curved.hpp"

namespace sphshell {
namespace {

Minimum on_side(const Shell& shell, int f, int k, double t, const Sphere& sphere, bool want_dn_dc) {
  const Facet& facet = shell.facets()[f];
  const CubicCurve side = shell.curved()->facets()[f].side(facet, k);
  const bool vertex = t == 0 || t == 1;
  Contact contact = contact_at(side.point(t), facet.normal, sphere, facet.element,
                               vertex ? Feature::Vertex : Feature::Edge);
  if (want_dn_dc)
    contact.dn_dc = dn_dc_of(contact, sphere.radius,
                             vertex ? Mat3(Mat3::Zero()) : dx_dc_of(side, t, sphere.centre));
  return {contact, f, t == 1 ? next_corner(k) : k, false};
}

}  // namespace

void FacetTable::clear() {
  count_ = 0;
  if (++round_ == 0) slots_.clear(), round_ = 1;
}

FacetTable::Slot& FacetTable::slot(int facet) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = static_cast<std::uint32_t>(facet) * 2654435761u & mask;
  while (slots_[i].round == round_ && slots_[i].facet != facet) i = (i + 1) & mask;
  return slots_[i];
}

int FacetTable::number(int facet, bool& added) {
  if (slots_.size() < 4 * (static_cast<std::size_t>(count_) + 1)) {
    std::vector<Slot> old(std::max<std::size_t>(1024, 4 * slots_.size()), Slot{0, 0, 0});
    old.swap(slots_);
    for (const Slot& s : old)
      if (s.round == round_) slot(s.facet) = s;
  }
  Slot& at = slot(facet);
  added = at.round != round_;
  if (added) at = {facet, count_++, round_};
  return at.number;
}

void Components::merge(const Shell& shell, const Sphere& sphere, bool want_dn_dc,
                       std::vector<Minimum>& minima) {
  std::sort(minima.begin(), minima.end(), [](const Minimum& x, const Minimum& y) {
    const Contact &a = x.contact, &b = y.contact;
    return a.depth != b.depth       ? a.depth > b.depth
           : a.feature != b.feature ? a.feature < b.feature
           : a.element != b.element ? a.element < b.element
                                    : x.facet < y.facet;
  });
  // Of what was found on one cell the deepest is its nearest place.
  cells_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size(); ++i) {
    bool added = false;
    cells_.number(minima[i].facet, added);
    if (added) minima[kept++] = minima[i];
  }
  minima.erase(minima.begin() + kept, minima.end());
  if (minima.size() < 2) return;
  open_.clear(), tree_.clear();
  start_pieces(minima.size());
  link_equal_places(sphere, minima);
  for (int cell = 0; cell < static_cast<int>(minima.size()); ++cell)
    add_links(shell, sphere, minima[cell].facet, cell);
  flood(shell, sphere);
  pair_minima(shell, sphere, want_dn_dc, minima);
}

int Components::root(int cell) {
  while (parent_[cell] != cell) cell = parent_[cell] = parent_[parent_[cell]];
  return cell;
}

void Components::start_pieces(std::size_t minima) {
  parent_.resize(std::size_t(cells_.size()));
  std::iota(parent_.begin(), parent_.end(), 0);
  deepest_.assign(parent_.size(), -1);
  std::iota(deepest_.begin(), deepest_.begin() + minima, 0);
}

// Sheets that lie on each other, and fans that share no more than a corner, are one where they have
// one nearest place.
void Components::link_equal_places(const Sphere& sphere, const std::vector<Minimum>& minima) {
  const double same = kSamePlace * sphere.radius;
  const auto point = [&](int i) -> const Vec3& { return minima[i].contact.point; };
  by_x_.resize(minima.size());
  std::iota(by_x_.begin(), by_x_.end(), 0);
  std::sort(by_x_.begin(), by_x_.end(), [&](int i, int j) { return point(i).x() < point(j).x(); });
  for (std::size_t a = 0; a < by_x_.size(); ++a)
    for (std::size_t b = a + 1; b < by_x_.size(); ++b) {
      if (point(by_x_[b]).x() - point(by_x_[a]).x() > same) break;
      if ((point(by_x_[a]) - point(by_x_[b])).squaredNorm() > same * same) continue;
      const auto [deeper, other] = std::minmax(by_x_[a], by_x_[b]);
      const int facet = minima[other].facet;
      open_.push_back(
          {minima[other].contact.depth, LinkKind::Place, deeper, facet, facet, 0, 0, other});
    }
  std::make_heap(open_.begin(), open_.end(), lower);
}

bool Components::lower(const Link& a, const Link& b) {
  return a.depth != b.depth   ? a.depth < b.depth
         : a.facet != b.facet ? a.facet > b.facet
                              : a.side > b.side;
}

void Components::add_links(const Shell& shell, const Sphere& sphere, int f, int cell) {
  const Topology& topology = shell.topology();
  const Facet& facet = shell.facets()[f];
  const CurvedFacet& curved = shell.curved()->facets()[f];
  const double reach = sphere.radius + curved.bulge;
  const int triangle = shell.triangle_of_facet(f);
  for (int k = 0; k < 3; ++k) {
    const Edge& edge = topology.edges[topology.edge_of[3 * triangle + k]];
    if (edge.count < 2) continue;
    const Vec3 d = facet.corner[next_corner(k)] - facet.corner[k];
    const double t =
        std::clamp((sphere.centre - facet.corner[k]).dot(d) / d.squaredNorm(), 0.0, 1.0);
    const double distance = (facet.corner[k] + t * d - sphere.centre).norm();
    if (distance >= reach) continue;
    // A side is always seen from the same of its facets, so that a place has one name.
    const int first = shell.facet_half_edge(topology.incidence[edge.begin]);
    for (int i = edge.begin; i < edge.begin + edge.count; ++i) {
      const int g = triangle_of(shell.facet_half_edge(topology.incidence[i]));
      if (g == f) continue;
      open_.push_back(
          {reach - distance, LinkKind::Bound, cell, g, triangle_of(first), side_of(first), 0, 0});
      std::push_heap(open_.begin(), open_.end(), lower);
    }
  }
}

// Water rises from all minima at once: the highest link of all that lead on is the highest that
// leads out of its piece, so some largest spanning forest has it (Prim). Only cells that lie
// between the minima are looked at. Bounds are made exact where they come up first.
void Components::flood(const Shell& shell, const Sphere& sphere) {
  std::size_t pieces = parent_.size();
  while (pieces > 1 && !open_.empty()) {
    std::pop_heap(open_.begin(), open_.end(), lower);
    Link link = open_.back();
    open_.pop_back();
    if (link.depth <= 0) break;
    if (link.kind == LinkKind::Bound) {
      const Facet& facet = shell.facets()[link.facet];
      const CubicCurve side = shell.curved()->facets()[link.facet].side(facet, link.side);
      link.t = nearest_on_side(side, sphere.centre);
      link.depth = sphere.radius - (side.point(link.t) - sphere.centre).norm();
      link.kind = LinkKind::Side;
      open_.push_back(link);
      std::push_heap(open_.begin(), open_.end(), lower);
      continue;
    }
    bool added = false;
    const int facet = link.to;
    link.to = cells_.number(facet, added);
    if (added) {
      parent_.push_back(link.to);
      deepest_.push_back(-1);
      add_links(shell, sphere, facet, link.to);
    }
    const int a = root(link.from), b = root(link.to);
    if (a == b) continue;
    parent_[b] = a;
    if (deepest_[a] >= 0 && deepest_[b] >= 0) --pieces;
    deepest_[a] = std::max(deepest_[a], deepest_[b]);
    tree_.push_back(link);
  }
}

// The shallower of two minima ends at the saddle that merges their pieces (Kruskal).
void Components::pair_minima(const Shell& shell, const Sphere& sphere, bool want_dn_dc,
                             std::vector<Minimum>& minima) {
  std::sort(tree_.begin(), tree_.end(), [](const Link& a, const Link& b) { return lower(b, a); });
  start_pieces(minima.size());
  absorbed_.assign(minima.size(), 0);
  leader_.resize(minima.size());
  std::iota(leader_.begin(), leader_.end(), 0);
  for (const Link& link : tree_) {
    const int a = root(link.from), b = root(link.to);
    const int i = deepest_[a], j = deepest_[b];
    parent_[b] = a;
    deepest_[a] = i < 0 ? j : j < 0 ? i : std::min(i, j);
    if (i < 0 || j < 0) continue;
    const int deeper = std::min(i, j), shallower = std::max(i, j);
    if (link.depth >= minima[shallower].contact.depth - kNoSaddle * sphere.radius) {
      absorbed_[shallower] = 1;
      continue;
    }
    Minimum saddle = link.kind == LinkKind::Side
                         ? on_side(shell, link.facet, link.side, link.t, sphere, want_dn_dc)
                         : minima[link.minimum];
    saddle.contact.weight = -1;
    saddle.contact.dn_dc *= -1;
    saddle.contact.place = -1;
    show_as_one(minima, deeper, shallower, shell.curved()->facets()[link.facet].flat,
                saddle.contact);
    minima.push_back(saddle);
    absorbed_.push_back(0);
  }
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size(); ++i) {
    if (absorbed_[i]) continue;
    int& place = minima[i].contact.place;
    if (place >= 0) place = leader_of(place);
    minima[kept++] = minima[i];
  }
  minima.erase(minima.begin() + kept, minima.end());
}

// Minima of nearly one depth and normal, the saddle between them as well, are shown as one contact.
void Components::show_as_one(std::vector<Minimum>& minima, int deeper, int shallower, bool flat,
                             Contact& saddle) {
  const double share = flat ? kShallowFlat : kShallow;
  const auto near = [&](const Contact& c) {
    return c.depth - saddle.depth < share * saddle.depth &&
           (c.normal - saddle.normal).squaredNorm() < kAlike * kAlike;
  };
  Contact &a = minima[deeper].contact, &b = minima[shallower].contact;
  if (!near(a) || !near(b)) return;
  a.place = saddle.place = deeper;
  b.place = shallower;
  leader_[leader_of(shallower)] = leader_of(deeper);
}

int Components::leader_of(int minimum) {
  while (leader_[minimum] != minimum) minimum = leader_[minimum] = leader_[leader_[minimum]];
  return minimum;
}

}  // namespace sphshell
