// What a sphere's query walks through where facets lie on faces.
#pragma once

#include "shell/shell.hpp"

namespace sphshell {

class CurvedShell;

// Things by number, in a tree of their boxes. A node has eight, which are tested at once and
// without a branch: cold queries cost what processors guess wrong.
class BoxTree {
 public:
  using Boxes = std::vector<std::pair<Eigen::AlignedBox3d, int>>;
  explicit BoxTree(Boxes boxes);

  // Those whose box meets a ball, in the order of the tree; in `room`, which grows where it must.
  using Found = Span;
  Found find(const Vec3& center, double radius, std::vector<int>& room) const;

 private:
  // Boxes relative to origin_, rounded outward; of nothing: nowhere.
  struct alignas(64) Node {
    Eigen::Array<float, 8, 1> low[3], high[3];
    int of[8];  // nodes, or things
  };
  Vec3 origin_ = Vec3::Zero();
  int levels_ = 0;
  std::vector<Node> nodes_;  // level by level, the leaves first and the root last
};

// Where a face or a joint is.
struct Region {
  // Of the boxes of its parts, which hold it.
  explicit Region(const BoxTree::Boxes& boxes);

  Eigen::AlignedBox3d box;
  BoxTree parts;         // facets, or half-edges (3 facet + side)
  bool enclosed = true;  // of a face: all of its border is looked for, as joints or with facets
  int turn[2] = {0, 0};  // of a joint: FaceCell::turn of its sides on either face; 0: of both signs
};

// Inside a face nothing but its own closest point can be a minimum, and on a joint that is a line
// or a circle nothing but its own. So a query looks for faces, and the facet that holds the point;
// for joints, and the side that holds it; for corners; and for facets that hold something else.
struct FaceSearch {
  // Of a curved shell with at least one facet that is closed.
  FaceSearch(const Shell& shell, const CurvedShell& surface);

  std::vector<Region> of_face, of_joint;  // beside Faces::shapes and Faces::joints
  double slack;                           // more than rounding [m]
  // Faces and joints that are lines or circles by their numbers in Faces, and corners of faces as
  // 3 facet + corner: each as 4 times that, plus its Kind.
  enum Kind { Face = 0, Joint = 1, Corner = 2 };
  BoxTree things;
  BoxTree facets;    // with an element, or another side
  double bulge = 0;  // the largest of facets [m]
};

// Whether a side is part of a joint that is a line or a circle.
bool is_on_border(const CurvedShell& surface, int facet, int side);

// Whether, moreover, the facet owns it and both faces there are exact.
bool is_on_joint(const CurvedShell& surface, int facet, int side);

}  // namespace sphshell
