// Contacts with curved elements: the minima of the distance that the cells hold.
#pragma once

#include "contact/query/broad_phase.hpp"
#include "contact/query/components.hpp"
#include "contact/faces/face_feet.hpp"

namespace sphshell {

// Minima of the distance on curved elements, with their saddles; of a Plane as the probe, in place
// of a Sphere, those of the height over it. Keeps its memory.
class CurvedQuery {
 public:
  template <class Probe>
  void find(const Shell& shell, const Probe& probe, BroadPhase& broad, bool want_dn_dc,
            std::vector<Minimum>& minima);

 private:
  // Where a cell may hold a minimum, by the center's position over its facet and the slope of the
  // distance in its middle.
  struct Outlook {
    int facet;
    double height;   // of the center above the facet's plane [m]
    bool within;     // the distance may be stationary within the cell,
    bool side[3];    // ... least on side k,
    bool corner[3];  // ... or in corner k
    bool convex;     // it is convex all over the cell

    Outlook(int f, const Facet& facet, const NormalCone& cone, const CellBounds& bounds,
            const Sphere& sphere);
    Outlook(int f, const CubicPatch& patch, const Plane& plane, double slack);
    bool empty() const {
      return !(within || side[0] || side[1] || side[2] || corner[0] || corner[1] || corner[2]);
    }
  };
  template <class Probe>
  struct Task {
    const Shell& shell;
    const Probe& probe;
    bool want_dn_dc;
    std::vector<Minimum>& minima;
  };

  // A joint within the sphere: where it is nearest to the center, if there is one such point, else
  // the center.
  struct Reached {
    int joint;
    bool one;
    Vec3 point;
    double depth = 0;  // once it is needed [m]
  };

  // Each adds the minimum of one feature, if there is one: within a flat or a bent cell, on the
  // border of a face, on the joint of two, on a side, at a corner.
  void add_flat(const Task<Sphere>& task, const Outlook& outlook);
  template <class Probe>
  void add_bent(const Task<Probe>& task, const Outlook& outlook);
  template <class Probe>
  void add_border(const Task<Probe>& task, int facet);
  void add_joint(const Task<Sphere>& task, int joint);
  BoxTree::Found sides_near(const Task<Sphere>& task, const Reached& at);
  double falls(const Task<Sphere>& task, int joint, int i) const;
  // Whether ways_ are all that connect the minima.
  bool find_ways(const Task<Sphere>& task, const BroadPhase& broad);
  int part_of(const CurvedShell& surface, int face);
  int saddle_side(const Task<Sphere>& task, const Reached& at);
  template <class Probe>
  void add_edge(const Task<Probe>& task, int facet, int side);
  template <class Probe>
  void add_vertex(const Task<Probe>& task, int facet, int corner);

  std::vector<Outlook> outlooks_;
  std::vector<int> borders_;  // facets that lie on faces
  std::vector<Reached> joints_;
  std::vector<int> sides_;  // room for half-edges of one of them
  std::vector<Way> ways_;
  // Faces that have been put together, by the part that one is in (its own number: a first one),
  // and a minimum of those of a first one.
  static constexpr int kNone = -1;
  struct Part {
    int face, in, minimum;
  };
  std::vector<Part> parts_;  // the first one: of all faces, and facets on none, of unknown border
  FaceFeet feet_;
  Components components_;
};

}  // namespace sphshell
