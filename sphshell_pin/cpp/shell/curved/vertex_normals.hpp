// Normals at the corners of triangles, where none were given.
#pragma once

#include "shell/faces/recognition.hpp"

namespace sphshell {

// What stands behind the normal of a corner: its own facet; the mean of the facets around; those
// that are far higher than the ones beside them, or a face there; a surface through the vertices
// around; data of its own.
enum class Trust : char { Facet = 0, Averaged = 1, Limited = 2, Fitted = 3, Own = 4 };

struct EstimatedNormals {
  std::vector<Vec3> normals;  // unit, per triangle corner (3 per triangle)
  std::vector<Trust> trust;   // likewise
  bool given = false;         // some of them are no estimates
};

// One per vertex and fan of triangles that smooth edges join there: those of the faces where there
// are any, in a fan that they take part in too; estimates elsewhere.
EstimatedNormals estimate_normals(const Shell& shell, const CoplanarRegions& regions,
                                  const Faces& faces);

// Whether normals that came with the surface are nearly all means of the elements' around: then
// they are estimates like others, and ours are better.
bool estimated_elsewhere(const Shell& shell, const std::vector<Vec3>& given);

// Normals that came with the surface stand, but where a face has the same, exactly. Faces that they
// contradict are given up.
EstimatedNormals settle_given_normals(const Shell& shell, const std::vector<Vec3>& given,
                                      Faces& faces);

}  // namespace sphshell
