// What a query reads of the facets that lie on faces: elements say where on which face, and the
// face gives the numbers.
#pragma once

#include "shell/faces/face_joints.hpp"
#include "shell/shell.hpp"

namespace sphshell {

class CurvedFacet;
struct Faces;

// What is measured at a few places may be larger between them.
constexpr double kBulgeMargin = 1.5;

// What a facet is of the face it lies on.
struct FaceCell {
  // What a side is: within one face; the joint of two faces; or the cubic curve that it would be
  // without faces.
  enum class Side : std::uint8_t { Inner, Border, Cubic };

  int face = -1;                 // in Faces::shapes; -1: on none
  bool exact = false;            // its closest points are those of the face: it is flat, or closed
  bool closed = false;           // the face gives them
  std::int8_t sign = 1;          // of the shape's normals along the facet's
  float upright[3] = {0, 0, 0};  // the face's normal in the middle, on the facet's side
  Side side[3] = {Side::Cubic, Side::Cubic, Side::Cubic};
  std::int8_t turn[3] = {1, 1, 1};  // of borders: the sign of FaceJoint::across on the facet's side
  int joint[3] = {-1, -1, -1};      // of borders: in Faces::joints
  float bulge[3] = {0, 0, 0};       // a border runs within this distance of its chord [m]
  int intruder = -1;  // the border of another facet, which bulges into this one: in FaceCells
  // Of the corners: Primitive::parameters(), unwrapped. Straight lines there divide a face.
  double place[3][2];
};

// Why a face does not give closest points: its border to another one (-1: to no face) is off it by
// so much [m], or, where the other is the face itself, a vertex.
struct Inexact {
  int face, other;
  double off;
};

struct FaceCells {
  // In the order of the facets; empty where no face gives closest points.
  LargeArray<FaceCell> of;
  // Borders that other facets of the face have to know of: half-edge, and the next one or -1.
  std::vector<std::pair<int, int>> intruders;
  std::vector<Inexact> inexact;
};

// Adds the joints of the faces.
FaceCells make_face_cells(const Shell& shell, Faces& faces, const LargeArray<CurvedFacet>& facets);

// How far a point of a face is within the line that divides it along side k of a facet, and how far
// it may be without by rounding. Straight in the parameters of the face, whose `place` it is; on
// planes and spheres in the plane through the chord and the face's normal.
struct WithinLine {
  double inside, overlap;
};
WithinLine within_straight(const Primitive& shape, const FaceCell& cell, int k,
                           const Eigen::Vector2d& place);
inline WithinLine within_line(const Primitive& shape, const FaceCell& cell, const Facet& facet,
                              int k, const Vec3& point, const Eigen::Vector2d& place,
                              double tolerance) {
  if (shape.has_parameters()) return within_straight(shape, cell, k, place);
  const Vec3 &p = facet.corner[k], &q = facet.corner[next_corner(k)];
  Vec3 n;
  shape.distance((p + q) / 2, n);
  return {cell.sign * n.cross(q - p).dot(point - p), tolerance * (q - p).norm()};
}

// The points of a face in the middle of the sides of a facet, and of the facet: a long chord of a
// thin tube may be on its other side.
std::array<Vec3, 4> middles_of(const Primitive& shape, const FaceCell& cell, const Facet& facet,
                               double size);

}  // namespace sphshell
