#include "shell/curved/curved.hpp"

namespace sphshell {
namespace {

using Box = Eigen::AlignedBox3d;
using Boxes = BoxTree::Boxes;

// To look at so many parts of a face or a joint takes no longer than to search a tree of them.
constexpr std::size_t kFew = 8;

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

// Widened by how far a part is from the flat one.
Box widened(const Box& part, double bulge) {
  return {Vec3(part.min().array() - bulge), Vec3(part.max().array() + bulge)};
}

// Whether a side of a closed facet is within the face, or one that is looked for.
bool is_known(const CurvedShell& surface, int f, int k) {
  const int beyond = surface.cells()[f].beyond[k];
  const auto owns = [&](int g, int l) { return surface.facets()[g].owned.twin[l] != kNotOwned; };
  return surface.face_cells()[f].side[k] == FaceCell::Side::Inner || owns(f, k) ||
         (beyond >= 0 && owns(triangle_of(beyond), side_of(beyond)));
}

std::vector<Region> regions_of_faces(const Shell& shell, const CurvedShell& surface) {
  std::vector<Boxes> boxes(surface.faces().shapes.size());
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f) {
    const FaceCell& cell = surface.face_cells()[f];
    if (!cell.closed) continue;
    // A face of known shape may bulge a little more than its cubic.
    double bulge = 1.25 * surface.facets()[f].bulge;
    for (const float side : cell.bulge) bulge = std::max<double>(bulge, side);
    boxes[cell.face].emplace_back(widened(box_of(shell.facets()[f]), bulge), f);
  }
  std::vector<Region> out(boxes.begin(), boxes.end());
  for (std::size_t i = 0; i < out.size(); ++i)
    for (const int f : out[i].parts.items())
      for (int k = 0; k < 3; ++k) out[i].enclosed = out[i].enclosed && is_known(surface, f, k);
  return out;
}

std::vector<Region> regions_of_joints(const Shell& shell, const CurvedShell& surface) {
  const std::vector<FaceJoint>& joints = surface.faces().joints;
  std::vector<Boxes> boxes(joints.size());
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f)
    for (int k = 0; k < 3; ++k) {
      if (!is_on_joint(surface, f, k)) continue;
      const FaceCell& cell = surface.face_cells()[f];
      boxes[cell.joint[k]].emplace_back(widened(box_of(shell.facets()[f], k), cell.bulge[k]),
                                        3 * f + k);
    }
  std::vector<Region> out(boxes.begin(), boxes.end());
  for (std::size_t j = 0; j < out.size(); ++j) {
    const int count = static_cast<int>(out[j].parts.items().size());
    for (const int h : out[j].parts.items())
      for (const int one : {h, surface.facets()[triangle_of(h)].owned.twin[side_of(h)]}) {
        const FaceCell& cell = surface.face_cells()[triangle_of(one)];
        out[j].turn[joints[j].which(cell.face)] += cell.turn[side_of(one)];
      }
    for (int& turn : out[j].turn) turn = std::abs(turn) == count ? turn / std::max(count, 1) : 0;
  }
  return out;
}

void add(const std::vector<Region>& regions, FaceSearch::Kind kind, Boxes& out) {
  for (std::size_t i = 0; i < regions.size(); ++i)
    if (!regions[i].box.isEmpty()) out.emplace_back(regions[i].box, static_cast<int>(3 * i) + kind);
}

Boxes boxes_of_things(const Shell& shell, const CurvedShell& surface, const FaceSearch& search) {
  Boxes out;
  add(search.of_face, FaceSearch::Face, out);
  add(search.of_joint, FaceSearch::Joint, out);
  for (int h = 0; h < static_cast<int>(3 * shell.facets().size()); ++h) {
    const int f = triangle_of(h), k = side_of(h);
    if (surface.face_cells()[f].closed && surface.facets()[f].owned.vertex[k] >= 0)
      out.emplace_back(Box(shell.facets()[f].corner[k]), 3 * h + FaceSearch::Corner);
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

BoxTree::BoxTree(const Boxes& boxes, std::size_t few) {
  if (boxes.size() <= few) {
    for (const auto& [box, item] : boxes) items_.push_back(item);
    return;
  }
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
  if (!tree_) return void(out.insert(out.end(), items_.begin(), items_.end()));
  const std::size_t first = out.size();
  tree_->find_overlapping(center, radius, out, [](int) {});
  for (std::size_t i = first; i < out.size(); ++i) out[i] = items_[out[i]];
}

std::size_t BoxTree::bytes() const {
  return items_.size() * sizeof(int) + (tree_ ? tree_->bytes() : 0);
}

std::size_t FaceSearch::bytes() const {
  std::size_t all = things.bytes() + facets.bytes();
  for (const auto* regions : {&of_face, &of_joint})
    for (const Region& one : *regions) all += sizeof(Region) + one.parts.bytes();
  return all + cones.size() * sizeof(NormalCone);
}

Region::Region(const Boxes& boxes) : parts(boxes, kFew) {
  for (const auto& [part, item] : boxes) box.extend(part);
}

FaceSearch::FaceSearch(const Shell& shell, const CurvedShell& surface)
    : of_face(regions_of_faces(shell, surface)),
      of_joint(regions_of_joints(shell, surface)),
      slack(1e-6 * shell.size()),
      things(boxes_of_things(shell, surface, *this)),
      facets(boxes_of_facets(shell, surface)) {
  cones.reserve(facets.items().size());
  for (const int f : facets.items()) {
    cones.push_back(surface.cones()[f]);
    bulge = std::max<double>(bulge, surface.facets()[f].bulge);
  }
}

}  // namespace sphshell
