// Vertices and curves of elements, moved onto the faces that they are off by rounding.
#pragma once

#include <array>
#include <vector>

#include "shell/faces/recognition.hpp"

namespace sphshell {

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
