// The faces that a mesh was made from: planes, cylinders, cones, spheres and tori.
#pragma once

#include <vector>

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
  // The unit normal of the shape of triangle t at its corner k, on the side of the triangle's own.
  Vec3 normal(const Shell& shell, int t, int k) const;
};

// What the vertices lie on to `rounding` [m], and what they over-determine.
Faces recognize_faces(const Shell& shell, const CoplanarRegions& regions, double tolerance);

}  // namespace sphshell
