// Components of the surface inside the sphere: each counts once.
#pragma once

#include "contact/query/minimum.hpp"

namespace sphshell {

// From a facet to a small number; keeps its memory.
// A hash table that is emptied in constant time, as one is filled for each query.
class FacetTable {
 public:
  // In constant time.
  void clear();
  // The number of a facet, a new one where it had none: then `added` is set.
  int number(int facet, bool& added);
  // The number of a facet, or kNone.
  int find(int facet);
  int size() const { return count_; }

  static constexpr int kNone = -1;

 private:
  struct Slot {
    int facet, number;
    std::uint32_t round;
  };
  Slot& slot(int facet);
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
  // Sphere or a Plane. `ways`: all that connect the minima, where that is known.
  template <class Probe>
  void merge(const Shell& shell, const Probe& probe, bool want_dn_dc, std::vector<Minimum>& minima,
             const std::vector<Way>* ways = nullptr);

 private:
  // Where two cells meet: over a side, at its closest point, first only bounded from above; or at
  // the closest point of both.
  struct SaddleCandidate {
    // Bound: depth is an upper bound from the chord. Side: exact. CommonPoint: of two minima at one
    // place.
    enum class Kind { Bound, Side, CommonPoint };
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

  // Whether a comes after b.
  static bool lower(const SaddleCandidate& a, const SaddleCandidate& b);
  static void push(const SaddleCandidate& candidate, std::vector<SaddleCandidate>& heap);
  // Whether a facet is in a component, named by its first cell, already.
  bool belongs_to(int facet, int component);
  template <class Probe>
  SaddleCandidate candidate(const Shell& shell, const Probe& probe, const Way& way);
  void reset_components(std::size_t minima);
  // The ways out of a cell, onto the heap of its component.
  template <class Probe>
  void add_candidates(const Shell& shell, const Probe& probe, int facet, int cell, int component);
  template <class Probe>
  void connect_equal_points(const Probe& probe, const std::vector<Minimum>& minima);
  // Finds cells and the sides between them, as far as they decide on saddles.
  template <class Probe>
  void grow_components(const Shell& shell, const Probe& probe, std::size_t minima);
  template <class Probe>
  int expand(const Shell& shell, const Probe& probe, int component);
  template <class Probe>
  void find_saddles(const Shell& shell, const Probe& probe, bool want_dn_dc,
                    std::vector<Minimum>& minima);
  void group_if_nearly_one(std::vector<Minimum>& minima, int deeper, int shallower, bool flat,
                           Contact& saddle);
  template <class Probe>
  void move_to_middles(const Probe& probe, std::vector<Minimum>& minima) const;

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
