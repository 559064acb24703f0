// The faces that a mesh was made from: planes, cylinders, cones, spheres and tori.
#pragma once

#include "shell/faces/coplanar.hpp"
#include "shell/faces/face_joints.hpp"

namespace sphshell {

// The faces of a shell, and which triangles lie on them.
struct Faces {
  std::vector<Primitive> shapes;
  std::vector<FaceJoint> joints;  // the borders between them, where they give closest points
  std::vector<int> of;  // per triangle, in `shapes`; -1: of no kind known; empty: none at all

  int of_triangle(int t) const { return of.empty() ? -1 : of[t]; }
  // Leaves out those for which gone[face].
  void give_up(const std::vector<char>& gone);
  // The unit normal at a corner (3 triangle + k) of the shape of its triangle, on the side of the
  // triangle's own.
  Vec3 normal(const Shell& shell, int corner) const;
};

// What the vertices lie on to `rounding` [m], and what they over-determine.
Faces recognize_faces(const Shell& shell, const CoplanarRegions& regions, double tolerance);

// The vertices of the shell, each on the faces around it, planes first, where it is within
// `tolerance` [m] of them; the others, and those whose triangles would turn, stay. Empty if none
// moves, or if all faces are planes: their elements are exact as they are.
std::vector<Vec3> snapped_vertices(const Shell& shell, const Faces& faces, double tolerance);

// Moves the control points of an edge with chord d, given by their offsets from it, so that its
// curve is on the faces beside it at its thirds, as its ends are: on a plane it is then all along,
// whatever leans beside.
void settle_on_faces(const Shell& shell, const Edge& edge, const Faces& faces, const Vec3& begin,
                     const Vec3& d, std::array<Vec3, 2>& offset);

}  // namespace sphshell
