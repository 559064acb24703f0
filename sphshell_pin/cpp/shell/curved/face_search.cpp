#include "shell/curved/face_search.hpp"

#include "shell/curved/curved.hpp"

namespace sphshell {
namespace {

using Box = Eigen::AlignedBox3d;
using Boxes = BoxTree::Boxes;

bool holds_more(const CurvedShell& surface, int f) {
  const FaceCell& cell = surface.face_cells()[f];
  const Owned& owned = surface.facets()[f].owned;
  if (!cell.closed) return true;
  for (int k = 0; k < 3; ++k) {
    const bool inner = owned.twin[k] == kNotOwned || cell.side[k] == FaceCell::Side::Inner;
    if (!inner && !is_on_joint(surface, f, k)) return true;
  }
  return false;
}

Box box_of(const Facet& facet) {
  return Box(facet.corner[0]).extend(facet.corner[1]).extend(facet.corner[2]);
}

Box box_of(const Facet& facet, int k) {
  return Box(facet.corner[k]).extend(facet.corner[next_corner(k)]);
}

// The boxes of the facets of each face, widened by how far they are from it.
std::vector<Region> regions_of_faces(const Shell& shell, const CurvedShell& surface) {
  std::vector<Region> out(surface.faces().shapes.size());
  for (std::size_t f = 0; f < shell.facets().size(); ++f) {
    const FaceCell& cell = surface.face_cells()[f];
    if (cell.closed) out[cell.face].extend(box_of(shell.facets()[f]), surface.facets()[f].bulge);
  }
  return out;
}

std::vector<Region> regions_of_joints(const Shell& shell, const CurvedShell& surface) {
  std::vector<Region> out(surface.faces().joints.size());
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f)
    for (int k = 0; k < 3; ++k) {
      if (!is_on_joint(surface, f, k)) continue;
      const FaceCell& cell = surface.face_cells()[f];
      out[cell.joint[k]].extend(box_of(shell.facets()[f], k), cell.bulge[k]);
    }
  return out;
}

Boxes boxes_of(const std::vector<Region>& regions) {
  Boxes out;
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (!regions[i].box.isEmpty()) out.emplace_back(regions[i].box, static_cast<int>(i));
  return out;
}

Boxes boxes_of_sides(const Shell& shell, const CurvedShell& surface) {
  Boxes out;
  for (int h = 0; h < static_cast<int>(3 * shell.facets().size()); ++h)
    if (is_on_joint(surface, triangle_of(h), side_of(h)))
      out.emplace_back(box_of(shell.facets()[triangle_of(h)], side_of(h)), h);
  return out;
}

Boxes boxes_of_corners(const Shell& shell, const CurvedShell& surface) {
  Boxes out;
  for (int h = 0; h < static_cast<int>(3 * shell.facets().size()); ++h) {
    const int f = triangle_of(h), k = side_of(h);
    if (surface.face_cells()[f].closed && surface.facets()[f].owned.vertex[k] >= 0)
      out.emplace_back(Box(shell.facets()[f].corner[k]), h);
  }
  return out;
}

Boxes boxes_of_facets(const Shell& shell, const CurvedShell& surface) {
  Boxes out;
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f)
    if (holds_more(surface, f)) out.emplace_back(box_of(shell.facets()[f]), f);
  return out;
}

}  // namespace

bool is_on_border(const CurvedShell& surface, int f, int k) {
  const FaceCell& cell = surface.face_cells()[f];
  return cell.closed && cell.side[k] == FaceCell::Side::Border &&
         surface.faces().joints[cell.joint[k]].kind != FaceJoint::Kind::Crossing;
}

bool is_on_joint(const CurvedShell& surface, int f, int k) {
  const int twin = surface.facets()[f].owned.twin[k];
  return is_on_border(surface, f, k) && twin >= 0 && surface.face_cells()[triangle_of(twin)].closed;
}

BoxTree::BoxTree(const Boxes& boxes) {
  if (boxes.empty()) return;
  // A triangle with two corners of a box has that box.
  std::vector<Vec3> corners;
  std::vector<Triangle> triangles;
  for (const auto& [box, item] : boxes) {
    const int at = static_cast<int>(corners.size());
    corners.insert(corners.end(), {box.min(), box.max()});
    triangles.push_back({at, at + 1, at});
  }
  tree_.emplace(corners, triangles, items_);
  for (int& position : items_) position = boxes[position].second;
}

void BoxTree::find(const Vec3& center, double radius, std::vector<int>& out) const {
  if (!tree_) return;
  const std::size_t first = out.size();
  tree_->find_overlapping(center, radius, out, [](int) {});
  for (std::size_t i = first; i < out.size(); ++i) out[i] = items_[out[i]];
}

std::size_t BoxTree::bytes() const {
  return items_.size() * sizeof(int) + (tree_ ? tree_->bytes() : 0);
}

std::size_t FaceSearch::bytes() const {
  std::size_t all = (of_face.size() + of_joint.size()) * sizeof(Region);
  for (const BoxTree* one : {&faces, &joints, &sides, &corners, &facets}) all += one->bytes();
  return all + cones.size() * sizeof(NormalCone);
}

void Region::extend(const Eigen::AlignedBox3d& part, double bulge) {
  reach = std::max(reach, bulge);
  box.extend(Box(part.min().array() - bulge, part.max().array() + bulge));
}

FaceSearch::FaceSearch(const Shell& shell, const CurvedShell& surface)
    : of_face(regions_of_faces(shell, surface)),
      of_joint(regions_of_joints(shell, surface)),
      slack(1e-6 * shell.size()),
      faces(boxes_of(of_face)),
      joints(boxes_of(of_joint)),
      sides(boxes_of_sides(shell, surface)),
      corners(boxes_of_corners(shell, surface)),
      facets(boxes_of_facets(shell, surface)) {
  cones.reserve(facets.items().size());
  for (const int f : facets.items()) {
    cones.push_back(surface.cones()[f]);
    bulge = std::max<double>(bulge, surface.facets()[f].bulge);
  }
}

}  // namespace sphshell
