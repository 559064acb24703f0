#include "shell/faces/face_cells.hpp"

#include <map>
#include <stdexcept>
#include <string>

#include "shell/curved/curved.hpp"

namespace sphshell {

constexpr double kTurn = 6.283185307179586;
// Facets of one face overlap by this share of their parameters: one of them has each point.
constexpr double kOverlap = 1e-9;
// Facets whose corners are off their plane by more than this share of the size are not flat on it.
constexpr double kOffPlane = 1e-13;
// Faces whose numbers differ by less than this share of the size are one.
constexpr double kEqual = 1e-12;

// The difference of two parameters, of angles by the shorter way.
static double difference(double from, double to, bool angle) {
  return angle ? to - from - kTurn * std::round((to - from) / kTurn) : to - from;
}

// Per round shape the first that is the same surface, to `most` [m] within about the size.
static std::vector<int> first_of_equals(const std::vector<Primitive>& shapes, double size,
                                        double most) {
  // Places on the second are on the first: that holds whatever their numbers refer to.
  const auto equal = [&](const Primitive& a, const Primitive& b) {
    if (a.kind != b.kind || !(std::abs(a.second - b.second) * size <= most)) return false;
    if (a.kind == FaceKind::Cone && !(a.axis.dot(b.axis) > 0)) return false;
    if (a.kind != FaceKind::Cone && !(std::abs(a.radius - b.radius) <= most)) return false;
    for (int i = 0; i < 8; ++i) {
      const Vec3 aside(i & 1 ? 0.9 : -1.1, i & 2 ? 1.3 : -0.8, i & 4 ? 0.7 : -1.2);
      if (!(std::abs(a.distance(b.onto(b.point + size * aside))) <= most)) return false;
    }
    return true;
  };
  std::vector<int> out(shapes.size()), round;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    out[i] = static_cast<int>(i);
    if (shapes[i].kind == FaceKind::Plane) continue;
    const auto first = std::find_if(round.begin(), round.end(),
                                    [&](int j) { return equal(shapes[j], shapes[i]); });
    if (first == round.end())
      round.push_back(out[i]);
    else
      out[i] = *first;
  }
  return out;
}

std::array<Vec3, 4> middles_of(const Primitive& shape, const FaceCell& cell, const Facet& facet,
                               double size) {
  std::array<Vec3, 4> out;
  for (int i = 0; i < 4; ++i) {
    Vec3 chord = Vec3::Zero();
    Eigen::Vector2d place(0, 0);
    int turned = 0, count = 0;
    for (int k = 0; k < 3; ++k) {
      if (i < 3 && k == previous_corner(i)) continue;
      chord += facet.corner[k], ++count;
      place[1] += cell.place[k][1];
      // The tip of a cone has no angle.
      if (!std::isnan(cell.place[k][0])) place[0] += cell.place[k][0], ++turned;
    }
    place[0] /= turned, place[1] /= count;
    out[i] =
        shape.has_parameters() && turned > 0 ? shape.at(place, size) : shape.onto(chord / count);
  }
  return out;
}

WithinLine within_straight(const Primitive& shape, const FaceCell& cell, int k,
                           const Eigen::Vector2d& place) {
  const double *a = cell.place[k], *b = cell.place[next_corner(k)];
  // At a cone's tip every angle will do: that of the other end.
  const double begin = std::isnan(a[0]) ? b[0] : a[0];
  const double u = std::isnan(b[0]) ? 0 : b[0] - begin, v = b[1] - a[1];
  const double inside = u * difference(a[1], place[1], shape.kind == FaceKind::Torus) -
                        v * difference(begin, place[0], true);
  return {cell.sign * inside, kOverlap * (std::abs(u) + std::abs(v))};
}

namespace {

// Makes the cells: what each side is is decided once, for the facets on both sides of it.
class CellMaker {
 public:
  CellMaker(const Shell& shell, Faces& faces, const LargeArray<CurvedFacet>& facets)
      : shell_(shell), faces_(faces), facets_(facets), gap_(kMostGap * shell.size()) {}

