// Contacts with curved elements: the minima of the distance that the cells hold.
#pragma once

#include "contact/faces/rings.hpp"
#include "contact/query/broad_phase.hpp"
#include "contact/query/components.hpp"
#include "contact/query/outlook.hpp"
#include "contact/query/regions.hpp"

namespace sphshell {

// Minima of the distance on curved elements, with their saddles; of a Plane as the probe, in place
// of a Sphere, those of the height over it. Keeps its memory.
class CurvedQuery {
 public:
  template <class Probe>
  void find(const Search<Probe>& search, BroadPhase& broad) {
    const Shell& shell = search.shell;
    const Probe& probe = search.probe;
    std::vector<Minimum>& minima = search.minima;
    constexpr bool sphere = std::is_same_v<Probe, Sphere>;
    const CurvedShell& surface = *shell.curved();
    // Where nothing is bent there is no need to look.
    const CellBounds* cells = surface.bulge() > 0 ? surface.cells().data() : nullptr;
    // All zero: a facet whose element is its flat triangle.
    const CellBounds flat{};
    const LargeArray<FaceCell>& faces = surface.face_cells();
    outlooks_.clear(), borders_.clear(), joints_.clear();
    if constexpr (sphere) {
      if (faces.empty()) {
        broad.find(shell, surface.cones(), surface.bulge(), probe, cells);
      } else {
        broad.find(shell, surface.cones(), *surface.face_search(), probe, cells);
        for (const int face : broad.faces) feet_.add_closest(search, face);
      }
    } else {
      broad.find(shell, surface.cones(), surface.bulge(), probe, cells);
      if (!faces.empty()) feet_.clear(surface);
    }
    for (std::size_t i = 0; i < broad.candidates.size() && !sphere; ++i)
      prefetch_all(surface.facets()[broad.candidates[i]]);
    for (int f : broad.candidates) {
      if (!faces.empty() && faces[f].closed) {
        if constexpr (!sphere) feet_.add_lowest(search, f);
        borders_.push_back(f);
        continue;
      }
      const Facet& facet = shell.facets()[f];
      const CellBounds& bounds = cells ? cells[f] : flat;
      const Outlook outlook = [&]() -> Outlook {
        if constexpr (sphere)
          return {f, facet, surface.cones()[f], bounds, probe};
        else
          return {f, surface.facets()[f].patch(facet), probe, probe.tolerance + surface.gap()};
      }();
      if (outlook.empty()) continue;
      // Control points are read in the next loop; until then they come into the cache.
      if (sphere) prefetch_all(surface.facets()[f]);
      outlooks_.push_back(outlook);
    }
    // The order of minima is made unique later, by Components::merge().
    for (const Outlook& outlook : outlooks_) {
      const Owned& owned = surface.facets()[outlook.facet].owned;
      if (outlook.within) {
        if (!surface.facets()[outlook.facet].flat)
          add_bent(search, outlook);
        else if constexpr (sphere)
          add_flat(search, outlook);
      }
      for (int k = 0; k < 3; ++k) {
        if (outlook.side[k] && owned.twin[k] != kNotOwned) add_edge(search, outlook.facet, k);
        if (outlook.corner[k] && owned.vertex[k] >= 0) add_vertex(search, outlook.facet, k);
      }
    }
    for (const int f : borders_) add_border(search, f);
    bool known = false;
    if constexpr (sphere)
      if (!faces.empty()) {
        for (const int joint : broad.joints) add_joint(search, joint);
        for (const int c : broad.corners) add_vertex(search, triangle_of(c), side_of(c));
        find_rings(shell, probe, minima);
        known = minima.size() > 1 && find_ways(search, broad);
      }
    if (minima.size() > 1) components_.merge(search, known ? &ways_ : nullptr);
  }

 private:
  // To look how more minima are connected takes longer than to search for it.
  static constexpr std::size_t kMostWays = 8;

  // A joint within the sphere: where it is nearest to the center, if there is one such point, else
  // the center.
  struct Reached {
    int joint;
    bool one;
    Vec3 point;
    double depth = 0;  // once it is needed [m]
  };

  // Each of the following adds the minimum of one feature, if there is one: within a flat or a bent
  // cell, on the border of a face, on the joint of two, on a side, at a corner.

