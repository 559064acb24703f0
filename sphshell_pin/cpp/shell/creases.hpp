// Which edges of a tessellation are creases, although its elements turn there by little.
#pragma once

#include <vector>

#include "shell/shell.hpp"

namespace sphshell {

// Normals closer than this [rad] are one: what they disagree about is noise.
constexpr double kSameNormal = 1e-3;

struct CornerNormals {
  std::vector<Vec3> normals;  // unit, per triangle corner (3 per triangle)
  std::vector<char>
      set_aside;    // per corner: the fan was divided, and has a normal of its own parts
  int creases = 0;  // edges that divide fans beside those that the normals came with
};

// Divides the fans of corner normals along the edges that the elements around do not explain as
// part of a curved surface. given: the normals came with the surface, rather than from
// estimate_normals.
CornerNormals divide_at_creases(const Shell& shell, std::vector<Vec3> normals, bool given);

}  // namespace sphshell
