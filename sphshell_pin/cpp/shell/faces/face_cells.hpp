// What a query reads of the facets that lie on faces: elements say where on which face, and the
// face gives the numbers.
#pragma once

#include <cstdint>

#include "shell/faces/primitive.hpp"
#include "shell/shell.hpp"

namespace sphshell {

class CurvedFacet;
struct Faces;

// A face gives closest points where it holds its vertices, and the borders that are cubic curves,
// to this share of the size: so much the potential may jump there.
constexpr double kMostGap = 4e-9;
// Faces that meet at less than this angle (its sine) do not determine where.
constexpr double kLeastAngle = 0.003;

// What a facet is of the face it lies on.
struct FaceCell {
  // What a side is: within one face; between two that meet at an angle, the curve on which both are
  // zero; between two that are tangent, where their normals are parallel; or the cubic curve that
  // it would be without faces.
  enum class Side : std::uint8_t { Inner, Shared, Tangent, Cubic };

  int face = -1;                 // in Faces::shapes; -1: on none
  bool exact = false;            // its closest points are those of the face: it is flat, or closed
  bool closed = false;           // the face gives them
  std::int8_t sign = 1;          // of the shape's normals along the facet's
  float upright[3] = {0, 0, 0};  // the face's normal in the middle, on the facet's side
  Side side[3] = {Side::Cubic, Side::Cubic, Side::Cubic};
  int beyond[3] = {-1, -1, -1};     // of shared and tangent sides: the other face
  int across[3] = {-1, -1, -1};     // ... and the shape that cuts the face along the border
  std::int8_t turn[3] = {1, 1, 1};  // of tangent sides: the sign of the shape across in the facet
  float bulge[3] = {0, 0, 0};       // a border runs within this distance of its chord [m]
};

// In the order of the facets; empty where no facet is on a face. Adds shapes that cut faces where
// others are tangent to them.
LargeArray<FaceCell> make_face_cells(const Shell& shell, Faces& faces,
                                     const LargeArray<CurvedFacet>& facets);

// How far the face is off the flat facet, about: at its middle and those of its sides [m].
double sagitta_of(const Facet& facet, const Primitive& shape);

// How much the normals of two tangent faces turn from each other at a point, about a chord of their
// common border: zero on that border.
double turn_between(const std::vector<Primitive>& shapes, int face, int other, const Vec3& chord,
                    const Vec3& x);

// The point next to x where both shapes are zero. False where they do not cut each other there.
bool onto_both(const Primitive& one, const Primitive& other, Vec3& x);

}  // namespace sphshell
