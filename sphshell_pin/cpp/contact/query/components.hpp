// Components of the surface inside the sphere: each counts once.
#pragma once

#include <type_traits>

#include "contact/faces/face_feet.hpp"
#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"

namespace sphshell {

// From a facet to a small number: a hash table that keeps its memory and is emptied in constant
// time, as it is filled anew for each query.
class FacetTable {
 public:
  // Slots of an earlier round count as empty, so nothing is written here; only where the counter
  // wraps around the table is emptied.
  void clear() {
    count_ = 0;
    if (++round_ == 0) slots_.clear(), round_ = 1;
  }

  // The number of a facet, a new one where it had none: then `added` is set. The table grows by a
  // factor of four before it would be more than a quarter full.
  int number(int facet, bool& added) {
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

  // The number of a facet, or kNone.
  int find(int facet) {
    const Slot& at = slot(facet);
    return at.round == round_ ? at.number : kNone;
  }

  int size() const { return count_; }

  static constexpr int kNone = -1;

 private:
  struct Slot {
    int facet, number;
    std::uint32_t round;
  };

  // Open addressing with linear probing; 2654435761 is Knuth's multiplicative hash, 2^32 over the
  // golden ratio. The size is a power of two and the table at most a quarter full, so the loop
  // ends.
  Slot& slot(int facet) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t i = static_cast<std::uint32_t>(facet) * 2654435761u & mask;
    while (slots_[i].round == round_ && slots_[i].facet != facet) i = (i + 1) & mask;
    return slots_[i];
  }

  std::vector<Slot> slots_;
  std::uint32_t round_ = 0;
  int count_ = 0;
};

// How two minima, named by their facets, are connected: over a side, a half-edge.
struct Way {
  int from, to, half_edge;
};

// The theorem of fixed cells (docs/contact.md, "Components and saddles"): with a_i the depth at the
// closest point of cell i and p_ij that at the closest point of a side that cells i and j share,
//
//   V = sum_i U(a_i) - largest total of U(p_ij) over a spanning forest of the shared sides
//
// cannot jump. A cell whose closest point is on a shared side adds as much as that side takes: only
// the others are minima, and the sides where their components merge are saddles.
class Components {
 public:
  // Leaves one minimum a cell, deepest first, and adds the saddles, of weight -1. The probe is a
  // Sphere or a Plane. `ways`: all that connect the minima, where that is known. Else the cells
  // around each minimum are found, over the highest sides first. In the spanning forest of these
  // sides those between two minima are saddles. Ties are broken by feature, element and facet, so
  // that the result does not depend on the order in which the tree of boxes was walked.
  template <class Probe>
  void merge(const Search<Probe>& search, const std::vector<Way>* ways) {
    const Probe& probe = search.probe;
    std::vector<Minimum>& minima = search.minima;
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
      for (const Way& way : *ways) tree_.push_back(candidate(search, way));
    } else {
      for (int i = 0; i < static_cast<int>(minima.size()); ++i)
        add_candidates(search, minima[i].facet, i, i);
      grow_components(search);
    }
    find_saddles(search);
  }

 private:
  // Where two cells meet: over a side, where the depth is at first an upper bound from its chord
  // (Bound), then that of its closest point (Side); or in one place that is closest on both.
  enum class Kind { Bound, Side, CommonPoint };
  struct SaddleCandidate {
    double depth;
    Kind kind;
    int from, to;  // cells; `to` is a facet until the candidate is used
    int facet, side;
    double t;     // along the side
    int minimum;  // of a common point
  };

  // The cells found so far from one minimum, and the candidates on its border, as a heap.
  struct Component {
    int cells;
    std::vector<SaddleCandidate> open;
  };

  // The contact at t on side k of facet f, as a saddle has it. Its ends are corners, which do not
  // move with the center.
  template <class Probe>
  static Minimum on_side(const Search<Probe>& search, int f, int k, double t) {
    if (t == 0 || t == 1) return search.at_corner(f, t == 1 ? next_corner(k) : k);
    const SideFoot foot = nearest_on_side(search.shell, f, k, search.probe);
    return search.at(f, k, Feature::Edge, foot.point, search.shell.facets()[f].normal,
                     [&] { return dx_dc_of(search.shell, f, k, foot, search.probe); });
  }

  // A side is seen from the first of its triangles, so that a point has one name.
  static int name_of(const Shell& shell, int h, int beyond) {
    return shell.half_edge(h) < shell.half_edge(beyond) ? h : beyond;
  }