  FaceCells make() {
    if (faces_.of.empty()) return {};
    cell_of_.resize(facets_.size());
    cells_.reserve(facets_.size() - std::count(faces_.of.begin(), faces_.of.end(), -1) + 1);
    cells_.emplace_back();
    open_.assign(facets_.size(), 0);
    told_.assign(faces_.shapes.size(), 0);
    one_of_ = first_of_equals(faces_.shapes, shell_.size(), kEqual * shell_.size());
    for (std::size_t f = 0; f < facets_.size(); ++f) place(static_cast<int>(f));
    for (std::size_t f = 0; f < facets_.size(); ++f)
      for (int k = 0; k < 3; ++k) decide(static_cast<int>(f), k);
    settle();
    if (std::none_of(cells_.begin(), cells_.end(), [](const FaceCell& one) { return one.closed; }))
      return std::move(out_);
    check_sides();
    find_intruders();
    out_.of.reserve(facets_.size());
    for (std::size_t f = 0; f < facets_.size(); ++f) out_.of.push_back(of_facet(f));
    return std::move(out_);
  }

 private:
  // Faces of one shape, as the halves of a tube are, are one.
  int face_of_facet(int f) const {
    const int face = faces_.of_triangle(shell_.triangle_of_facet(f));
    return face < 0 ? face : one_of_[face];
  }
  FaceCell& of_facet(std::size_t f) { return cells_[cell_of_[f]]; }
  const FaceCell& of_facet(std::size_t f) const { return cells_[cell_of_[f]]; }
  bool is_round(int face) const { return face >= 0 && faces_.shapes[face].kind != FaceKind::Plane; }

  // The half-edge of the facet beyond a side, if the surface goes on there; else -1.
  int beyond(int f, int k) const {
    const int h = shell_.half_edge(3 * f + k), g = shell_.topology().other_half_edge(h);
    return g >= 0 && shell_.opposed(h, g) ? shell_.facet_half_edge(g) : -1;
  }

  // Leaves a facet to its cubic: its border to another face (its own: a vertex) is off its face.
  void give_up(int f, int other, double off) {
    const int face = faces_.of_triangle(shell_.triangle_of_facet(f));
    if (!told_[face]) out_.inexact.push_back({face, other, off});
    told_[face] = 1;
    if (!std::exchange(open_[f], 1)) opened_.push_back(f);
  }

  // How far the cubic of a side is off the facet's face [m].
  double off_face(int f, int k) const {
    const Primitive& shape = faces_.shapes[of_facet(f).face];
    const CubicCurve side = facets_[f].side(shell_.facets()[f], k);
    double most = 0;
    for (const double s : {0.15, 0.3, 0.5, 0.7, 0.85})
      most = std::max(most, std::abs(shape.distance(side.point(s))));
    return most;
  }

  void place(int f) {
    const int face = face_of_facet(f);
    cell_of_[f] = face < 0 ? 0 : static_cast<int>(cells_.size());
    if (face < 0) return;
    FaceCell& cell = cells_.emplace_back();
    cell.face = face;
    const Facet& facet = shell_.facets()[f];
    const Primitive& shape = faces_.shapes[cell.face];
    double first[2] = {0, 0};
    for (int i = 0; i < 3; ++i) {
      const double off = std::abs(shape.distance(facet.corner[i]));
      if (!(off <= gap_)) give_up(f, cell.face, off);
      if (!shape.has_parameters()) continue;
      const Eigen::Vector2d at = shape.parameters(facet.corner[i], shell_.size());
      for (int c = 0; c < 2; ++c) {
        double& mine = cell.place[i][c] = at[c];
        if (i == 0 || std::isnan(first[c])) first[c] = mine;
        const bool angle = c == 0 || shape.kind == FaceKind::Torus;
        if (angle && !std::isnan(mine)) mine -= kTurn * std::round((mine - first[c]) / kTurn);
      }
    }
    Vec3 n;
    shape.distance(middles_of(shape, cell, facet, shell_.size())[3], n);
    cell.sign = turn_of(shape, cell, facet, n) < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) cell.upright[i] = static_cast<float>(cell.sign * n[i]);
  }

  // Positive where a facet turns as the face's parameters do, or about the center of a sphere.
  static double turn_of(const Primitive& shape, const FaceCell& cell, const Facet& facet,
                        const Vec3& normal) {
    if (shape.has_parameters()) {
      const double (&at)[3][2] = cell.place;
      const double u = at[1][0] - at[0][0], v = at[1][1] - at[0][1];
      const double s = at[2][0] - at[0][0], t = at[2][1] - at[0][1], turn = u * t - s * v;
      // But not of three corners on one of their lines, nor at a tip.
      if (std::abs(turn) > kOverlap * (std::abs(u) + std::abs(v) + std::abs(s) + std::abs(t)))
        return turn;
    }
    return normal.dot(facet.normal);
  }

