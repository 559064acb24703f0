// Which facets a sphere may touch.
#pragma once

#include "contact/query/contact.hpp"
#include "shell/curved/cell_bounds.hpp"
#include "shell/curved/face_search.hpp"

namespace sphshell {

// The facets that may hold a minimum of the distance: by the tree of boxes, then by cones of
// normals.
class BroadPhase {
 public:
  explicit BroadPhase(bool follow);

  // Facets in the order of the tree: `overlapping` those whose box meets the sphere, widened by
  // `bulge`, `candidates` those of them that may hold a minimum of the distance. Memory of their
  // `cells`, if given, is on its way as well.
  void find(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
            const Sphere& sphere, const CellBounds* cells = nullptr);

  // The same of the facets of a search, and its `faces`, `joints` and `corners` that the sphere may
  // reach.
  void find(const Shell& shell, const LargeArray<NormalCone>& cones, const FaceSearch& search,
            const Sphere& sphere, const CellBounds* cells);

  // Facets whose box comes below the plane, widened by `bulge`, and those of them that may hold a
  // minimum of the height over it.
  void find(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
            const Plane& plane, const CellBounds* cells = nullptr);

  std::vector<int> overlapping, candidates, faces, joints, corners;

 private:
  // False where the lists still hold; else they may hold for spheres within `margin`.
  bool begin(const Shell& shell, const Sphere& sphere, double& margin);
  // Of the overlapping ones.
  void find_candidates(const Shell& shell, const LargeArray<NormalCone>& cones, double bulge,
                       const Sphere& sphere, double margin, const CellBounds* cells);

  bool follow_;
  std::vector<int> room_;
  // The lists hold while the center is within margin_ of anchor_; -1: they hold nothing.
  const Shell* followed_ = nullptr;
  double followed_radius_ = 0, margin_ = -1;
  Vec3 anchor_ = Vec3::Zero(), last_ = Vec3::Zero();
};

}  // namespace sphshell
