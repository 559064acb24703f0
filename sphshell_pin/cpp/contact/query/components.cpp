#include "contact/query/components.hpp"

#include <numeric>
#include <type_traits>

#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"
#include "contact/faces/face_feet.hpp"

namespace sphshell {
namespace {

// The contact at t on side k of facet f, as a saddle has it. Its ends are corners, which do not
// move with the center.
template <class Probe>
Minimum on_side(const Shell& shell, int f, int k, double t, const Probe& probe, bool want_dn_dc) {
  const Facet& facet = shell.facets()[f];
  const bool vertex = t == 0 || t == 1;
  const int corner = t == 1 ? next_corner(k) : k;
  SideFoot foot{t, facet.corner[corner], Vec3::Zero()};
  if (!vertex) foot = nearest_on_side(shell, f, k, probe);
  Contact contact = contact_at(foot.point, facet.normal, probe, facet.element,
                               vertex ? Feature::Vertex : Feature::Edge);
  if (want_dn_dc)
    contact.dn_dc =
        slopes_of(contact, probe, vertex ? Mat3(Mat3::Zero()) : dx_dc_of(shell, f, k, foot, probe));
  return {contact, f, vertex ? corner : k, false};
}

// Union-find with path halving.
int root_of(std::vector<int>& parent, int i) {
  while (parent[i] != i) i = parent[i] = parent[parent[i]];
  return i;
}

// Rows: two directions in the plane, and its normal.
Mat3 axes_of(const Plane& plane) {
  const Vec3 &n = plane.normal, east = n.unitOrthogonal();
  return (Mat3() << east, n.cross(east), n).finished().transpose();
}

}  // namespace

// Slots of an earlier round count as empty, so nothing is written here; only where the counter
// wraps around the table is emptied.
void FacetTable::clear() {
  count_ = 0;
  if (++round_ == 0) slots_.clear(), round_ = 1;
}

// Open addressing with linear probing; 2654435761 is Knuth's multiplicative hash, 2^32 over the
// golden ratio. The size is a power of two and the table at most a quarter full, so the loop ends.
FacetTable::Slot& FacetTable::slot(int facet) {
  const std::size_t mask = slots_.size() - 1;
  std::size_t i = static_cast<std::uint32_t>(facet) * 2654435761u & mask;
  while (slots_[i].round == round_ && slots_[i].facet != facet) i = (i + 1) & mask;
  return slots_[i];
}

// Grows by a factor of four before it would be more than a quarter full.
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

// Four passes: one minimum a cell; the cells around each minimum, over the highest sides first; the
// spanning forest of these sides, of which those between two minima are saddles; what is left. Ties
// are broken by feature, element and facet, so that the result does not depend on the order in
// which the tree of boxes was walked.
template <class Probe>
void Components::merge(const Shell& shell, const Probe& probe, bool want_dn_dc,
                       std::vector<Minimum>& minima, const std::vector<Way>* ways) {
  std::sort(minima.begin(), minima.end(), [](const Minimum& x, const Minimum& y) {
    const Contact &a = x.contact, &b = y.contact;
    return a.depth != b.depth       ? a.depth > b.depth
           : a.feature != b.feature ? a.feature < b.feature
           : a.element != b.element ? a.element < b.element
                                    : x.facet < y.facet;
  });
  const std::size_t found = minima.size();
  // Of what was found on one cell the deepest is its closest point.
  cells_.clear();
  level_.clear();
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size(); ++i) {
    bool added = false;
    const int cell = cells_.number(minima[i].facet, added);
    if (added) minima[kept++] = minima[i];
    if constexpr (std::is_same_v<Probe, Plane>) {
      const Contact& contact = minima[i].contact;
      if (added) level_.emplace_back();
      if (minima[cell].contact.depth - contact.depth <= kLevelFace * probe.scale())
        level_[cell].extend(Vec3(axes_of(probe) * contact.point));
    }
  }
  minima.erase(minima.begin() + kept, minima.end());
  if (minima.size() < 2) return move_to_middles(probe, minima);
  tree_.clear();
  reset_components(minima.size());
  if (components_.size() < minima.size()) components_.resize(minima.size());
  for (std::size_t i = 0; i < minima.size(); ++i)
    components_[i].cells = 1, components_[i].open.clear();
  connect_equal_points(probe, minima);
  const bool apart = std::all_of(components_.begin(), components_.begin() + minima.size(),
                                 [](const Component& one) { return one.open.empty(); });
  if (ways && apart && minima.size() == found) {
    for (const Way& way : *ways) tree_.push_back(candidate(shell, probe, way));
  } else {
    for (int i = 0; i < static_cast<int>(minima.size()); ++i)
      add_candidates(shell, probe, minima[i].facet, i, i);
    grow_components(shell, probe, minima.size());
  }
  find_saddles(shell, probe, want_dn_dc, minima);
}

