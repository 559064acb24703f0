// Curved elements over the triangles of a shell: cubic patches that meet the vertex normals.
#pragma once

#include "shell/curved/cell_bounds.hpp"
#include "shell/curved/face_search.hpp"
#include "shell/faces/face_cells.hpp"
#include "shell/faces/flats.hpp"
#include "shell/faces/recognition.hpp"

namespace sphshell {

// A cubic of one parameter, in powers.
struct CubicCurve {
  Vec3 c0, c1, c2, c3;

  Vec3 point(double t) const { return c0 + t * (c1 + t * (c2 + t * c3)); }
  Vec3 tangent(double t) const { return c1 + t * (2 * c2 + 3 * t * c3); }
  Vec3 second(double t) const { return 2 * c2 + 6 * t * c3; }
};

// A cubic of two, in powers of u = b1 and v = b2, the barycentric coordinates of corners 1 and 2.
template <class Value>
struct Cubic2 {
  Value c00, c10, c01, c20, c11, c02, c30, c21, c12, c03;

  // By Horner's rule; and the first derivatives.
  Value point(double u, double v) const {
    return c00 + u * (c10 + u * (c20 + u * c30)) + v * (c01 + v * (c02 + v * c03)) +
           u * v * (c11 + u * c21 + v * c12);
  }
  Value along_u(double u, double v) const {
    return c10 + u * (2 * c20 + 3 * u * c30) + v * (c11 + 2 * u * c21 + v * c12);
  }
  Value along_v(double u, double v) const {
    return c01 + v * (2 * c02 + 3 * v * c03) + u * (c11 + u * c21 + 2 * v * c12);
  }
  Value along_uu(double u, double v) const { return 2 * c20 + 6 * u * c30 + 2 * v * c21; }
  Value along_uv(double u, double v) const { return c11 + 2 * u * c21 + 2 * v * c12; }
  Value along_vv(double u, double v) const { return 2 * c02 + 6 * v * c03 + 2 * u * c12; }
};

// A curved element: a cubic map of the triangle u, v >= 0, u + v <= 1.
struct CubicPatch : Cubic2<Vec3> {
  // The polar form (blossom) at three points (u, v): of a part of the patch, a control point.
  Vec3 polar(const Eigen::Vector2d& p, const Eigen::Vector2d& q, const Eigen::Vector2d& r) const;
  // A direction that leaves side k at its parameter t into the patch, tangent to it.
  Vec3 inward(int k, double t) const;
};

// A cubic Bezier triangle, by the offsets of its control points from those of the flat facet. The
// six of the sides are kept as integers of 48 bits with a common exponent for each side: to 1e-14
// of the longest, which is round-off beside the facet. Both neighbors of a side keep the same
// numbers, so the surface has no gaps.
class CurvedFacet {
 public:
  double rise;  // of the middle along the facet's normal, above that of a PN triangle [m]
  Owned owned;  // as Facet::owned, where coplanar neighbors may still be curved
  float bulge;  // at most this far from the flat facet [m]
  bool flat;    // all offsets are zero: the exact flat facet

  // Offsets of the control points at a third (i = 0) and two thirds (1) of side k; and of the
  // center.
  Vec3 control_offset(int k, int i) const;
  Vec3 middle(const Facet& f) const;
  // The length of the largest offset on the sides [m].
  double largest_offset() const;
  void set_side(int k, const Vec3& first, const Vec3& last);

  // The element in powers of u and v; corner 0 is at (0, 0), 1 at (1, 0), 2 at (0, 1).
  CubicPatch patch(const Facet& f) const;
  // Side k as a curve from its corner at t = 0 to the next at t = 1.
  CubicCurve side(const Facet& f, int k) const;

 private:
  std::int16_t exponent_[3];
  std::int16_t high_[3][6];
  std::uint32_t low_[3][6];
};

// Tangents of the edges that leave a vertex, beside Topology::neighbors.
class Tangents {
 public:
  Vec3 operator[](int i) const;

