// What a sphere's query walks through where facets lie on faces.
#pragma once

#include <optional>

#include "shell/shell.hpp"

namespace sphshell {

class CurvedShell;

// Things by number, in a tree of their boxes.
class BoxTree {
 public:
  using Boxes = std::vector<std::pair<Eigen::AlignedBox3d, int>>;
  explicit BoxTree(const Boxes& boxes);

  // In the order of the tree.
  const std::vector<int>& items() const { return items_; }
  // Null where there is nothing.
  const Bvh* tree() const { return tree_ ? &*tree_ : nullptr; }
  std::size_t bytes() const;
  // Those whose box meets a ball, and some beside them.
  void find(const Vec3& center, double radius, std::vector<int>& out) const;

 private:
  std::vector<int> items_;
  std::optional<Bvh> tree_;
};

// What holds a face or a joint, and how far from it its facets or chords are [m].
struct Region {
  Eigen::AlignedBox3d box;
  double reach = 0;

  void extend(const Eigen::AlignedBox3d& part, double bulge);
  bool holds(const Vec3& x, double slack) const {
    return box.squaredExteriorDistance(x) <= slack * slack;
  }
};

// Inside a face nothing but its own closest point can be a minimum, and on a joint that is a line
// or a circle nothing but its own. So a query looks for faces, and the facet that holds the point;
// for joints, and the side that holds it; for corners; and for facets that hold something else.
struct FaceSearch {
  // Of a curved shell with at least one facet that is closed.
  FaceSearch(const Shell& shell, const CurvedShell& surface);

  std::vector<Region> of_face, of_joint;  // beside Faces::shapes and Faces::joints
  double slack;                           // more than rounding [m]
  BoxTree faces;                          // in Faces::shapes
  BoxTree joints;                         // in Faces::joints
  BoxTree sides;                 // of joints that are lines or circles: half-edges (3 facet + side)
  BoxTree corners;               // of faces: 3 facet + corner
  BoxTree facets;                // with an element, or another side
  LargeArray<NormalCone> cones;  // beside facets.items()
  double bulge = 0;              // the largest of facets [m]

  std::size_t bytes() const;
};

// Whether a side is part of a joint that is a line or a circle.
bool is_on_border(const CurvedShell& surface, int facet, int side);

// Whether, moreover, the facet owns it and both faces there are exact.
bool is_on_joint(const CurvedShell& surface, int facet, int side);

}  // namespace sphshell