// At the closest point of the side.
template <class Probe>
Components::SaddleCandidate Components::candidate(const Shell& shell, const Probe& probe,
                                                  const Way& way) {
  const int h = way.half_edge;
  const int beyond = shell.curved()->cells()[triangle_of(h)].beyond[side_of(h)];
  const bool first =
      shell.triangle_of_facet(triangle_of(h)) < shell.triangle_of_facet(triangle_of(beyond));
  const int name = first ? h : beyond, f = triangle_of(name), k = side_of(name);
  const SideFoot foot = nearest_on_side(shell, f, k, probe);
  return {probe.depth(foot.point),
          SaddleCandidate::Kind::Side,
          cells_.find(way.from),
          cells_.find(way.to),
          f,
          k,
          foot.t,
          0};
}

// By the number of the facet in cells_, if it has been reached.
bool Components::belongs_to(int facet, int component) {
  const int cell = cells_.find(facet);
  return cell != FacetTable::kNone && root_of(parent_, cell) == component;
}

// Each cell a component of its own; the first ones are those of the minima.
void Components::reset_components(std::size_t minima) {
  parent_.resize(std::size_t(cells_.size()));
  std::iota(parent_.begin(), parent_.end(), 0);
  deepest_.assign(parent_.size(), -1);
  std::iota(deepest_.begin(), deepest_.begin() + minima, 0);
}

// Sheets that lie on each other are one where they have one closest point.
template <class Probe>
void Components::connect_equal_points(const Probe& probe, const std::vector<Minimum>& minima) {
  const double same = kSamePlace * probe.scale();
  const auto point = [&](int i) -> const Vec3& { return minima[i].contact.point; };
  // Sorted along x only neighbors are compared: sheets seldom have many minima.
  by_x_.resize(minima.size());
  std::iota(by_x_.begin(), by_x_.end(), 0);
  std::sort(by_x_.begin(), by_x_.end(), [&](int i, int j) { return point(i).x() < point(j).x(); });
  for (std::size_t a = 0; a < by_x_.size(); ++a)
    for (std::size_t b = a + 1; b < by_x_.size(); ++b) {
      if (point(by_x_[b]).x() - point(by_x_[a]).x() > same) break;
      if ((point(by_x_[a]) - point(by_x_[b])).squaredNorm() > same * same) continue;
      const auto [deeper, other] = std::minmax(by_x_[a], by_x_[b]);
      const int facet = minima[other].facet;
      components_[deeper].open.push_back({minima[other].contact.depth,
                                          SaddleCandidate::Kind::CommonPoint, deeper, facet, facet,
                                          0, 0, other});
    }
}

// Order of the heap: shallower ones below; of equal ones that of the higher facet and side.
bool Components::lower(const SaddleCandidate& a, const SaddleCandidate& b) {
  return a.depth != b.depth   ? a.depth < b.depth
         : a.facet != b.facet ? a.facet > b.facet
                              : a.side > b.side;
}