  // Union-find with path halving.
  static int root_of(std::vector<int>& parent, int i) {
    while (parent[i] != i) i = parent[i] = parent[parent[i]];
    return i;
  }

  // Rows: two directions in the plane, and its normal.
  static Mat3 axes_of(const Plane& plane) {
    const Vec3 &n = plane.normal, east = n.unitOrthogonal();
    return (Mat3() << east, n.cross(east), n).finished().transpose();
  }

  // Order of the heap: shallower ones below; of equal ones that of the higher facet and side.
  static bool lower(const SaddleCandidate& a, const SaddleCandidate& b) {
    return a.depth != b.depth   ? a.depth < b.depth
           : a.facet != b.facet ? a.facet > b.facet
                                : a.side > b.side;
  }

  static void push(const SaddleCandidate& candidate, std::vector<SaddleCandidate>& heap) {
    heap.push_back(candidate);
    std::push_heap(heap.begin(), heap.end(), lower);
  }

  // Whether a facet has been reached and is in a component, named by its first cell.
  bool belongs_to(int facet, int component) {
    const int cell = cells_.find(facet);
    return cell != FacetTable::kNone && root_of(parent_, cell) == component;
  }

  // At the closest point of the side.
  template <class Probe>
  SaddleCandidate candidate(const Search<Probe>& search, const Way& way) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
    const int h = way.half_edge;
    const int beyond = shell.curved()->cells()[triangle_of(h)].beyond[side_of(h)];
    const int name = name_of(shell, h, beyond), f = triangle_of(name), k = side_of(name);
    const SideFoot foot = nearest_on_side(shell, f, k, probe);
    const int from = cells_.find(way.from), to = cells_.find(way.to);
    return {probe.depth(foot.point), Kind::Side, from, to, f, k, foot.t, 0};
  }

  // Each cell a component of its own; the first ones are those of the minima.
  void reset_components(std::size_t minima) {
    parent_.resize(std::size_t(cells_.size()));
    std::iota(parent_.begin(), parent_.end(), 0);
    deepest_.assign(parent_.size(), -1);
    std::iota(deepest_.begin(), deepest_.begin() + minima, 0);
  }

  // Pushes the ways out of a cell onto the heap of its component: to the other fans of a vertex
  // where sheets meet in that point only, and over the sides. The depth of a side's chord and the
  // bulge, the most that the side is off it, make a cheap upper bound, which expand() makes exact
  // if it comes up at all.
  template <class Probe>
  void add_candidates(const Search<Probe>& search, int f, int cell, int component) {
    const Shell& shell = search.shell;
    const Probe& probe = search.probe;
    const Facet& facet = shell.facets()[f];
    const CellBounds& bounds = shell.curved()->cells()[f];
    std::vector<SaddleCandidate>& open = components_[component].open;
    const Topology& topology = shell.topology();
    for (int k = 0; k < 3 && !topology.pinches.empty(); ++k) {
      const Pinch* pinch = topology.pinch_at(shell.vertex(shell.half_edge(3 * f + k)));
      const double depth = probe.depth(facet.corner[k]);
      if (pinch == nullptr || depth <= 0) continue;
      const int name = shell.facet_half_edge(pinch->fans[0][0]);
      for (const std::vector<int>& fan : pinch->fans) {
        const int to = triangle_of(shell.facet_half_edge(fan[0]));
        if (belongs_to(to, component)) continue;
        push({depth, Kind::Side, cell, to, triangle_of(name), side_of(name), 0, 0}, open);
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
      const auto add_candidate = [&](int h, int name) {
        push({bound, Kind::Bound, cell, triangle_of(h), triangle_of(name), side_of(name), 0, 0},
             open);
      };
      const int here = 3 * f + k;
      if (beyond >= 0) {
        add_candidate(beyond, name_of(shell, here, beyond));
        continue;
      }
      const int h = shell.half_edge(here);
      const Edge& edge = topology.edge_at(h);
      const int name = shell.facet_half_edge(topology.incidence[edge.begin]);
      for (int i = edge.begin; i < edge.begin + edge.count; ++i)
        if (topology.incidence[i] != h)
          add_candidate(shell.facet_half_edge(topology.incidence[i]), name);
    }
  }

  // Sheets that lie on each other are one where they have one closest point.
  template <class Probe>
  void connect_equal_points(const Probe& probe, const std::vector<Minimum>& minima) {
    const double same = kSamePlace * probe.scale();
    for_each_near(minima, same, by_x_, [&](int deeper, int other) {
      const int facet = minima[other].facet;
      components_[deeper].open.push_back(
          {minima[other].contact.depth, Kind::CommonPoint, deeper, facet, facet, 0, 0, other});
    });
  }

  // Finds cells and the sides between them, as far as they decide on saddles: the highest candidate
  // that leads out of a component belongs to some largest spanning forest (Prim). All components
  // grow in turn to the same size: what remains when one component is left, or those that are left
  // lead nowhere inside the sphere, is not looked at.
  template <class Probe>
  void grow_components(const Search<Probe>& search) {
    active_.resize(search.minima.size());
    std::iota(active_.begin(), active_.end(), 0);
    for (int size = 16; active_.size() > 1; size *= 2) {
      for (std::size_t i = 0; i < active_.size(); ++i) {
        int component = active_[i];
        if (root_of(parent_, component) != component) continue;
        while (component >= 0 && components_[component].cells < size)
          component = expand(search, component);
      }
      erase_if(active_,
               [&](int p) { return root_of(parent_, p) != p || components_[p].open.empty(); });
    }
  }

  // Takes the highest candidate of a component into account; returns the component then, or -1
  // where that candidate, and so all of them, are outside the sphere.
  template <class Probe>
  int expand(const Search<Probe>& search, int component) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
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
    if (candidate.kind == Kind::Bound) {
      const SideFoot foot = nearest_on_side(shell, candidate.facet, candidate.side, probe);
      candidate.t = foot.t;
      candidate.depth = probe.depth(foot.point);
      candidate.kind = Kind::Side;
      push(candidate, open);
      return component;
    }
    bool added = false;
    const int facet = candidate.to;
    candidate.to = cells_.number(facet, added);
    if (added) {
      parent_.push_back(component);
      ++components_[component].cells;
      tree_.push_back(candidate);
      add_candidates(search, facet, candidate.to, component);
      return component;
    }
    const int other = root_of(parent_, candidate.to);
    if (other == component) return component;
    tree_.push_back(candidate);
    // The longer heap is kept, so that each candidate is moved O(log n) times.
    const int kept =
        components_[component].open.size() < components_[other].open.size() ? other : component;
    const int gone = kept == component ? other : component;
    for (const SaddleCandidate& more : components_[gone].open) push(more, components_[kept].open);
    components_[kept].cells += components_[gone].cells;
    components_[gone].open.clear();
    parent_[gone] = kept;
    return kept;
  }

  // The sides of the forest merge the cells in order of falling depth (Kruskal). Where two
  // components with a minimum each are merged, the side's closest point is a saddle, at which the
  // shallower minimum ends. Where it is hardly shallower than that minimum, both are left out: the
  // energy changes by the difference of their U alone.
  template <class Probe>
  void find_saddles(const Search<Probe>& search) {
    const Shell& shell = search.shell;
    const Probe& probe = search.probe;
    std::vector<Minimum>& minima = search.minima;
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
      Minimum saddle = candidate.kind == Kind::Side
                           ? on_side(search, candidate.facet, candidate.side, candidate.t)
                           : minima[candidate.minimum];
      // At the moment at which it is as far as the radius, to rounding.
      if (!(saddle.contact.depth > 0)) continue;
      // Force and energy of a saddle are subtracted; so is the derivative of its normal, which
      // dn_dc holds with the weight.
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

  // Minima of nearly one depth and normal, the saddle between them as well, are shown as one
  // contact.
  void group_if_nearly_one(std::vector<Minimum>& minima, int deeper, int shallower, bool flat,
                           Contact& saddle) {
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

  // On a plane one contact is in the middle of what lies level: of the box, which does not depend
  // on how a face is divided, and is within its hull.
  template <class Probe>
  void move_to_middles(const Probe& probe, std::vector<Minimum>& minima) const {
    if constexpr (std::is_same_v<Probe, Plane>)
      for (std::size_t i = 0; i < level_.size(); ++i)
        if (level_[i].diagonal().head<2>().norm() > kLevelFace * probe.scale())
          minima[i].contact.point = axes_of(probe).transpose() * level_[i].center();
  }

  FacetTable cells_;                   // the first of them hold the minima, in their order
  std::vector<int> parent_, deepest_;  // per cell; deepest_: minimum of its component, or -1
  std::vector<Component> components_;  // beside the minima, and as many more as were ever needed
  std::vector<int> by_x_, active_;
  std::vector<SaddleCandidate> tree_;
  // Beside the minima over a plane: the box, in its axes, of what is as deep as each.
  std::vector<Eigen::AlignedBox3d> level_;
  std::vector<char> absorbed_;  // beside the minima and saddles
  std::vector<int> leader_;     // beside the minima: towards the one that it is grouped with
};

}  // namespace sphshell