 private:
  friend class CurvedShell;
  const LargeArray<Facet>* flat_ = nullptr;
  const LargeArray<CurvedFacet>* curved_ = nullptr;
  // 2 half-edge (3 facet + side) of the edge, + 1 if that comes towards the vertex.
  LargeArray<int> spoke_;
};

// Whether an element is curved, or why it is not.
enum class Bending : int {
  Curved = 0,
  Planar = 1,  // no normal at its corners leans
  Crease = 2,  // the elements around contradict the bend of its normals
};

enum class Trust : char;

// Makes the curved elements of the shell, and returns it. Where faces are recognized that vertices
// lie next to, for coordinates in single precision, it returns a copy that has its vertices on
// them.
std::shared_ptr<Shell> curve(const std::shared_ptr<Shell>& shell, CurveOptions options);

// The curved elements of a shell, with what queries need of them. Constant once it is made.
class CurvedShell {
 public:
  CurvedShell(const CurvedShell&) = delete;  // tangents_ refers to facets_
  CurvedShell& operator=(const CurvedShell&) = delete;

  CurvedShell(const Shell& shell, CurveOptions options);

  const LargeArray<CurvedFacet>& facets() const { return facets_; }  // in the order of the tree
  const LargeArray<NormalCone>& cones() const { return cones_; }
  const LargeArray<CellBounds>& cells() const { return cells_; }
  double bulge() const { return bulge_; }  // the largest of them [m]
  const Tangents& tangents() const { return tangents_; }
  // The faces that elements lie on: those of CAD, or recognized.
  const Faces& faces() const { return faces_; }
  // Per facet what it is of its face; empty where there are no faces.
  const LargeArray<FaceCell>& face_cells() const { return face_cells_.of; }
  // Of spheres' queries; null where there are none.
  const FaceSearch* face_search() const { return face_search_.get(); }
  // FaceCells::intruders, and why faces do not give closest points.
  const std::vector<std::pair<int, int>>& intruders() const { return face_cells_.intruders; }
  const std::vector<Inexact>& inexact() const { return face_cells_.inexact; }
  // What the shell can lie on, found at first use.
  const Flats& flats(const Shell& shell) const {
    std::call_once(flats_found_, [&] { flats_ = find_flats(shell); });
    return flats_;
  }
  // By so much regions of features overlap where faces give closest points [m].
  double gap() const { return gap_; }
  // That which gives the closest points of a facet; null: the facet's own cubic does.
  const Primitive* face_of(int facet) const {
    if (face_cells_.of.empty() || !face_cells_.of[facet].closed) return nullptr;
    return &faces_.shapes[face_cells_.of[facet].face];
  }
  // Whether the normals are the surface's own, and not estimated.
  bool exact() const { return exact_; }
  // Per corner: its normal was set aside, as a crease that the elements show divides its fan.
  const std::vector<char>& divided() const { return divided_; }
  int creases() const { return creases_; }  // edges that became creases so
  Bending bending(const Shell& shell, int triangle) const;
  // Per triangle the largest sagitta [m] that the turns between it and its neighbors, or between
  // those and theirs, account for: what the flat elements are off the surface there, about.
  std::vector<double> chord_errors(const Shell& shell) const;

 private:
  void bend_edges(const Shell& shell, const std::vector<std::uint8_t>& straight,
                  const CoplanarRegions* regions, const std::vector<Trust>& trust);
  // The steps of the constructor, in their order.
  void raise_centers(const Shell& shell);
  int corner_beyond(const Shell& shell, int half_edge) const;
  void build_cones(const Shell& shell);
  void leave_joints_whole(const Shell& shell);
  void bound_cells(const Shell& shell);

  Faces faces_;
  FaceCells face_cells_;
  std::unique_ptr<const FaceSearch> face_search_;
  double gap_ = 0;
  std::vector<Vec3> normals_;  // per triangle corner; let go when the elements are bent
  std::vector<char> divided_;
  int creases_ = 0;
  LargeArray<CurvedFacet> facets_;
  LargeArray<NormalCone> cones_;
  LargeArray<CellBounds> cells_;
  Tangents tangents_;
  double bulge_ = 0;
  bool exact_;
  mutable std::once_flag flats_found_;
  mutable Flats flats_;
};

}  // namespace sphshell
