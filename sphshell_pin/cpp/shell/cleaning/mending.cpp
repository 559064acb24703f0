#include "shell/cleaning/mending.hpp"

#include <limits>

#include "shell/disjoint_sets.hpp"
#include "shell/half_edges.hpp"

namespace sphshell {

static std::array<Vec3, 3> corners_of(const Points& points, const std::int32_t* vertices) {
  std::array<Vec3, 3> out;
  for (int k = 0; k < 3; ++k) out[k] = place(points, vertices[k]);
  return out;
}

// A cell this many tolerances wide: few points share a cell, and few lie near a cell's border.
constexpr double kCellInTolerances = 64.0;

Weld weld(Points points, double tolerance) {
  Weld out;
  const std::size_t count = points.count;
  DisjointSets groups(count);
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < count; ++i) low = low.cwiseMin(place(points, i));
  const double cell = kCellInTolerances * tolerance;
  using Cell = Eigen::Matrix<std::uint64_t, 3, 1>;
  const auto cell_of = [&](const Vec3& x) -> Cell {
    return ((x - low) / cell).array().floor().max(0.0).cast<std::uint64_t>();
  };
  // 21 bits per axis hold the at most 1e7 / 64 cells of a box of 1e7 tolerances.
  const auto key = [](const Cell& at) { return (at[0] << 42) | (at[1] << 21) | at[2]; };
  // The points by their cells.
  using Place = std::pair<std::uint64_t, std::int32_t>;
  LargeArray<Place> places(count);
  for (std::size_t i = 0; i < count; ++i)
    places[i] = {key(cell_of(place(points, i))), static_cast<std::int32_t>(i)};
  std::sort(places.begin(), places.end());
  // Merges two points that are near each other; whether they are equal.
  const auto merge = [&](const Place& one, const Place& other) {
    const double squared = (place(points, one.second) - place(points, other.second)).squaredNorm();
    if (squared <= tolerance * tolerance) groups.merge(one.second, other.second);
    return squared == 0.0;
  };
  // Within each cell, of which one of equal points is kept.
  std::size_t kept = 0, first = 0;
  for (const Place& place : places) {
    if (kept == 0 || places[kept - 1].first != place.first) first = kept;
    bool same = false;
    for (std::size_t k = first; k < kept; ++k) same = merge(place, places[k]) || same;
    if (!same) places[kept++] = place;
  }
  places.resize(kept);
  // And across cells, where the ball of the tolerance meets several: seldom, as they are wide.
  for (const Place& place : places) {
    const Vec3 p = sphshell::place(points, place.second);
    const Cell from = cell_of(p.array() - tolerance), to = cell_of(p.array() + tolerance);
    for (std::uint64_t x = from[0]; x <= to[0]; ++x)
      for (std::uint64_t y = from[1]; y <= to[1]; ++y)
        for (std::uint64_t z = from[2]; z <= to[2]; ++z) {
          const std::uint64_t cell = key({x, y, z});
          if (cell == place.first) continue;
          auto other = std::lower_bound(places.begin(), places.end(), Place(cell, 0));
          for (; other != places.end() && other->first == cell; ++other) merge(place, *other);
        }
  }
  out.representative.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t first = groups.find(static_cast<std::int32_t>(i));
    out.representative[i] = first;
    if (first == static_cast<std::int32_t>(i)) continue;
    out.largest_distance =
        std::max(out.largest_distance, (place(points, i) - place(points, first)).norm());
  }
  return out;
}

// A slot is a corner of a polygon, and stands for the edge from there to the next corner.
EdgeTable edge_table(const PolygonView& polygons, std::size_t vertex_count) {
  const auto slots = static_cast<std::size_t>(polygons.offsets[polygons.count]);
  // The corner after each slot's own: slots are asked for in order, their polygons found as we go.
  LargeArray<std::int32_t> following(slots);
  for (std::size_t p = 0; p < polygons.count; ++p)
    for (std::int64_t s = polygons.offsets[p]; s < polygons.offsets[p + 1]; ++s)
      following[s] = polygons.corners[polygons.next(p, s)];
  EdgeTable out;
  out.slot_edge.assign(slots, -1);
  out.ends.reserve(slots / 2 + 8);
  out.users.reserve(slots / 2 + 8);
  for_each_edge(
      slots, vertex_count,
      [&](std::size_t s) { return std::pair(polygons.corners[s], following[s]); },
      [&](int low, int high, const std::uint64_t* first, const std::uint64_t* last) {
        for (auto* word = first; word != last; ++word)
          // A word holds the slot in its lower half.
          out.slot_edge[static_cast<std::uint32_t>(*word)] =
              static_cast<std::int32_t>(out.users.size());
        out.ends.push_back({low, high});
        out.users.push_back(static_cast<std::int32_t>(last - first));
      });
  return out;
}

