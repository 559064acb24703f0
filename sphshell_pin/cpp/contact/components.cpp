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

int FacetTable::find(int facet) {
  const Slot& at = slot(facet);
  return at.round == round_ ? at.number : kNone;
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
  tree_.clear();
  start_pieces(minima.size());
  if (pieces_.size() < minima.size()) pieces_.resize(minima.size());
  for (std::size_t i = 0; i < minima.size(); ++i) pieces_[i].cells = 1, pieces_[i].open.clear();
  link_equal_places(sphere, minima);
  for (int i = 0; i < static_cast<int>(minima.size()); ++i)
    add_links(shell, sphere, minima[i].facet, i, i);
  flood(shell, sphere, minima.size());
  pair_minima(shell, sphere, want_dn_dc, minima);
}

int Components::root(int cell) {
  while (parent_[cell] != cell) cell = parent_[cell] = parent_[parent_[cell]];
  return cell;
}

bool Components::is_in(int facet, int piece) {
  const int cell = cells_.find(facet);
  return cell != FacetTable::kNone && root(cell) == piece;
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
      pieces_[deeper].open.push_back(
          {minima[other].contact.depth, LinkKind::Place, deeper, facet, facet, 0, 0, other});
    }
}

bool Components::lower(const Link& a, const Link& b) {
  return a.depth != b.depth   ? a.depth < b.depth
         : a.facet != b.facet ? a.facet > b.facet
                              : a.side > b.side;
}

void Components::add_links(const Shell& shell, const Sphere& sphere, int f, int cell, int piece) {
  const Facet& facet = shell.facets()[f];
  const CellBounds& bounds = shell.curved()->cells()[f];
  const double reach = sphere.radius + bounds.bulge;
  std::vector<Link>& open = pieces_[piece].open;
  for (int k = 0; k < 3; ++k) {
    const int beyond = bounds.beyond[k];
    if (beyond == kBoundary || (beyond >= 0 && is_in(triangle_of(beyond), piece))) continue;
    const Vec3 d = facet.corner[next_corner(k)] - facet.corner[k];
    const double t =
        std::clamp((sphere.centre - facet.corner[k]).dot(d) / d.squaredNorm(), 0.0, 1.0);
    const double distance = (facet.corner[k] + t * d - sphere.centre).norm();
    if (distance >= reach) continue;
    // A side is seen from the first of its triangles, so that a place has one name.
    const auto link_to = [&](int h, int name) {
      open.push_back({reach - distance, LinkKind::Bound, cell, triangle_of(h), triangle_of(name),
                      side_of(name), 0, 0});
      std::push_heap(open.begin(), open.end(), lower);
    };
    const int here = 3 * f + k;
    if (beyond >= 0) {
      const bool first = shell.triangle_of_facet(f) < shell.triangle_of_facet(triangle_of(beyond));
      link_to(beyond, first ? here : beyond);
      continue;
    }
    const Topology& topology = shell.topology();
    const int h = 3 * shell.triangle_of_facet(f) + k;
    const Edge& edge = topology.edges[topology.edge_of[h]];
    const int name = shell.facet_half_edge(topology.incidence[edge.begin]);
    for (int i = edge.begin; i < edge.begin + edge.count; ++i)
      if (topology.incidence[i] != h) link_to(shell.facet_half_edge(topology.incidence[i]), name);
  }
}

// The highest link that leads out of a piece belongs to some largest spanning forest (Prim). The
// smaller pieces go first, and all in turn: what remains when one piece is left, or those that are
// left lead nowhere inside the sphere, is not looked at.
void Components::flood(const Shell& shell, const Sphere& sphere, std::size_t minima) {
  active_.resize(minima);
  std::iota(active_.begin(), active_.end(), 0);
  for (int size = 16; active_.size() > 1; size *= 2) {
    for (std::size_t i = 0; i < active_.size(); ++i) {
      int piece = active_[i];
      if (root(piece) != piece) continue;
      while (piece >= 0 && pieces_[piece].cells < size) piece = advance(shell, sphere, piece);
    }
    active_.erase(std::remove_if(active_.begin(), active_.end(),
                                 [&](int p) { return root(p) != p || pieces_[p].open.empty(); }),
                  active_.end());
  }
}

// Takes one more link into account; returns the piece then, -1 once it leads nowhere. Bounds are
// made exact where they come up first.
int Components::advance(const Shell& shell, const Sphere& sphere, int piece) {
  std::vector<Link>& open = pieces_[piece].open;
  if (open.empty()) return -1;
  std::pop_heap(open.begin(), open.end(), lower);
  Link link = open.back();
  open.pop_back();
  if (link.depth <= 0) {
    open.clear();
    return -1;
  }
  if (is_in(link.to, piece)) return piece;
  if (link.kind == LinkKind::Bound) {
    const Facet& facet = shell.facets()[link.facet];
    const CubicCurve side = shell.curved()->facets()[link.facet].side(facet, link.side);
    link.t = nearest_on_side(side, sphere.centre);
    link.depth = sphere.radius - (side.point(link.t) - sphere.centre).norm();
    link.kind = LinkKind::Side;
    open.push_back(link);
    std::push_heap(open.begin(), open.end(), lower);
    return piece;
  }
  bool added = false;
  const int facet = link.to;
  link.to = cells_.number(facet, added);
  if (added) {
    parent_.push_back(piece);
    ++pieces_[piece].cells;
    tree_.push_back(link);
    add_links(shell, sphere, facet, link.to, piece);
    return piece;
  }
  const int other = root(link.to);
  if (other == piece) return piece;
  tree_.push_back(link);
  const int kept = pieces_[piece].open.size() < pieces_[other].open.size() ? other : piece;
  const int gone = kept == piece ? other : piece;
  for (const Link& more : pieces_[gone].open) {
    pieces_[kept].open.push_back(more);
    std::push_heap(pieces_[kept].open.begin(), pieces_[kept].open.end(), lower);
  }
  pieces_[kept].cells += pieces_[gone].cells;
  pieces_[gone].open.clear();
  parent_[gone] = kept;
  return kept;
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
