// Contacts with curved elements: the minima of the distance that the cells hold.
#pragma once

#include <vector>

#include "contact/query/broad_phase.hpp"
#include "contact/query/components.hpp"
#include "contact/faces/face_feet.hpp"
#include "contact/query/minimum.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

// Minima of the distance on curved elements, with their saddles. Keeps its memory.
class CurvedQuery {
 public:
  void find(const Shell& shell, const Sphere& sphere, BroadPhase& broad, bool want_dn_dc,
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
    bool empty() const {
      return !(within || side[0] || side[1] || side[2] || corner[0] || corner[1] || corner[2]);
    }
  };
  struct Task {
    const Shell& shell;
    const Sphere& sphere;
    bool want_dn_dc;
    std::vector<Minimum>& minima;
  };

  // Each adds the minimum of one feature, if there is one: within a flat or a bent cell, on the
  // border of a face, on a side, at a corner.
  void add_flat(const Task& task, const Outlook& outlook);
  void add_bent(const Task& task, const Outlook& outlook);
  void add_border(const Task& task, int facet);
  void add_edge(const Task& task, int facet, int side);
  void add_vertex(const Task& task, int facet, int corner);

  std::vector<Outlook> outlooks_;
  std::vector<int> borders_;  // facets that lie on faces
  FaceFeet feet_;
  Components components_;
};

}  // namespace sphshell