  // An element without a bulge: the plane's closed form, inside all three sides.
  void add_flat(const Search<Sphere>& search, const Outlook& outlook) {
    const auto& [shell, sphere, want_dn_dc, minima] = search;
    const Facet& facet = shell.facets()[outlook.facet];
    const double height = outlook.height;
    if (std::abs(height) >= sphere.radius) return;
    for (int k = 0; k < 3; ++k)
      if (test_side(facet, k, sphere.center, sphere.tolerance * sphere.tolerance).beyond) return;
    minima.push_back(over_facet(outlook.facet, facet, height, sphere));
  }

  // Where the distance is convex all over the cell, Newton's method finds what is within it, and
  // the facets that own its sides and corners what is there. Else its closest point is found for
  // certain, and counts on a side too: what others find beside it is no deeper, and what it would
  // count too much is absorbed by the link over that side, which is as deep.
  template <class Probe>
  void add_bent(const Search<Probe>& search, const Outlook& outlook) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
    const int f = outlook.facet;
    const Facet& facet = shell.facets()[f];
    const CurvedFacet& curved = shell.curved()->facets()[f];
    const CubicPatch patch = curved.patch(facet);
    Nearest found{Feature::Face, 0, 0.0, {}};
    constexpr bool plane = std::is_same_v<Probe, Plane>;
    const Sphere& sphere = probe.near_to(facet.corner[0]);
    const bool certain = !outlook.convex;
    if (certain && !find_nearest(facet, curved, shell.curved()->cells()[f], sphere.center,
                                 sphere.radius, found))
      return;
    // Over a plane what is closest to a far center is a start.
    if (plane && found.feature == Feature::Edge) {
      const CubicCurve side = curved.side(facet, found.index);
      found.at.point = side.point(found.t = nearest_on_side(side, probe));
    } else if (!certain || (plane && found.feature == Feature::Face)) {
      const auto start = certain ? std::pair(found.at.u, found.at.v)
                         : plane ? std::pair(1 / 3., 1 / 3.)
                                 : closest_on_facet(facet, sphere.center);
      if (!find_minimum(patch, probe, start, found.at)) return;
    }
    const auto& [u, v, point] = found.at;
    if (!probe.reaches(point)) return;
    // Needed where the center is on the surface, and to know on which side it is.
    const Vec3 outward = patch.along_u(u, v).cross(patch.along_v(u, v)).normalized();
    search.minima.push_back(search.at(f, found.index, found.feature, point, outward, [&]() -> Mat3 {
      if (found.feature == Feature::Face)
        return dx_dc_of(patch, found.at.u, found.at.v, search.probe);
      if (found.feature == Feature::Vertex) return Mat3::Zero();
      return dx_dc_of(curved.side(facet, found.index), found.t, search.probe);
    }));
  }