  // Whether a facet is not on its face as it is.
  bool is_off(int f) const {
    const int face = of_facet(f).face;
    if (is_round(face) || !facets_[f].flat) return true;
    const Vec3* p = shell_.facets()[f].corner;
    return std::any_of(p, p + 3, [&](const Vec3& x) {
      return std::abs(faces_.shapes[face].distance(x)) > kOffPlane * shell_.size();
    });
  }

  // Flat facets of planes far from anything round stay as they are.
  bool is_bent(int f) const {
    const int face = of_facet(f).face;
    if (face < 0 || is_off(f)) return face >= 0;
    for (int k = 0; k < 3; ++k) {
      const int h = beyond(f, k);
      if (h >= 0 && is_round(of_facet(triangle_of(h)).face)) return true;
    }
    return false;
  }

  void decide(int f, int k) {
    FaceCell& cell = of_facet(f);
    if (cell.face < 0 || cell.side[k] == FaceCell::Side::Border) return;  // decided from beyond it
    const int h = beyond(f, k), other = h < 0 ? -1 : of_facet(triangle_of(h)).face;
    if (other == cell.face) cell.side[k] = FaceCell::Side::Inner;
    if (other == cell.face || !(is_bent(f) || (h >= 0 && is_bent(triangle_of(h))))) return;
    cell.bulge[k] = static_cast<float>(kBulgeMargin * bulge_of(f, k) + gap_);
    const int joint = other >= 0 && h > 3 * f + k ? joint_of(f, k, cell.face, other) : -1;
    if (joint >= 0 && agree(joint, 3 * f + k, h)) return;
    if (const double off = off_face(f, k); off > gap_) give_up(f, other, off);
  }

  double bulge_of(int f, int k) const {
    return std::max(facets_[f].control_offset(k, 0).norm(), facets_[f].control_offset(k, 1).norm());
  }

  // The joint of two faces at a side, new or known; -1 if they have none there.
  int joint_of(int f, int k, int face, int other) {
    const Facet& facet = shell_.facets()[f];
    const Vec3 &p = facet.corner[k], &q = facet.corner[next_corner(k)];
    const int a = std::min(face, other), b = std::max(face, other);
    const Primitive &one = faces_.shapes[a], &two = faces_.shapes[b];
    std::optional<FaceJoint> found = find_joint(faces_.shapes, a, b, p, q, gap_);
    if (!found) {
      // Where both hold at the ends, in which they may be tangent, and cut each other between.
      for (const Vec3& x : {p, q})
        if (!(std::max(std::abs(one.distance(x)), std::abs(two.distance(x))) <= gap_)) return -1;
      const CubicCurve side = facets_[f].side(facet, k);
      std::vector<Vec3> points{p};
      for (const double s : {0.15, 0.3, 0.5, 0.7, 0.85}) {
        points.push_back(side.point(s));
        if (!onto_both(one, two, points.back())) return -1;
      }
      points.push_back(q);
      found.emplace();
      found->face[0] = a, found->face[1] = b, found->across[0] = two, found->across[1] = one;
      find_branches(faces_.shapes, points, shell_.size(), *found);
    }
    std::vector<int>& known = joints_[{a, b}];
    for (const int j : known) {
      const FaceJoint& it = faces_.joints[j];
      if (it.kind != found->kind) continue;
      if (it.kind == FaceJoint::Kind::Crossing ? it.branches_as(*found, gap_)
                                               : is_one(it, *found, p, q))
        return j;
    }
    known.push_back(static_cast<int>(faces_.joints.size()));
    faces_.joints.push_back(*found);
    return known.back();
  }

  // Whether two lines or circles are one, as both faces are one between them. Faces that are nearly
  // tangent cross twice, and rounding chooses which of both a side is: all along it must be one.
  bool is_one(const FaceJoint& known, const FaceJoint& found, const Vec3& p, const Vec3& q) const {
    for (const double s : {0.0, 0.5, 1.0}) {
      const Vec3 x = found.nearest(p + s * (q - p)), y = known.nearest(x), middle = (x + y) / 2;
      if (!((y - x).norm() < (q - p).norm())) return false;
      for (const int face : known.face)
        if (!(std::abs(faces_.shapes[face].distance(middle)) <= gap_ &&
              std::abs(faces_.shapes[face].distance(y)) <= gap_))
          return false;
    }
    return true;
  }