// Pushes the ways out of a cell: to the other fans of a vertex where sheets meet in that point
// only, and over the sides. With the bulge, the most that a curved side is off its chord, the depth
// of the chord is an upper bound, cheap, and made exact in expand() if it comes up at all.
template <class Probe>
void Components::add_candidates(const Shell& shell, const Probe& probe, int f, int cell,
                                int component) {
  const Facet& facet = shell.facets()[f];
  const CellBounds& bounds = shell.curved()->cells()[f];
  std::vector<SaddleCandidate>& open = components_[component].open;
  const Topology& topology = shell.topology();
  for (int k = 0; k < 3 && !topology.pinches.empty(); ++k) {
    const Pinch* pinch = topology.pinch_at(shell.triangles()[shell.triangle_of_facet(f)][k]);
    const double depth = probe.depth(facet.corner[k]);
    if (pinch == nullptr || depth <= 0) continue;
    const int name = shell.facet_half_edge(pinch->fans[0][0]);
    for (const std::vector<int>& fan : pinch->fans) {
      const int to = triangle_of(shell.facet_half_edge(fan[0]));
      if (belongs_to(to, component)) continue;
      open.push_back(
          {depth, SaddleCandidate::Kind::Side, cell, to, triangle_of(name), side_of(name), 0, 0});
      std::push_heap(open.begin(), open.end(), lower);
    }
  }
  for (int k = 0; k < 3; ++k) {
    // beyond: the half-edge on the other side where there is one triangle there, kBoundary where
    // there is none, else the edge is shared by more than two.
    const int beyond = bounds.beyond[k];
    if (beyond == kBoundary || (beyond >= 0 && belongs_to(triangle_of(beyond), component)))
      continue;
    const double bound = probe.bound_along(facet.corner[k], facet.side(k), bounds.bulge);
    if (bound <= 0) continue;
    // A side is seen from the first of its triangles, so that a point has one name.
    const auto add_candidate = [&](int h, int name) {
      open.push_back({bound, SaddleCandidate::Kind::Bound, cell, triangle_of(h), triangle_of(name),
                      side_of(name), 0, 0});
      std::push_heap(open.begin(), open.end(), lower);
    };
    const int here = 3 * f + k;
    if (beyond >= 0) {
      const bool first = shell.triangle_of_facet(f) < shell.triangle_of_facet(triangle_of(beyond));
      add_candidate(beyond, first ? here : beyond);
      continue;
    }
    const int h = 3 * shell.triangle_of_facet(f) + k;
    const Edge& edge = topology.edge_at(h);
    const int name = shell.facet_half_edge(topology.incidence[edge.begin]);
    for (int i = edge.begin; i < edge.begin + edge.count; ++i)
      if (topology.incidence[i] != h)
        add_candidate(shell.facet_half_edge(topology.incidence[i]), name);
  }
}

// The highest candidate that leads out of a component belongs to some largest spanning forest
// (Prim). The smaller components go first, and all in turn: what remains when one component is
// left, or those that are left lead nowhere inside the sphere, is not looked at.
template <class Probe>
void Components::grow_components(const Shell& shell, const Probe& probe, std::size_t minima) {
  active_.resize(minima);
  std::iota(active_.begin(), active_.end(), 0);
  for (int size = 16; active_.size() > 1; size *= 2) {
    for (std::size_t i = 0; i < active_.size(); ++i) {
      int component = active_[i];
      if (root_of(parent_, component) != component) continue;
      while (component >= 0 && components_[component].cells < size)
        component = expand(shell, probe, component);
    }
    active_.erase(std::remove_if(active_.begin(), active_.end(),
                                 [&](int p) {
                                   return root_of(parent_, p) != p || components_[p].open.empty();
                                 }),
                  active_.end());
  }
}

// Takes one more candidate into account; returns the component then, -1 once it leads nowhere.
// Bounds are made exact where they come up first.
// `open` is sorted by depth: where its highest candidate is outside the sphere, all are.
template <class Probe>
int Components::expand(const Shell& shell, const Probe& probe, int component) {
  std::vector<SaddleCandidate>& open = components_[component].open;
  if (open.empty()) return -1;
  std::pop_heap(open.begin(), open.end(), lower);
  SaddleCandidate candidate = open.back();
  open.pop_back();
  if (candidate.depth <= 0) {
    open.clear();
    return -1;
  }
  // Reached meanwhile by another way: this one closes a loop.
  if (belongs_to(candidate.to, component)) return component;
  // Put back with its exact depth: it may not be the highest any more.
  if (candidate.kind == SaddleCandidate::Kind::Bound) {
    const SideFoot foot = nearest_on_side(shell, candidate.facet, candidate.side, probe);
    candidate.t = foot.t;
    candidate.depth = probe.depth(foot.point);
    candidate.kind = SaddleCandidate::Kind::Side;
    open.push_back(candidate);
    std::push_heap(open.begin(), open.end(), lower);
    return component;
  }
  bool added = false;
  const int facet = candidate.to;
  candidate.to = cells_.number(facet, added);
  if (added) {
    parent_.push_back(component);
    ++components_[component].cells;
    tree_.push_back(candidate);
    add_candidates(shell, probe, facet, candidate.to, component);
    return component;
  }
  const int other = root_of(parent_, candidate.to);
  if (other == component) return component;
  tree_.push_back(candidate);
  // The longer heap is kept, so that each candidate is moved O(log n) times.
  const int kept =
      components_[component].open.size() < components_[other].open.size() ? other : component;
  const int gone = kept == component ? other : component;
  for (const SaddleCandidate& more : components_[gone].open) {
    components_[kept].open.push_back(more);
    std::push_heap(components_[kept].open.begin(), components_[kept].open.end(), lower);
  }
  components_[kept].cells += components_[gone].cells;
  components_[gone].open.clear();
  parent_[gone] = kept;
  return kept;
}

