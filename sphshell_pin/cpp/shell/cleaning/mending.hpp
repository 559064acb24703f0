// Loops of the surface cleaning that NumPy cannot do fast: welding, adjacency, ear clipping,
// T-junctions, orientation, nesting. Plain data in, plain data out; the Python side checks.
//
// Polygons come as `offsets` (m + 1) and `corners` (offsets[m] vertex indices). A place in
// `corners` is called a slot; the edge of slot s runs from its corner to the next one of the
// same polygon (cyclic).
#pragma once

#include "shell/topology.hpp"

namespace sphshell {

// Polygons as rows of corners: polygon p has corners[offsets[p]] up to corners[offsets[p + 1]].
struct PolygonView {
  const std::int64_t* offsets;
  const std::int32_t* corners;
  std::size_t count;

  // The slot behind this one, round the polygon.
  std::int64_t next(std::size_t polygon, std::int64_t slot) const {
    return slot + 1 == offsets[polygon + 1] ? offsets[polygon] : slot + 1;
  }
};

struct Weld {
  std::vector<std::int32_t> representative;  // lowest index of each group of merged points
  double largest_distance = 0.0;             // from a merged point to its representative [m]
};

// Merges points nearer than `tolerance` to each other, transitively: the groups do not depend on
// the order of the points.
Weld weld(Points points, double tolerance);

struct EdgeTable {
  std::vector<std::int32_t> slot_edge;  // edge of each slot; -1 where both ends are one vertex
  std::vector<std::array<std::int32_t, 2>> ends;  // of each: low first, in ascending order
  std::vector<std::int32_t> users;                // how many slots use the edge
};

EdgeTable edge_table(const PolygonView& polygons, std::size_t vertex_count);

struct Duplicates {
  std::vector<std::int32_t> first;     // first polygon with the same cycle of corners
  std::vector<std::uint8_t> opposite;  // 1 if it is wound the other way than that first one
};

// Polygons with equal corner cycles, of either winding; slot_edge and users are those of their
// edge table.
Duplicates duplicate_polygons(const PolygonView& polygons, Indices slot_edge, Indices users);

// Per slot 1 where the next corner repeats its own; where no polygon has such, 1 where a spike has
// its tip, between two corners that are one vertex. Empty where there is neither.
std::vector<std::uint8_t> repeated_corners(const PolygonView& polygons);

// 2 area / longest edge^2 of each triangle, 0 for a point; -1 of polygons with more corners.
std::vector<double> triangle_shapes(const PolygonView& polygons, Points points);

struct ComponentSums {
  std::vector<double> volume;       // enclosed, with the sign of the winding [m^3]
  std::vector<double> area;         // [m^2]
  std::vector<double> turned_area;  // of the polygons that are to be turned less the others
};

// Sums over the triangles (t, 3) of each component, polygons turned where `flip` says so; volumes
// about `center`. triangle_polygon: (t,) polygon of each.
ComponentSums component_sums(Points points, Rows<std::int32_t, 3> triangles,
                             Indices triangle_polygon, Indices component, Rows<std::uint8_t> flip,
                             std::size_t component_count, Rows<double> center);

struct EarClips {
  // Slots, not vertices: normals can follow.
  std::vector<std::array<std::int64_t, 3>> triangle_slots;
  std::vector<std::int32_t> triangle_polygon;
  std::vector<std::uint8_t> tangled;  // per polygon: 1 if it had to be cut without a proper ear
};

// Triangulates polygons of any shape, keeping every corner, also collinear ones; the best-shaped
// ear goes first, so the result does not depend on which corner is listed first. Corners nearer
// than `tolerance` [m] to a diagonal count as lying on it.
EarClips clip_ears(const PolygonView& polygons, Points points, double tolerance);

struct Insertions {
  std::vector<std::int64_t> slot;    // the vertex belongs into the edge of this slot
  std::vector<std::int32_t> vertex;  // ordered along the edge
  std::vector<double> parameter;     // 0 at the slot's corner, 1 at the next
};

// Vertices among `candidates` within `tolerance` of the interior of an open edge (given by its
// slot and polygon) of a polygon that does not have them as corners; `candidates` ascend. Stops
// with the first insertion beyond `most`.
Insertions find_t_junctions(const PolygonView& polygons, Points points,
                            Rows<std::int64_t> open_slots, Indices open_polygons,
                            Indices candidates, double tolerance, std::size_t most);

struct Orientation {
  std::vector<std::int32_t> component;  // per polygon, numbered in order of first polygon
  std::vector<std::uint8_t> flip;       // relative to the first polygon of the component
  std::vector<std::uint8_t> one_sided;  // per component: 1 if no consistent winding exists
};

// Flood fill across the edges that exactly two different polygons use; slot_edge and users are
// those of their edge table.
Orientation flood_fill(const PolygonView& polygons, Indices slot_edge, Indices users);

// Labels the connected components of an undirected graph, numbered by their first node.
std::vector<std::int32_t> connected_components(std::size_t nodes, Rows<std::int32_t, 2> pairs);

struct Overlaps {
  // A component, and another that shares room with it.
  std::vector<std::array<std::int32_t, 2>> pairs;
  std::vector<double> share;  // how much of the inside of the first is in the second
};

// Where the insides of closed components lie in one another, measured along a line through each of
// the `places` (n, 3), which are near the inside of `place_component` (n). Triangles (t, 3) and the
// component of each; `group` of each component: only those of one group are compared, and none
// that has -1, as one that is not closed must have.
Overlaps overlaps(Points points, Rows<std::int32_t, 3> triangles, Indices triangle_component,
                  Points places, Indices place_component, Indices group);

}  // namespace sphshell
