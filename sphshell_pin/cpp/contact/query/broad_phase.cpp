#include "contact/query/broad_phase.hpp"

namespace sphshell {

BroadPhase::BroadPhase(bool follow) : follow_(follow) {
  overlapping.reserve(1024);
  candidates.reserve(256);
}

// Those of the first and the last facet that a leaf can hold.
static void prefetch_leaf(const LargeArray<NormalCone>& cones, int first) {
  prefetch(cones.data() + first);
  prefetch(cones.data() + first + 3);
}

bool BroadPhase::begin(const Shell& shell, const Sphere& sphere, double& margin) {
  margin = 0;
  if (!follow_) return true;
  const bool same = followed_ == &shell && followed_radius_ == sphere.radius;
  const double moved = same ? (sphere.center - last_).norm() : sphere.radius;
  last_ = sphere.center;
  // Still within the ball that the last search covered: its candidates are a superset.
  if (same && (sphere.center - anchor_).squaredNorm() <= margin_ * margin_) return false;
  // A slow sphere stays near for many calls; for a fast one a wider ball does not pay.
  if (moved < 0.01 * sphere.radius)
    margin = std::clamp(16 * moved, 1e-3 * sphere.radius, 0.1 * sphere.radius);
  followed_ = &shell;
  followed_radius_ = sphere.radius;
  anchor_ = sphere.center;
  margin_ = margin;
  return true;
}

void BroadPhase::find(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                      const Sphere& sphere, const CellBounds* cells) {
  double margin;
  if (!begin(shell, sphere, margin)) return;
  overlapping.clear();
  shell.bvh().find_overlapping(sphere.center, sphere.radius + margin + bulge, overlapping,
                               [&](int first) { prefetch_leaf(cones, first); });
  find_candidates(shell, cones, bulge, sphere, margin, cells);
}

void BroadPhase::find(const Shell& shell, const LargeArray<NormalCone>& cones,
                      const FaceSearch& search, const Sphere& sphere, const CellBounds* cells) {
  double margin;
  if (!begin(shell, sphere, margin)) return;
  const double reach = sphere.radius + margin;
  faces.clear(), joints.clear(), corners.clear();
  std::vector<int>* const lists[] = {&faces, &joints, &corners};
  for (const int one : search.things.find(sphere.center, reach, room_))
    lists[one & 3]->push_back(one >> 2);
  const BoxTree::Found found = search.facets.find(sphere.center, reach, room_);
  overlapping.assign(found.begin(), found.end());
  find_candidates(shell, cones, search.bulge, sphere, margin, cells);
}

// At a minimum the plane's normal is among those of the features that the facet owns.
void BroadPhase::find(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                      const Plane& plane, const CellBounds* cells) {
  followed_ = nullptr;
  overlapping.clear(), candidates.clear();
  shell.bvh().find_below(plane.normal, plane.offset + bulge, overlapping,
                         [&](int first) { prefetch_leaf(cones, first); });
  const float n[3] = {float(plane.normal.x()), float(plane.normal.y()), float(plane.normal.z())};
  const double local = plane.offset - plane.normal.dot(shell.origin());
  const float limit = float(local + 1e-6 * (shell.size() + std::abs(local)));
  for (int f : overlapping) {
    const NormalCone& cone = cones[f];
    const float along = n[0] * cone.axis[0] + n[1] * cone.axis[1] + n[2] * cone.axis[2];
    // The tangent of the angle between them, squared, without a division; 1e-5 for the rounding.
    const float most = cone.tan_opening * std::abs(along) + 1e-5f;
    if (cone.tan_opening < kAnyOpening && 1 - along * along > most * most + 1e-6f) continue;
    // The ball of a cone holds all of a bent element.
    if (n[0] * cone.middle[0] + n[1] * cone.middle[1] + n[2] * cone.middle[2] - cone.reach > limit)
      continue;
    prefetch_all(shell.facets()[f]);
    if (cells != nullptr) prefetch(&cells[f]);
    candidates.push_back(f);
  }
  // A face of known shape may bulge a little more than its cubic.
  const auto is_above = [&](int f) {
    const Vec3* at = shell.facets()[f].corner;
    const double deepest = std::max({plane.depth(at[0]), plane.depth(at[1]), plane.depth(at[2])});
    return deepest + 1.25 * (cells ? cells[f].bulge : bulge) <= 0;
  };
  erase_if(candidates, is_above);
}

// The center may be inside the cone of normals of the features that a facet owns
// (Johnson and Cohen, I3D 2001), wherever it is within the margin and however far within it the
// element bulges from its triangle.
void BroadPhase::find_candidates(const Shell& shell, const LargeArray<NormalCone>& cones,
                                 double bulge, const Sphere& sphere, double margin,
                                 const CellBounds* cells) {
  candidates.clear();
  if (overlapping.empty()) return;
  const Facet* facets = shell.facets().data();
  // In single precision about the shell's origin; 1e-6 and 1.000001 cover its rounding, so that
  // nothing is lost.
  const Vec3 local = sphere.center - shell.origin();
  const float c[3] = {float(local.x()), float(local.y()), float(local.z())};
  const float radius = float(sphere.radius);
  const float wide = 1e-6f * (float(shell.size()) + radius) + 1.000001f * float(margin);
  const float slack = wide + 1.000001f * float(bulge);
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
    prefetch_all(facets[f]);
    if (cells != nullptr) prefetch(&cells[f]);
    candidates.push_back(f);
  }
}

}  // namespace sphshell