// The shallower of two minima ends at the saddle that merges their components (Kruskal).
// The sides of the forest join the cells in order of falling depth. Where two components with a
// minimum each are joined, the side's closest point is a saddle between these minima. Where it is
// hardly shallower than the shallower minimum, both are left out: the energy changes by the
// difference of their U alone.
template <class Probe>
void Components::find_saddles(const Shell& shell, const Probe& probe, bool want_dn_dc,
                              std::vector<Minimum>& minima) {
  std::sort(tree_.begin(), tree_.end(),
            [](const SaddleCandidate& a, const SaddleCandidate& b) { return lower(b, a); });
  reset_components(minima.size());
  absorbed_.assign(minima.size(), 0);
  leader_.resize(minima.size());
  std::iota(leader_.begin(), leader_.end(), 0);
  for (const SaddleCandidate& candidate : tree_) {
    const int a = root_of(parent_, candidate.from), b = root_of(parent_, candidate.to);
    const int i = deepest_[a], j = deepest_[b];
    parent_[b] = a;
    deepest_[a] = i < 0 ? j : j < 0 ? i : std::min(i, j);
    if (i < 0 || j < 0) continue;
    const int deeper = std::min(i, j), shallower = std::max(i, j);
    // Between two parts of a ring there is none: its corners are on the circle to that gap.
    const bool one_ring = minima[deeper].off_axis < 1 && minima[shallower].off_axis < 1;
    const double least = one_ring ? shell.curved()->gap()
                                  : (level_.empty() ? kNoSaddle : kLevelFace) * probe.scale();
    if (candidate.depth >= minima[shallower].contact.depth - least) {
      absorbed_[shallower] = 1;
      if (!level_.empty() && minima[deeper].contact.depth - minima[shallower].contact.depth <=
                                 kLevelFace * probe.scale())
        level_[deeper].extend(level_[shallower]);
      continue;
    }
    Minimum saddle =
        candidate.kind == SaddleCandidate::Kind::Side
            ? on_side(shell, candidate.facet, candidate.side, candidate.t, probe, want_dn_dc)
            : minima[candidate.minimum];
    // At the moment at which it is as far as the radius, to rounding.
    if (!(saddle.contact.depth > 0)) continue;
    // Force and energy of a saddle are subtracted; so is the derivative of its normal, which dn_dc
    // holds with the weight.
    saddle.contact.weight = -1;
    saddle.contact.dn_dc *= -1;
    saddle.contact.group = -1;
    group_if_nearly_one(minima, deeper, shallower, shell.curved()->facets()[candidate.facet].flat,
                        saddle.contact);
    minima.push_back(saddle);
    absorbed_.push_back(0);
  }
  move_to_middles(probe, minima);
  std::size_t kept = 0;
  for (std::size_t i = 0; i < minima.size(); ++i) {
    if (absorbed_[i]) continue;
    int& group = minima[i].contact.group;
    if (group >= 0) group = root_of(leader_, group);
    minima[kept++] = minima[i];
  }
  minima.erase(minima.begin() + kept, minima.end());
}

// On a plane one contact is in the middle of what lies level: of the box, which does not depend on
// how a face is divided, and is within its hull.
template <class Probe>
void Components::move_to_middles(const Probe& probe, std::vector<Minimum>& minima) const {
  if constexpr (std::is_same_v<Probe, Plane>)
    for (std::size_t i = 0; i < level_.size(); ++i)
      if (level_[i].diagonal().head<2>().norm() > kLevelFace * probe.scale())
        minima[i].contact.point = axes_of(probe).transpose() * level_[i].center();
}

// Minima of nearly one depth and normal, the saddle between them as well, are shown as one contact.
void Components::group_if_nearly_one(std::vector<Minimum>& minima, int deeper, int shallower,
                                     bool flat, Contact& saddle) {
  const double share = flat ? kShallowFlat : kShallow;
  const auto near = [&](const Contact& c) {
    return c.depth - saddle.depth < share * saddle.depth &&
           (c.normal - saddle.normal).squaredNorm() < kAlike * kAlike;
  };
  Contact &a = minima[deeper].contact, &b = minima[shallower].contact;
  if (!near(a) || !near(b)) return;
  a.group = saddle.group = deeper;
  b.group = shallower;
  leader_[root_of(leader_, shallower)] = root_of(leader_, deeper);
}

template void Components::merge(const Shell&, const Sphere&, bool, std::vector<Minimum>&,
                                const std::vector<Way>*);
template void Components::merge(const Shell&, const Plane&, bool, std::vector<Minimum>&,
                                const std::vector<Way>*);

}  // namespace sphshell
