// A clean surface, ready for queries: geometry in the order of its tree.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>

#include "shell/bvh.hpp"

namespace sphshell {

enum class Side : int { Both = 0, Outside = 1, Inside = 2 };

// The edges and vertices that one facet owns, so that each is tested once.
struct Owned {
  int twin[3];    // across side k: a half-edge (3 facet + side) to test, or one of the codes below
  int vertex[3];  // the vertex at corner k where this facet owns it, else kNotOwned
};

// Codes in Owned.
constexpr int kNotOwned = -1;  // another facet owns this edge or vertex, or it is flat
constexpr int kBoundary = -2;  // an edge with no other facet
constexpr int kManifold = -3;  // kManifold - i: many-sided edge i (or ill-wound)

// What a query reads of one triangle: two cache lines.
struct alignas(64) Facet {
  Vec3 corner[3];
  Vec3 normal;  // unit, that of the planar face it belongs to
  Owned owned;
  int planar_face;  // facets of one planar face touch once
  int element;

  Vec3 side(int k) const { return corner[next_corner(k)] - corner[k]; }
  Vec3 middle() const { return (corner[0] + corner[1] + corner[2]) / 3; }
};
static_assert(sizeof(Facet) == 128);

// What a query reads of most triangles: enough to see that the sphere's center stands over no
// feature that the facet owns. Single precision, widened by its round-off.
struct alignas(32) NormalCone {
  float middle[3], reach;      // ball round the triangle [m], relative to Shell::origin()
  float axis[3], tan_opening;  // all normals of those features lie this close to +axis or -axis
};
static_assert(sizeof(NormalCone) == 32);

// NormalCone::tan_opening where normals may point anywhere.
constexpr float kAnyOpening = 1e9f;

inline float widened_opening(double tangent) {
  return tangent < 1e3 ? static_cast<float>(tangent * 1.00001 + 1e-6) : kAnyOpening;
}

struct SurfacePoint {
  Vec3 point;
  Vec3 normal;      // unit pseudo-normal of the feature that the point is on
  double distance;  // signed by that normal [m]
  int element;
};

class CoplanarRegions;
struct Faces;

// What curved elements are made of.
struct CurveOptions {
  // Unit, per triangle corner (3 per triangle), wound like the triangles; empty: estimated.
  std::vector<Vec3> normals;
  // The normals are the surface's own and stand; others are divided where the elements around
  // contradict them.
  bool exact = false;
  // Per half-edge (3 triangle + side) 1 for sides to stay straight whatever the normals; or empty.
  std::vector<std::uint8_t> straight;
  // The coordinates are known to this [m] where more is not said: single precision.
  double rounding = 0;
  bool faces = true;  // recognize planes, cylinders, cones, spheres and tori
  // Those that the surface is known to have: then none are recognized.
  std::shared_ptr<const Faces> known;
  std::shared_ptr<const CoplanarRegions> regions;  // where they have been found
  bool estimate = false;  // the normals that are given are estimates as well: ours are taken
};

class CurvedShell;
class Tangents;

class Shell {
 public:
  // element: per triangle, non-decreasing from 0; crease_angle [rad].
  Shell(std::vector<Vec3> vertices, std::vector<Triangle> triangles, std::vector<int> element,
        double crease_angle, Side side, const CadFaces& cad = {});

  SurfacePoint closest_point(const Vec3& point) const;

