// Closest points on the faces that facets lie on, in closed form.
#pragma once

#include "contact/query/minimum.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

// Finds the points of faces that are nearest to a sphere's center, or lowest over a plane.
class FaceFeet {
 public:
  // Adds the closest point of a face, if one of its facets holds it.
  void add_closest(const Search<Sphere>& search, int face);
  // Before each query with a plane; in constant time.
  void clear(const CurvedShell& surface);
  // Adds the lowest point of the face that a facet lies on, if it is in the facet and no other has
  // claimed it; of planes, cylinders and cones it is on a border.
  void add_lowest(const Search<Plane>& search, int facet);

 private:
  std::vector<int> room_;               // of facets
  std::vector<std::uint32_t> claimed_;  // beside the faces: the last round in which one claimed it
  std::uint32_t round_ = 0;
  const CurvedShell* of_ = nullptr;
};

// A point of a face and its unit normal on the facet's side; `place`: its Primitive::parameters();
// `center`: of the sphere whose closest point it is, or again the point.
struct FacePoint {
  const Vec3 &point, &outward, &center;
  Eigen::Vector2d place;
};
// Whether it is in a facet.
bool holds(const Shell& shell, int facet, const FacePoint& at, double tolerance);

// The point of a side nearest to a center, or lowest: of the curve that it is between two faces, or
// within one, or of its cubic.
struct SideFoot {
  double t;  // of the cubic
  Vec3 point, tangent;
};
// On the exact intersection curve by Newton's method, from the cubic's closest point. The probe is
// a Sphere, or a Plane, over which the point is lowest.
template <class Probe>
SideFoot nearest_on_side(const Shell& shell, int facet, int side, const Probe& probe);
// How it follows the center (3, 3), or the plane's normal.
template <class Probe>
Mat3 dx_dc_of(const Shell& shell, int facet, int side, const SideFoot& foot, const Probe& probe);

// The unit direction that leaves a half-edge's side at a point of it into the facet, across the
// unit tangent; t along the side.
Vec3 inward(const Shell& shell, int half_edge, double t, const Vec3& point, const Vec3& along);

}  // namespace sphshell