  // The point of a joint next to x.
  Vec3 on_joint(const FaceJoint& joint, Vec3 x) const {
    if (joint.kind != FaceJoint::Kind::Crossing) return joint.nearest(x);
    onto_both(faces_.shapes[joint.face[0]], joint.across[0], x);
    return x;
  }

  // Writes a joint to the facets on both sides of it. False, and to none, if it does not divide
  // them: where a joint is tangent and the surface smooth, they are on two sides of one shape.
  bool agree(int j, int h, int g) {
    const FaceJoint& joint = faces_.joints[j];
    const int halves[2] = {h, g};
    std::int8_t turn[2];
    Vec3 outward[2];
    double bulge = 0;
    for (int i = 0; i < 2; ++i) {
      const int f = triangle_of(halves[i]), k = side_of(halves[i]);
      const Facet& facet = shell_.facets()[f];
      const Vec3 &p = facet.corner[k], &q = facet.corner[next_corner(k)];
      const CubicCurve side = facets_[f].side(facet, k);
      for (const double s : {0.0, 0.15, 0.3, 0.5, 0.7, 0.85, 1.0}) {
        const Vec3 x = side.point(s);
        const bool end = s == 0 || s == 1;
        const Vec3 on = end && joint.kind == FaceJoint::Kind::Crossing ? x : on_joint(joint, x);
        bulge = std::max(bulge, (on - p - s * (q - p)).norm());
        if (s != 0.5) continue;
        const int face = of_facet(f).face;
        Vec3 n, away;
        faces_.shapes[face].distance(on, n);
        joint.divide(face, on, away);
        outward[i] = of_facet(f).sign * n;
        turn[i] = outward[i].cross(q - p).dot(away) < 0 ? -1 : 1;
      }
      if (!(bulge < (q - p).norm())) return false;
    }
    if (joint.tangent && (outward[0].dot(outward[1]) > 0) == (turn[0] == turn[1])) return false;
    for (int i = 0; i < 2; ++i) {
      FaceCell& cell = of_facet(triangle_of(halves[i]));
      const int k = side_of(halves[i]);
      cell.side[k] = FaceCell::Side::Border;
      cell.joint[k] = j, cell.turn[k] = turn[i];
      cell.bulge[k] = static_cast<float>(kBulgeMargin * bulge + gap_);
    }
    return true;
  }