// Equal as cycles of corners, in either direction, from any corner on.
Duplicates duplicate_polygons(const PolygonView& polygons, Indices slot_edge, Indices users) {
  Duplicates out;
  out.first.resize(polygons.count);
  std::iota(out.first.begin(), out.first.end(), 0);
  out.opposite.assign(polygons.count, 0);
  // Equal cycles have the same edges: only polygons are compared that agree about which of theirs
  // fewest polygons use. They are chained, each to the one before.
  LargeArray<std::int32_t> latest(users.count, -1), before(polygons.count, -1);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    const std::int64_t from = polygons.offsets[p], n = polygons.offsets[p + 1] - from;
    std::int32_t edge = -1;
    for (std::int64_t s = from; s < from + n; ++s) {
      const std::int32_t e = slot_edge[s];
      if (e >= 0 && (edge < 0 || std::pair(users[e], e) < std::pair(users[edge], edge))) edge = e;
    }
    if (edge < 0 || users[edge] < 2) continue;
    // Canonical cycle: from the lowest corner towards its lower neighbor.
    const auto canonical = [&](std::size_t q, bool& back) {
      const std::int32_t* c = polygons.corners + polygons.offsets[q];
      const std::int64_t lowest = std::min_element(c, c + n) - c;
      back = c[(lowest + n - 1) % n] < c[(lowest + 1) % n];
      return [=](std::int64_t k) { return c[(lowest + (back ? n - k : k)) % n]; };
    };
    bool back = false;
    const auto own = canonical(p, back);
    std::int32_t q = latest[edge];
    for (; q >= 0; q = before[q]) {
      if (polygons.offsets[q + 1] - polygons.offsets[q] != n) continue;
      bool other_back = false, equal = true;
      const auto other = canonical(static_cast<std::size_t>(q), other_back);
      for (std::int64_t k = 0; equal && k < n; ++k) equal = own(k) == other(k);
      if (!equal) continue;
      out.first[p] = q;
      out.opposite[p] = back != other_back;
      break;
    }
    if (q < 0) before[p] = std::exchange(latest[edge], static_cast<std::int32_t>(p));
  }
  return out;
}

std::vector<std::uint8_t> repeated_corners(const PolygonView& polygons) {
  std::vector<std::uint8_t> out;
  for (const std::int64_t back : {1, 2}) {
    for (std::size_t p = 0; p < polygons.count; ++p) {
      const std::int64_t from = polygons.offsets[p], n = polygons.offsets[p + 1] - from;
      for (std::int64_t k = 0; k < n; ++k) {
        const std::int32_t* c = polygons.corners + from;
        // A corner that the next one repeats; or the tip between two that are one vertex.
        const bool repeated =
            back == 1 ? c[k] == c[(k + 1) % n] : c[(k + n - 1) % n] == c[(k + 1) % n];
        if (!repeated) continue;
        if (out.empty()) out.assign(static_cast<std::size_t>(polygons.offsets[polygons.count]), 0);
        out[from + k] = 1;
      }
    }
    if (!out.empty()) break;
  }
  return out;
}

std::vector<double> triangle_shapes(const PolygonView& polygons, Points points) {
  std::vector<double> out(polygons.count, -1.0);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    const std::int64_t from = polygons.offsets[p];
    if (polygons.offsets[p + 1] - from != 3) continue;
    const auto [a, b, c] = corners_of(points, polygons.corners + from);
    // 2 area / longest edge^2, which does not depend on the size.
    const double area = (b - a).cross(c - a).norm();
    const double longest =
        std::max({(b - a).squaredNorm(), (c - a).squaredNorm(), (c - b).squaredNorm()});
    out[p] = area / (longest > 0.0 ? longest : 1.0);
  }
  return out;
}

