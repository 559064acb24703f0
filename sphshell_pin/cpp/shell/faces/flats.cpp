#include "shell/faces/flats.hpp"

#include <map>

#include "shell/curved/curved.hpp"

namespace sphshell {
namespace {

constexpr double kFlatBeyond = 1e-8;  // as a share of the size: no corner stands out by more

// The border of one planar face.
struct Outline {
  std::vector<int> triangles;
  std::vector<int> sides;  // half-edges, one after the other
  Vec3 normal;
  double area = 0;  // within it, holes and all [m^2]
  bool convex = false, straight = true;
  int circle = -1;  // the joint that all of it lies on, or -1
};

class Search {
 public:
  explicit Search(const Shell& shell)
      : shell_(shell), surface_(*shell.curved()), topology_(shell.topology()) {}

  Flats find() {
    Flats out;
    out.size = shell_.size();
    out.of_vertex.resize(shell_.vertices().size());
    find_outlines();
    for (std::size_t f = 0; f < outlines_.size(); ++f) {
      const Outline& outline = outlines_[f];
      if (!can_lie(outline)) {
        out.others = out.others || is_on_hull(outline);
        continue;
      }
      if (outline.circle >= 0) {
        const FaceJoint& circle = surface_.faces().joints[std::size_t(outline.circle)];
        const Vec3 east = circle.axis.unitOrthogonal();
        out.discs.push_back(
            {circle.point, circle.axis, east, circle.axis.cross(east), circle.radius});
      } else {
        add_polygon(static_cast<int>(f), out);
      }
    }
    const std::vector<Primitive>& shapes = surface_.faces().shapes;
    for (std::size_t face = 0; face < shapes.size(); ++face)
      if (shapes[face].kind == FaceKind::Cylinder || shapes[face].kind == FaceKind::Cone)
        add_ruled(static_cast<int>(face), out);
    return out;
  }

 private:
  const Vec3& place(int vertex) const { return shell_.vertices()[vertex]; }
  int start(int h) const { return shell_.vertex(h); }
  int end(int h) const { return start(corner_after(h)); }

  bool is_plane(int triangle) const {
    const int f = triangle_of(shell_.facet_half_edge(3 * triangle));
    const Primitive* face = surface_.face_of(f);
    return face ? face->kind == FaceKind::Plane : surface_.facets()[f].flat;
  }
  // The joint of a side that is a circle, -1 of a straight side, -2 of any other.
  int curve_of(int h) const {
    const int g = shell_.facet_half_edge(h), f = triangle_of(g), k = side_of(g);
    if (surface_.face_of(f) && surface_.face_cells()[f].side[k] == FaceCell::Side::Border) {
      const int joint = surface_.face_cells()[f].joint[k];
      const FaceJoint::Kind kind = surface_.faces().joints[joint].kind;
      return kind == FaceJoint::Kind::Line ? -1 : kind == FaceJoint::Kind::Circle ? joint : -2;
    }
    const CurvedFacet& facet = surface_.facets()[f];
    const bool bends = facet.control_offset(k, 0).norm() + facet.control_offset(k, 1).norm() >
                       kFlatBeyond * shell_.size();
    return bends ? -2 : -1;
  }

  // Whether the surface goes on smoothly over a side: then the lowest point leaves the face there.
  bool is_smooth(int h) const {
    const int g = shell_.facet_half_edge(h), f = triangle_of(g);
    const int other = topology_.other_half_edge(h);
    if (!surface_.face_of(f))
      return topology_.edge_at(h).kind == EdgeClass::Smooth && !is_plane(triangle_of(other));
    const FaceCell& cell = surface_.face_cells()[f];
    return cell.side[side_of(g)] == FaceCell::Side::Border &&
           surface_.faces().joints[cell.joint[side_of(g)]].tangent;
  }

  // The outer border of each planar face.
  void find_outlines() {
    const std::vector<int>& face = topology_.planar_face;
    const int count = face.empty() ? 0 : 1 + *std::max_element(face.begin(), face.end());
    outlines_.resize(count);
    std::vector<char> flat(count, 1);
    std::vector<std::vector<int>> border(outlines_.size());
    for (int t = 0; t < static_cast<int>(face.size()); ++t) {
      const int f = face[t];
      flat[f] = flat[f] && is_plane(t);
      outlines_[f].normal = topology_.face_normal[t];
      outlines_[f].triangles.push_back(t);
      for (int h = 3 * t; h < 3 * t + 3; ++h) {
        const int other = topology_.other_half_edge(h);
        if (other < 0 || face[triangle_of(other)] != f) border[f].push_back(h);
      }
    }
    for (std::size_t f = 0; f < border.size(); ++f)
      if (flat[f]) trace(border[f], outlines_[f]);
  }

  // Of the loops that the sides form the one that holds the others.
  void trace(const std::vector<int>& border, Outline& out) const {
    std::map<int, int> from;
    for (const int h : border)
      if (!from.emplace(start(h), h).second) return;  // it touches itself
    while (!from.empty()) {
      std::vector<int> loop;
      Vec3 area = Vec3::Zero();
      for (auto at = from.begin(); at != from.end(); at = from.find(end(loop.back()))) {
        area += place(start(at->second)).cross(shell_.along(at->second));
        loop.push_back(at->second);
        from.erase(at);
      }
      const double held = std::abs(area.dot(out.normal)) / 2;
      if (held <= out.area) continue;
      out.area = held, out.sides = std::move(loop);
    }
    out.convex = !out.sides.empty();
    for (std::size_t i = 0; i < out.sides.size(); ++i) {
      const int h = out.sides[i], curve = curve_of(h);
      const Vec3 turn = shell_.along(h).cross(shell_.along(out.sides[(i + 1) % out.sides.size()]));
      out.convex = out.convex &&
                   turn.dot(out.normal) > -kFlatBeyond * shell_.size() * shell_.along(h).norm();
      out.straight = out.straight && curve == -1;
      out.circle = i == 0 || out.circle == curve ? curve : -2;
    }
  }