  // Within a face there is nothing to look for but its own closest point: beside it the sides and
  // corners of its border.
  template <class Probe>
  void add_border(const Search<Probe>& search, int f) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
    const Facet& facet = shell.facets()[f];
    const Owned& owned = shell.curved()->facets()[f].owned;
    const FaceCell& cell = shell.curved()->face_cells()[f];
    for (int k = 0; k < 3; ++k) {
      // A sphere looks for corners and joints by themselves. Beside its axis a face has one closest
      // point, and none on a line within it.
      constexpr bool sphere = std::is_same_v<Probe, Sphere>;
      if (!sphere && owned.vertex[k] >= 0) add_vertex(search, f, k);
      if (owned.twin[k] == kNotOwned) continue;
      if (sphere && (cell.side[k] == FaceCell::Side::Inner || is_on_joint(*shell.curved(), f, k)))
        continue;
      if (probe.bound_along(facet.corner[k], facet.side(k), double(cell.bulge[k])) > 0)
        add_edge(search, f, k);
    }
  }

  // The sides near the closest point of a line or circle are looked at; about its axis, those near
  // the sphere.
  void add_joint(const Search<Sphere>& search, int joint) {
    const auto& [shell, sphere, want_dn_dc, minima] = search;
    const CurvedShell& surface = *shell.curved();
    const FaceJoint& curve = surface.faces().joints[joint];
    const bool one = curve.has_one_nearest(sphere.center);
    const Reached at{joint, one, one ? curve.nearest(sphere.center) : sphere.center};
    if (!sphere.reaches(at.point)) return;
    joints_.push_back(at);
    // What add_edge() asks of each side, where that is the same of all.
    for (int i = 0; i < 2; ++i)
      if (falls(search, joint, i) > 0) return;
    for (const int h : sides_near(search, at)) add_edge(search, triangle_of(h), side_of(h));
  }

  // The sides near the closest point of a joint; about the axis of a circle, those near the sphere.
  BoxTree::Found sides_near(const Search<Sphere>& search, const Reached& at) {
    const FaceSearch& faces = *search.shell.curved()->face_search();
    return faces.of_joint[at.joint].parts.find(at.point, at.one ? faces.slack : search.probe.radius,
                                               sides_);
  }

  // How far inside face i of a joint the center is, beyond the overlap; 0: not, or not the same at
  // all of its sides.
  double falls(const Search<Sphere>& search, int joint, int i) const {
    const CurvedShell& surface = *search.shell.curved();
    const FaceJoint& curve = surface.faces().joints[joint];
    const int turn = surface.face_search()->of_joint[joint].turn[i];
    Vec3 away;
    if (turn == 0) return 0;
    return std::max(0.0, turn * curve.divide(curve.face[i], search.probe.center, away) -
                             search.probe.tolerance - surface.gap());
  }

  // Finds ways_, and whether they are all that connect the minima.
  //
  // Kruskal's method with faces in place of cells, and their joints in the order of falling depth.
  // The joints around a part, which is of faces put together so far, are no deeper than the next
  // one. Where both parts there hold minima, and the depth grows from its closest point into both,
  // the way up leaves neither part and ends at a minimum: so they are connected there, and nowhere
  // higher up. Of a part without minima only the joints around it matter. No face need be whole or
  // convex. All whose border is not known is one part, of one minimum at most.
  bool find_ways(const Search<Sphere>& search, const BroadPhase& broad) {
    const auto& [shell, sphere, want_dn_dc, minima] = search;
    const CurvedShell& surface = *shell.curved();
    ways_.clear();
    if (!shell.topology().pinches.empty() || minima.size() > kMostWays) return false;
    parts_.assign(1, {-1, 0, kNone});
    // Faces whose border is near a facet that is looked at by itself.
    for (const int f : broad.overlapping) {
      parts_.push_back({surface.face_cells()[f].face, 0, kNone});
      for (const int beyond : surface.cells()[f].beyond) {
        if (beyond < kBoundary) return false;
        if (beyond >= 0)
          parts_.push_back({surface.face_cells()[triangle_of(beyond)].face, 0, kNone});
      }
    }
    for (std::size_t i = 0; i < minima.size(); ++i) {
      int& minimum = parts_[part_of(surface, surface.face_cells()[minima[i].facet].face)].minimum;
      if (minimum != kNone || minima[i].off_axis < 1) return false;
      minimum = static_cast<int>(i);
    }
    for (Reached& at : joints_) {
      if (!at.one) return false;
      at.depth = sphere.depth(at.point);
    }
    std::sort(joints_.begin(), joints_.end(), [](const Reached& x, const Reached& y) {
      return x.depth != y.depth ? x.depth > y.depth : x.joint < y.joint;
    });
    for (const Reached& at : joints_) {
      const FaceJoint& curve = surface.faces().joints[at.joint];
      const int a = part_of(surface, curve.face[0]), b = part_of(surface, curve.face[1]);
      if (a == b) continue;
      const int from = parts_[a].minimum, to = parts_[b].minimum;
      if (from != kNone && to != kNone) {
        const int half_edge = saddle_side(search, at);
        if (half_edge < 0) return false;
        ways_.push_back({minima[from].facet, minima[to].facet, half_edge});
      }
      parts_[b].in = a;
      if (from == kNone) parts_[a].minimum = to;
    }
    return true;
  }

  // The part that a face is in, by its number.
  int part_of(const CurvedShell& surface, int face) {
    if (face < 0 || !surface.face_search()->of_face[face].enclosed) face = -1;
    std::size_t i = 0;
    while (i < parts_.size() && parts_[i].face != face) ++i;
    if (i == parts_.size()) parts_.push_back({face, int(i), kNone});
    while (parts_[i].in != int(i)) i = parts_[i].in;
    return int(i);
  }

  // The side that holds the closest point of a joint, from which the distance falls into both
  // faces, or -1. Where a circle bulges beyond another side of a sliver, its facet has not got that
  // point.
  int saddle_side(const Search<Sphere>& search, const Reached& at) {
    if (!(falls(search, at.joint, 0) > 0 && falls(search, at.joint, 1) > 0)) return -1;
    for (const int h : sides_near(search, at)) {
      const SideFoot foot = nearest_on_side(search.shell, triangle_of(h), side_of(h), search.probe);
      if (!(foot.t > 0 && foot.t < 1)) continue;
      const auto has_it = [&](int one) {
        const CurvedShell& surface = *search.shell.curved();
        const FaceCell& cell = surface.face_cells()[triangle_of(one)];
        const Primitive& shape = surface.faces().shapes[cell.face];
        Vec3 normal;
        shape.distance(foot.point, normal);
        return cell.bulge[side_of(one)] == 0 ||
               holds(search.shell, triangle_of(one),
                     {foot.point, cell.sign * normal, foot.point,
                      shape.has_parameters() ? shape.parameters(foot.point, search.shell.size())
                                             : Eigen::Vector2d(0, 0)},
                     search.probe.tolerance + surface.gap());
      };
      const int twin = search.shell.curved()->facets()[triangle_of(h)].owned.twin[side_of(h)];
      return has_it(h) && has_it(twin) ? h : -1;
    }
    return -1;
  }

  // The closest point of a side between its ends, if the distance falls into none of the elements
  // that meet there.
  template <class Probe>
  void add_edge(const Search<Probe>& search, int f, int k) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
    const Facet& facet = shell.facets()[f];
    const SideFoot foot = nearest_on_side(shell, f, k, probe);
    if (foot.t <= 0 || foot.t >= 1) return;
    const Vec3 &point = foot.point, along = foot.tangent.normalized();
    if (!probe.reaches(point)) return;
    // `in` points from the side into an element, tangential to it: the distance falls that way
    // where the center is ahead. By gap() the regions of features overlap, so that none is lost
    // between two. A joint itself says which centers its faces have: where those are nearly
    // tangent, their normals at one point of it say another.
    const auto rises = [&, &shell = shell, &probe = probe](int h) {
      const CurvedShell& surface = *shell.curved();
      const int g = triangle_of(h), l = side_of(h);
      const double overlap = probe.tolerance + surface.gap();
      if constexpr (std::is_same_v<Probe, Sphere>)
        if (!surface.face_cells().empty() && is_on_border(surface, g, l)) {
          const FaceCell& cell = surface.face_cells()[g];
          const Faces& faces = surface.faces();
          Vec3 away;
          return cell.turn[l] * faces.joints[cell.joint[l]].divide(cell.face, probe.center, away) <=
                 overlap;
        }
      const bool same = shell.facets()[g].corner[l] == facet.corner[k];
      const Vec3 in = inward(shell, h, same ? foot.t : 1 - foot.t, point, along);
      return probe.pull(point).dot(in) <= overlap;
    };
    const int code = shell.curved()->facets()[f].owned.twin[k];
    if (!rises(3 * f + k) || (code >= 0 && !rises(code))) return;
    if (code <= kManifold) {
      const std::vector<int>& all = shell.half_edges_of(kManifold - code);
      if (!std::all_of(all.begin(), all.end(), rises)) return;
    }
    search.minima.push_back(search.at(f, k, Feature::Edge, point, facet.normal, [&] {
      return dx_dc_of(search.shell, f, k, foot, search.probe);
    }));
  }

  // A corner, if the distance falls along none of its edges: then it falls in no direction between
  // two of them either, as their angle is below 180 degrees.
  template <class Probe>
  void add_vertex(const Search<Probe>& search, int f, int k) {
    const auto& [shell, probe, want_dn_dc, minima] = search;
    const Facet& facet = shell.facets()[f];
    if (!probe.reaches(facet.corner[k])) return;
    const Topology& topology = shell.topology();
    const Tangents& tangents = shell.curved()->tangents();
    const int vertex = shell.curved()->facets()[f].owned.vertex[k];
    const Vec3 from = probe.pull(facet.corner[k]);
    const double tolerance = probe.tolerance + shell.curved()->gap();
    for (int i = topology.neighbor_begin[vertex]; i < topology.neighbor_begin[vertex + 1]; ++i)
      if (from.dot(tangents[i]) > tolerance * tangents[i].norm()) return;
    minima.push_back(search.at_corner(f, k));
  }

  std::vector<Outlook> outlooks_;
  std::vector<int> borders_;  // facets that lie on faces
  std::vector<Reached> joints_;
  std::vector<int> sides_;  // room for half-edges of one of them
  std::vector<Way> ways_;
  // Faces that have been put together, by the part that one is in (its own number: a first one),
  // and a minimum of those of a first one.
  static constexpr int kNone = -1;
  struct Part {
    int face, in, minimum;
  };
  std::vector<Part> parts_;  // the first one: of all faces, and facets on none, of unknown border
  FaceFeet feet_;
  Components components_;
};

}  // namespace sphshell