// Signed volume, area, and the area that flips turn over.
ComponentSums component_sums(Points points, Rows<std::int32_t, 3> triangles,
                             Indices triangle_polygon, Indices component, Rows<std::uint8_t> flip,
                             std::size_t component_count, Rows<double> center) {
  ComponentSums out;
  out.volume.assign(component_count, 0.0);
  out.area = out.turned_area = out.volume;
  const Vec3 middle(center[0], center[1], center[2]);
  for (std::size_t t = 0; t < triangles.count; ++t) {
    const std::size_t p = triangle_polygon[t];
    const auto [a, b, c] = corners_of(points, triangles.data + 3 * t);
    const Vec3 vector_area = 0.5 * (b - a).cross(c - a);
    // The volume of the tetrahedron from the middle to the triangle: by the divergence theorem
    // their sum is the volume enclosed.
    const double area = vector_area.norm(), share = (a - middle).dot(vector_area) / 3.0;
    const std::int32_t owner = component[p];
    out.volume[owner] += flip[p] ? -share : share;
    out.area[owner] += area;
    out.turned_area[owner] += flip[p] ? area : -area;
  }
  return out;
}

// Breadth first over edges of two polygons: `flip` makes neighbors wound alike.
Orientation flood_fill(const PolygonView& polygons, Indices slot_edge, Indices users) {
  struct User {
    std::int32_t slot, polygon;
  };
  constexpr User kNone{-1, -1};
  // The two polygons at each edge that has two.
  LargeArray<User> pair(2 * users.count, kNone);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    for (std::int64_t s = polygons.offsets[p]; s < polygons.offsets[p + 1]; ++s) {
      const std::int32_t edge = slot_edge[s];
      if (edge < 0 || users[edge] != 2) continue;
      pair[2 * edge + (pair[2 * edge].slot < 0 ? 0 : 1)] = {static_cast<std::int32_t>(s),
                                                            static_cast<std::int32_t>(p)};
    }
  }
  Orientation out;
  out.component.assign(polygons.count, -1);
  out.flip.assign(polygons.count, 0);
  std::vector<std::int32_t> queue;
  for (std::size_t seed = 0; seed < polygons.count; ++seed) {
    if (out.component[seed] >= 0) continue;
    const auto label = static_cast<std::int32_t>(out.one_sided.size());
    out.one_sided.push_back(0);
    out.component[seed] = label;
    queue.assign(1, static_cast<std::int32_t>(seed));
    for (std::size_t head = 0; head < queue.size(); ++head) {
      const std::int32_t p = queue[head];
      for (std::int64_t s = polygons.offsets[p]; s < polygons.offsets[p + 1]; ++s) {
        const std::int32_t edge = slot_edge[s];
        if (edge < 0 || users[edge] != 2) continue;
        const User& twin = pair[2 * edge + (pair[2 * edge].slot == s ? 1 : 0)];
        const std::int32_t q = twin.polygon;
        if (q == p) continue;  // a seam of a polygon with itself tells nothing
        // Neighbors that are wound alike pass their common edge in opposite directions.
        const bool same_way = polygons.corners[s] == polygons.corners[twin.slot];
        const std::uint8_t wanted = out.flip[p] ^ static_cast<std::uint8_t>(same_way);
        if (out.component[q] < 0) {
          out.component[q] = label;
          out.flip[q] = wanted;
          queue.push_back(q);
        } else if (out.flip[q] != wanted) {
          // Two ways round lead to opposite windings: a Moebius strip.
          out.one_sided[label] = 1;
        }
      }
    }
  }
  return out;
}

std::vector<std::int32_t> connected_components(std::size_t nodes, Rows<std::int32_t, 2> pairs) {
  DisjointSets sets(nodes);
  for (std::size_t k = 0; k < pairs.count; ++k) sets.merge(pairs[2 * k], pairs[2 * k + 1]);
  return sets.labels();
}

}  // namespace sphshell
