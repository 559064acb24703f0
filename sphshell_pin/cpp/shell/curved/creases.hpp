// Which edges of a tessellation are creases, although its elements turn there by little.
#pragma once

#include "shell/faces/recognition.hpp"
#include "shell/curved/fans.hpp"

namespace sphshell {

// Normals closer than this [rad] are one: what they disagree about is noise.
constexpr double kSameNormal = 1e-3;

// Where joints turn this much [rad], no normals of a file make one surface of them.
constexpr double kSurelySharp = 1.2;

struct CornerNormals {
  std::vector<Vec3> normals;  // unit, per triangle corner (3 per triangle)
  std::vector<char>
      set_aside;    // per corner: the fan was divided, and has a normal of its own parts
  int creases = 0;  // edges that divide fans beside those that the normals came with
};

// Per corner: whether its normal, which the corners of a fan share, is no mean of those of its
// elements (by number, area, angle or Max's).
std::vector<char> independent_normals(const Shell& shell, const Fans& fans,
                                      const std::vector<Vec3>& normals);
// Whether nearly all normals are such means to the digits of a file.
bool are_means(const Shell& shell, const Fans& fans, const std::vector<Vec3>& normals);

// Divides the fans of corner normals along the edges that the elements around do not explain as
// part of a curved surface. given: the normals came with the surface, rather than from
// estimate_normals. Those of `faces` stand.
CornerNormals divide_at_creases(const Shell& shell, std::vector<Vec3> normals, bool given,
                                const Faces& faces);

}  // namespace sphshell
