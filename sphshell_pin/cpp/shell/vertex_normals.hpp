// Normals at the corners of triangles, where none were given.
#pragma once

#include <vector>

#include "shell/shell.hpp"

namespace sphshell {

// Unit normals per triangle corner (3 per triangle), one per vertex and fan of triangles that
// smooth edges join there.
std::vector<Vec3> estimate_normals(const Shell& shell);

}  // namespace sphshell