  // Of facets that are left to their cubics the neighbors end on the same curves, and are left,
  // too, where those are off their face. Then what each facet is.
  void settle() {
    while (!opened_.empty()) {
      const int g = opened_.back();
      opened_.pop_back();
      for (int i = 0; i < 3; ++i) {
        const int h = beyond(g, i), f = triangle_of(h), k = side_of(h);
        if (h < 0 || of_facet(f).face < 0 || open_[f]) continue;
        of_facet(f).side[k] = FaceCell::Side::Cubic;
        of_facet(f).bulge[k] = static_cast<float>(kBulgeMargin * bulge_of(f, k) + gap_);
        if (const double off = off_face(f, k); off > gap_) give_up(f, of_facet(g).face, off);
      }
    }
    std::vector<char> asked(faces_.shapes.size(), 0);
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      FaceCell& cell = of_facet(f);
      if (cell.face < 0) continue;
      // A face is asked for closest points where it, its elements or a neighbor is curved.
      bool needed = is_off(static_cast<int>(f));
      for (int k = 0; k < 3; ++k)
        if (cell.side[k] == FaceCell::Side::Border) {
          const FaceJoint& joint = faces_.joints[cell.joint[k]];
          needed = needed || is_round(joint.face[1 - joint.which(cell.face)]);
        }
      cell.exact = !needed || !open_[f];
      cell.closed = needed && !open_[f];
      if (cell.closed) asked[cell.face] = 1;
    }
    // And then within it, too: one question for all of its facets.
    for (std::size_t f = 0; f < facets_.size(); ++f) {
      FaceCell& cell = of_facet(f);
      if (cell.face < 0 || cell.closed) continue;
      cell.closed = asked[cell.face] && !open_[f] &&
                    std::all_of(cell.side, cell.side + 3,
                                [](FaceCell::Side side) { return side == FaceCell::Side::Inner; });
      for (int k = 0; k < 3 && !cell.closed; ++k) cell.side[k] = FaceCell::Side::Cubic;
    }
  }

  // No center is lost at a side, or counted twice, if both facets read one joint there.
  void check_sides() const {
    for (int h = 0; h < static_cast<int>(3 * facets_.size()); ++h) {
      const FaceCell& cell = of_facet(triangle_of(h));
      const int k = side_of(h), g = cell.closed ? beyond(triangle_of(h), k) : -1;
      if (g < h || !of_facet(triangle_of(g)).closed) continue;
      const FaceCell& other = of_facet(triangle_of(g));
      if (cell.side[k] != other.side[side_of(g)] || cell.joint[k] != other.joint[side_of(g)])
        throw std::logic_error("the facets of side " + std::to_string(h) + " read two joints");
    }
  }

  // Where a border bulges inward of its chord it may pass through facets that have but a corner on
  // it: they must know of it.
  void find_intruders() {
    std::map<int, std::vector<int>> around;  // facets at the vertices of such borders
    std::vector<int> borders;
    const auto vertex = [&](int h) { return shell_.vertex(shell_.half_edge(h)); };
    const auto on_border = [&](int h, double s) -> Vec3 {
      const int f = triangle_of(h), k = side_of(h);
      return on_joint(faces_.joints[of_facet(f).joint[k]],
                      facets_[f].side(shell_.facets()[f], k).point(s));
    };
    const auto inside = [&](int f, int k, const Vec3& x, double margin) {
      const FaceCell& cell = of_facet(f);
      const Primitive& shape = faces_.shapes[cell.face];
      const Eigen::Vector2d at = shape.has_parameters() ? shape.parameters(x, shell_.size())
                                                        : Eigen::Vector2d(Eigen::Vector2d::Zero());
      const WithinLine line = within_line(shape, cell, shell_.facets()[f], k, x, at, gap_);
      return line.inside > margin * line.overlap;
    };
    for (std::size_t f = 0; f < facets_.size(); ++f)
      for (int k = 0; k < 3 && of_facet(f).closed; ++k) {
        const int h = 3 * static_cast<int>(f) + k;
        if (of_facet(f).side[k] != FaceCell::Side::Border || !inside(f, k, on_border(h, 0.5), 1))
          continue;
        borders.push_back(h);
        around[vertex(h)], around[vertex(3 * static_cast<int>(f) + next_corner(k))];
      }
    if (borders.empty()) return;
    for (std::size_t f = 0; f < facets_.size(); ++f)
      for (int k = 0; k < 3; ++k) {
        const auto at = around.find(vertex(3 * static_cast<int>(f) + k));
        if (at != around.end()) at->second.push_back(static_cast<int>(f));
      }
    for (const int h : borders) {
      const int f = triangle_of(h), next = 3 * f + next_corner(side_of(h));
      std::vector<int> near = around[vertex(h)];
      near.insert(near.end(), around[vertex(next)].begin(), around[vertex(next)].end());
      sort_unique(near);
      for (const int g : near) {
        FaceCell& cell = of_facet(g);
        if (g == f || cell.face != of_facet(f).face) continue;
        for (const double s : {0.01, 0.05, 0.15, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99}) {
          const Vec3 x = on_border(h, s);
          if (!inside(g, 0, x, -1) || !inside(g, 1, x, -1) || !inside(g, 2, x, -1)) continue;
          out_.intruders.push_back({h, cell.intruder});
          cell.intruder = static_cast<int>(out_.intruders.size()) - 1;
          break;
        }
      }
    }
  }

  const Shell& shell_;
  Faces& faces_;
  const LargeArray<CurvedFacet>& facets_;
  const double gap_;
  // The first one stands for all facets that are on no face, as most of a free shape are.
  LargeArray<FaceCell> cells_;
  LargeArray<int> cell_of_;  // per facet
  FaceCells out_;
  std::vector<char> open_;   // facets that are left to their cubics
  std::vector<int> opened_;  // those whose neighbors do not know of it yet
  std::vector<int> one_of_;
  std::vector<char> told_;  // faces of which it is said why
  std::map<std::pair<int, int>, std::vector<int>> joints_;
};

}  // namespace

FaceCells make_face_cells(const Shell& shell, Faces& faces, const LargeArray<CurvedFacet>& facets) {
  return CellMaker(shell, faces, facets).make();
}

}  // namespace sphshell
