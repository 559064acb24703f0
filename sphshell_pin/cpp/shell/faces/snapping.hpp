// Vertices in single precision, moved onto the faces that they were rounded from.
#pragma once

#include <vector>

#include "shell/faces/recognition.hpp"

namespace sphshell {

// The vertices of the shell, each on the faces around it, planes first, where it is within
// `tolerance` [m] of them; the others, and those whose triangles would turn, stay. Empty if none
// moves, or if all faces are planes: their elements are exact as they are.
std::vector<Vec3> snapped_vertices(const Shell& shell, const Faces& faces, double tolerance);

}  // namespace sphshell