  // Whether no neighbor of a vertex stands out beyond the plane through it. Where an open sheet has
  // all of them on its other side, it lies on that side.
  bool bounds_neighbors(int vertex, const Vec3& normal, bool& above, bool& below) const {
    const std::vector<int>& begin = topology_.neighbor_begin;
    for (int i = begin[vertex]; i < begin[vertex + 1]; ++i) {
      const double out = normal.dot(place(topology_.neighbors[i]) - place(vertex));
      above = above || out > kFlatBeyond * shell_.size();
      below = below || out < -kFlatBeyond * shell_.size();
    }
    return !(above && below);
  }

  // Also across the edges of its outline, over which a body may tip from face to face.
  bool can_lie(const Outline& outline) const {
    if (!outline.convex || !(outline.straight || outline.circle >= 0)) return false;
    bool above = false, below = false;
    for (const int h : outline.sides) {
      if (is_smooth(h) || !bounds_neighbors(start(h), outline.normal, above, below)) return false;
      const int other = topology_.other_half_edge(h);
      if (other < 0 || !is_plane(triangle_of(other))) continue;
      const Outline& beside = outlines_[topology_.planar_face[triangle_of(other)]];
      bool up = false, down = false;
      if (!beside.convex || !bounds_neighbors(start(h), beside.normal, up, down) ||
          !bounds_neighbors(end(h), beside.normal, up, down))
        return false;
    }
    return true;
  }

  // Whether all of the shell is on one side of a large face.
  bool is_on_hull(const Outline& outline) const {
    constexpr double kLarge = 1e-3;  // as a share of the square of the size
    if (!(outline.area > kLarge * shell_.size() * shell_.size())) return false;
    double most = 0, least = 0;
    for (const Vec3& x : shell_.vertices()) {
      const double out = outline.normal.dot(x - place(start(outline.sides[0])));
      most = std::max(most, out), least = std::min(least, out);
    }
    return std::min(most, -least) < 1e-6 * shell_.size();
  }

  void add_polygon(int face, Flats& out) const {
    const std::vector<int>& sides = outlines_[face].sides;
    std::vector<int> corners;
    for (std::size_t i = 0; i < sides.size(); ++i) {
      const Vec3 before = shell_.along(sides[i]),
                 after = shell_.along(sides[(i + 1) % sides.size()]);
      if (before.cross(after).norm() > kFlatBeyond * before.norm() * after.norm())
        corners.push_back(end(sides[i]));
    }
    const int number = static_cast<int>(out.polygons.size());
    out.polygons.push_back(std::move(corners));
    for (const int t : outlines_[face].triangles)
      for (const int v : shell_.triangles()[t]) {
        std::vector<int>& of = out.of_vertex[v];
        if (of.empty() || of.back() != number) of.push_back(number);
      }
  }

  void add_ruled(int face, Flats& out) const {
    const Faces& faces = surface_.faces();
    const Primitive& shape = faces.shapes[face];
    std::vector<std::pair<double, double>> ends;  // height on the axis, radius
    for (const FaceJoint& joint : faces.joints) {
      if (joint.face[0] != face && joint.face[1] != face) continue;
      // Only a part of its circumference, or one that goes on.
      if (joint.kind == FaceJoint::Kind::Line || joint.tangent) return;
      const Vec3 from = joint.point - shape.point;
      if (joint.kind == FaceJoint::Kind::Circle &&
          joint.axis.cross(shape.axis).norm() < kFlatBeyond &&
          from.cross(shape.axis).norm() < kFlatBeyond * shell_.size())
        ends.push_back({from.dot(shape.axis), joint.radius});
    }
    for (std::size_t t = 0; t < faces.of.size(); ++t) {
      if (faces.of[t] != face) continue;
      for (const int v : shell_.triangles()[t]) {
        const Vec3& x = place(v);
        const Vec3 from = x - shape.point;
        if (from.cross(shape.axis).norm() < kFlatBeyond * shell_.size())
          ends.push_back({from.dot(shape.axis), 0});  // the tip of a cone
        for (int i = topology_.neighbor_begin[v]; i < topology_.neighbor_begin[v + 1]; ++i)
          if (shape.distance(place(topology_.neighbors[i])) > kFlatBeyond * shell_.size()) return;
      }
    }
    if (ends.empty()) return;
    const auto [low, high] = std::minmax_element(ends.begin(), ends.end());
    if (!(high->first - low->first > kFlatBeyond * shell_.size())) return;
    out.ruled.push_back(
        {{shape.point + low->first * shape.axis, shape.point + high->first * shape.axis},
         shape.axis,
         {low->second, high->second}});
  }

  const Shell& shell_;
  const CurvedShell& surface_;
  const Topology& topology_;
  std::vector<Outline> outlines_;
};

}  // namespace

Flats find_flats(const Shell& shell) { return Search(shell).find(); }

}  // namespace sphshell
