#include "shell/curved/face_search.hpp"

#include <algorithm>
#include <cstdlib>
#include <limits>

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

// Widened by how far a part is from the flat one.
Box widened(const Box& part, double bulge) {
  return {Vec3(part.min().array() - bulge), Vec3(part.max().array() + bulge)};
}

// Of a facet as it is on its face, with its sides.
Box whole_box_of(const Shell& shell, const CurvedShell& surface, int f) {
  // A face of known shape may bulge a little more than its cubic.
  double bulge = 1.25 * surface.facets()[f].bulge;
  for (const float side : surface.face_cells()[f].bulge) bulge = std::max<double>(bulge, side);
  return widened(box_of(shell.facets()[f]), bulge);
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
    if (cell.closed) boxes[cell.face].emplace_back(whole_box_of(shell, surface, f), f);
  }
  std::vector<Region> out(boxes.begin(), boxes.end());
  for (std::size_t i = 0; i < out.size(); ++i)
    for (const auto& [box, f] : boxes[i])
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
    const int count = static_cast<int>(boxes[j].size());
    for (const auto& [box, h] : boxes[j])
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
    if (!regions[i].box.isEmpty()) out.emplace_back(regions[i].box, static_cast<int>(4 * i) + kind);
}

Boxes boxes_of_things(const Shell& shell, const CurvedShell& surface, const FaceSearch& search) {
  Boxes out;
  add(search.of_face, FaceSearch::Face, out);
  add(search.of_joint, FaceSearch::Joint, out);
  for (int h = 0; h < static_cast<int>(3 * shell.facets().size()); ++h) {
    const int f = triangle_of(h), k = side_of(h);
    if (surface.face_cells()[f].closed && surface.facets()[f].owned.vertex[k] >= 0)
      out.emplace_back(Box(shell.facets()[f].corner[k]), 4 * h + FaceSearch::Corner);
  }
  return out;
}

Boxes boxes_of_facets(const Shell& shell, const CurvedShell& surface) {
  Boxes out;
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f)
    if (holds_more(surface, f)) out.emplace_back(whole_box_of(shell, surface, f), f);
  return out;
}

// Divides boxes in two, so that all nodes but the last of a level are full, and across the axis
// that leaves the boxes of both halves smallest.
void put_in_order(Boxes& boxes, std::size_t from, std::size_t to) {
  if (to - from <= 8) return;
  std::size_t half = 8;
  while (2 * half < to - from) half *= 2;
  const auto divide = [&](int axis) {
    std::nth_element(boxes.begin() + from, boxes.begin() + from + half, boxes.begin() + to,
                     [axis](const auto& a, const auto& b) {
                       const double x = a.first.center()[axis], y = b.first.center()[axis];
                       return x != y ? x < y : a.second < b.second;
                     });
    Box halves[2];
    for (std::size_t i = from; i < to; ++i) halves[i < from + half ? 0 : 1].extend(boxes[i].first);
    return halves[0].sizes().sum() + halves[1].sizes().sum();
  };
  const double size[3] = {divide(0), divide(1), divide(2)};
  divide(static_cast<int>(std::min_element(size, size + 3) - size));
  put_in_order(boxes, from, from + half), put_in_order(boxes, from + half, to);
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

BoxTree::BoxTree(Boxes boxes) {
  if (boxes.empty()) return;
  put_in_order(boxes, 0, boxes.size());
  Box all;
  for (const auto& [box, thing] : boxes) all.extend(box);
  origin_ = all.center();
  // Rounding a box to single precision, and a center near it, each err by less than this.
  const double widen = 4e-7 * all.sizes().maxCoeff();
  for (auto& [box, thing] : boxes) box = widened(box.translate(-origin_), widen);
  // The boxes of one level's nodes are in those of the next.
  for (; nodes_.empty() || boxes.size() > 1; ++levels_) {
    const std::size_t begin = nodes_.size();
    for (std::size_t i = 0; i < boxes.size(); i += 8) {
      constexpr float kNowhere = std::numeric_limits<float>::infinity();
      Node& node = nodes_.emplace_back();
      Box whole;
      for (std::size_t j = 0; j < 8; ++j) {
        const bool none = i + j >= boxes.size();
        if (!none) whole.extend(boxes[i + j].first);
        node.of[j] = none ? -1 : boxes[i + j].second;
        for (int k = 0; k < 3; ++k) {
          node.low[k][j] = none ? kNowhere : static_cast<float>(boxes[i + j].first.min()[k]);
          node.high[k][j] = none ? -kNowhere : static_cast<float>(boxes[i + j].first.max()[k]);
        }
      }
      boxes[i / 8] = {whole, static_cast<int>(nodes_.size() - 1)};
    }
    boxes.resize(nodes_.size() - begin);
  }
}

// Level by level, so that nodes do not wait for each other.
BoxTree::Found BoxTree::find(const Vec3& center, double radius, std::vector<int>& room) const {
  if (nodes_.empty()) return {nullptr, nullptr};
  const Eigen::Vector3f c = (center - origin_).cast<float>();
  const float reach = float(radius) * 1.000001f;
  // Nothing is infinitely far.
  const float limit = std::min(reach * reach, std::numeric_limits<float>::max());
  std::size_t first = 0, last = 1;
  if (room.empty()) room.resize(64);
  room[0] = static_cast<int>(nodes_.size()) - 1;
  for (int level = 0; level < levels_; ++level) {
    std::size_t end = last;
    for (std::size_t i = first; i < last; ++i) {
      if (room.size() < end + 8) room.resize(2 * room.size());
      const Node& node = nodes_[room[i]];
      Eigen::Array<float, 8, 1> square = Eigen::Array<float, 8, 1>::Zero();
      for (int k = 0; k < 3; ++k)
        square += (node.low[k] - c[k]).max(c[k] - node.high[k]).max(0.0f).square();
      int* const list = room.data();
      for (int j = 0; j < 8; ++j) list[end] = node.of[j], end += square[j] <= limit;
    }
    first = last, last = end;
  }
  return {room.data() + first, room.data() + last};
}

Region::Region(const Boxes& boxes) : parts(boxes) {
  for (const auto& [part, thing] : boxes) box.extend(part);
}

FaceSearch::FaceSearch(const Shell& shell, const CurvedShell& surface)
    : of_face(regions_of_faces(shell, surface)),
      of_joint(regions_of_joints(shell, surface)),
      slack(1e-6 * shell.size()),
      things(boxes_of_things(shell, surface, *this)),
      facets(boxes_of_facets(shell, surface)) {
  for (int f = 0; f < static_cast<int>(shell.facets().size()); ++f)
    if (holds_more(surface, f)) bulge = std::max<double>(bulge, surface.facets()[f].bulge);
}

}  // namespace sphshell
