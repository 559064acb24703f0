#include "contact/query/broad_phase.hpp"

#include <algorithm>
#include <cmath>

namespace sphshell {

BroadPhase::BroadPhase(bool follow) : follow_(follow) {
  overlapping.reserve(1024);
  candidates.reserve(256);
}

void BroadPhase::find(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                      const Sphere& sphere, const CellBounds* cells) {
  double margin = 0;
  if (follow_) {
    const bool same = followed_ == &shell && followed_radius_ == sphere.radius;
    const double moved = same ? (sphere.center - last_).norm() : sphere.radius;
    last_ = sphere.center;
    // Still within the ball that the last search covered: its candidates are a superset.
    if (same && (sphere.center - anchor_).squaredNorm() <= margin_ * margin_) return;
    // A slow sphere stays near for many calls; for a fast one a wider ball does not pay.
    if (moved < 0.01 * sphere.radius)
      margin = std::clamp(16 * moved, 1e-3 * sphere.radius, 0.1 * sphere.radius);
    followed_ = &shell;
    followed_radius_ = sphere.radius;
    anchor_ = sphere.center;
    margin_ = margin;
  }
  overlapping.clear();
  const NormalCone* all = cones.data();
  shell.bvh().find_overlapping(sphere.center, sphere.radius + margin + bulge, overlapping,
                               [all](int first) {
                                 prefetch(all + first);
                                 prefetch(all + first + 3);
                               });
  keep_in_cone(shell, cones, bulge, sphere, margin, cells);
}

// The center may be inside the cone of normals of the features that a facet owns
// (Johnson and Cohen, I3D 2001), wherever it is within the margin and however far within it the
// element bulges from its triangle.
void BroadPhase::keep_in_cone(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                              const Sphere& sphere, double margin, const CellBounds* cells) {
  const Facet* facets = shell.facets().data();
  // In single precision about the shell's origin; 1e-6 and 1.000001 cover its rounding, so that
  // nothing is lost.
  const Vec3 local = sphere.center - shell.origin();
  const float c[3] = {float(local.x()), float(local.y()), float(local.z())};
  const float radius = float(sphere.radius);
  const float wide = 1e-6f * (float(shell.size()) + radius) + 1.000001f * float(margin);
  const float slack = wide + 1.000001f * float(bulge);
  candidates.clear();
  for (int f : overlapping) {
    const NormalCone& cone = cones[f];
    const float x = c[0] - cone.middle[0], y = c[1] - cone.middle[1], z = c[2] - cone.middle[2];
    // In the coordinates of the cone: height along its axis, distance from the axis by Pythagoras.
    // The center lies within the cone if that distance is below the reach of the facet plus height
    // x tan(opening).
    const float height = std::abs(x * cone.axis[0] + y * cone.axis[1] + z * cone.axis[2]);
    const float allowed = cone.reach + slack + (height + slack) * cone.tan_opening;
    const float square = x * x + y * y + z * z;
    // The ball of a cone holds all of a bent element.
    const float farthest = radius * 1.000001f + cone.reach + wide;
    if (square * 0.999999f > farthest * farthest) continue;
    if (square * 0.999999f - height * height > allowed * allowed) continue;
    prefetch(&facets[f]);
    prefetch(reinterpret_cast<const char*>(&facets[f]) + 64);
    if (cells != nullptr) prefetch(&cells[f]);
    candidates.push_back(f);
  }
}

}  // namespace sphshell