  const std::vector<Vec3>& vertices() const { return vertices_; }
  const std::vector<Triangle>& triangles() const { return triangles_; }
  const std::vector<int>& element() const { return element_; }
  // The vertex at a corner (3 triangle + k), where a half-edge begins, and its place.
  int vertex(int corner) const { return triangles_[triangle_of(corner)][side_of(corner)]; }
  const Vec3& point(int corner) const { return vertices_[vertex(corner)]; }
  std::array<Vec3, 3> corners(int triangle) const {
    const Triangle& t = triangles_[triangle];
    return {vertices_[t[0]], vertices_[t[1]], vertices_[t[2]]};
  }
  // From there to the end of the half-edge.
  Vec3 along(int half_edge) const { return point(corner_after(half_edge)) - point(half_edge); }
  // Whether two half-edges of an edge run against each other, as those of triangles wound alike do.
  bool opposed(int h, int g) const { return vertex(h) != vertex(g); }
  // Between the two normals of an edge [rad], > 0 convex, < 0 concave, 0 where not manifold.
  double angle(const Edge& edge) const;
  const Topology& topology() const { return topology_; }
  const Bvh& bvh() const { return bvh_; }
  const LargeArray<Facet>& facets() const { return facets_; }
  const LargeArray<NormalCone>& cones() const { return cones_; }
  const Vec3& origin() const { return bvh_.origin(); }
  Side side() const { return side_; }
  int num_elements() const { return element_.empty() ? 0 : element_.back() + 1; }
  double crease_angle() const { return crease_angle_; }  // [rad]

  // Which edges and vertices each facet owns; edges between two triangles for which flat(t, u)
  // holds are not tested.
  std::vector<Owned> assign_owners(const std::function<bool(int t, int u)>& flat) const;
  // Bound on the tangent of the angle between `axis` and any direction that points away from all
  // edges at the vertex; `tangents` (beside Topology::neighbors) replace the straight edges.
  double tan_vertex_cone(int vertex, const Vec3& axis, const Tangents* tangents) const;
  // The same between a facet's normal and those of the sides and corners that it owns, where
  // of_neighbor(g) is that of facet g.
  template <class OfNeighbor>
  double opening_of(const Facet& facet, const Owned& owned, const Tangents* tangents,
                    OfNeighbor&& of_neighbor) const {
    constexpr double kAny = std::numeric_limits<double>::infinity();
    double tangent = 0;
    for (int k = 0; k < 3; ++k) {
      const int twin = owned.twin[k], g = twin < 0 ? -1 : triangle_of(twin);
      if (twin != kNotOwned)
        tangent = std::max(
            tangent, g >= 0 && facet.normal.dot(facets_[g].normal) > 0.05 ? of_neighbor(g) : kAny);
      if (owned.vertex[k] >= 0)
        tangent = std::max(tangent, tan_vertex_cone(owned.vertex[k], facet.normal, tangents));
    }
    return tangent;
  }

  // Curved elements, made at first use.
  void curve(CurveOptions options);
  // Null before that; threads may ask while one makes them.
  const CurvedShell* curved() const { return ready_.load(std::memory_order_acquire); }

  // Its sheets, found at first use.
  const Sheets& sheets() const;

  double size() const { return size_; }  // box diagonal [m]

  // For the rare edge with more than two facets: its half-edges in facet numbering.
  const std::vector<int>& half_edges_of(int edge) const { return manifold_[edge]; }
  int triangle_of_facet(int facet) const { return order_[facet]; }
  // The half-edge 3 triangle + side as 3 facet + side.
  int facet_half_edge(int h) const { return 3 * facet_of_[triangle_of(h)] + side_of(h); }
  // And back.
  int half_edge(int h) const { return 3 * order_[triangle_of(h)] + side_of(h); }

 private:
  void build_facets(const std::vector<int>& order);
  void build_cones();

  std::vector<Vec3> vertices_;
  std::vector<Triangle> triangles_;
  std::vector<int> element_;
  double crease_angle_;
  Side side_;
  Topology topology_;
  std::vector<int> order_;  // facet -> triangle
  std::vector<int> facet_of_;
  std::vector<std::vector<int>> manifold_;  // see half_edges_of
  Bvh bvh_;
  LargeArray<Facet> facets_;
  LargeArray<NormalCone> cones_;
  double size_;
  std::shared_ptr<const CurvedShell> curved_;
  std::atomic<const CurvedShell*> ready_{nullptr};
  mutable std::once_flag sheets_found_;
  mutable std::shared_ptr<const Sheets> sheets_;
};

}  // namespace sphshell
