#include "shell/mending.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>
#include <utility>

#include "shell/disjoint_sets.hpp"

namespace sphshell {
namespace {

std::uint64_t mix(std::uint64_t key) {
  key ^= key >> 33;
  key *= 0xff51afd7ed558ccdULL;
  key ^= key >> 33;
  key *= 0xc4ceb9fe1a85ec53ULL;
  return key ^ (key >> 33);
}

// Open-addressing table from a key to the head of a chain of points.
class CellTable {
 public:
  explicit CellTable(std::size_t expected) {
    std::size_t size = 16;
    while (size < 2 * expected) size *= 2;
    keys_.assign(size, kFree);
    heads_.assign(size, -1);
    mask_ = size - 1;
  }

  std::int32_t find(std::uint64_t key) const {
    for (std::size_t at = mix(key) & mask_;; at = (at + 1) & mask_) {
      if (keys_[at] == key) return heads_[at];
      if (keys_[at] == kFree) return -1;
    }
  }

  // Makes `value` the head of the chain and returns the head before it.
  std::int32_t push(std::uint64_t key, std::int32_t value) {
    for (std::size_t at = mix(key) & mask_;; at = (at + 1) & mask_) {
      if (keys_[at] == kFree) keys_[at] = key;
      if (keys_[at] == key) return std::exchange(heads_[at], value);
    }
  }

 private:
  static constexpr std::uint64_t kFree = ~std::uint64_t{0};
  std::vector<std::uint64_t> keys_;
  std::vector<std::int32_t> heads_;
  std::size_t mask_ = 0;
};

// A cell this many tolerances wide: few points share a cell, and few lie near a cell's border.
constexpr double kCellInTolerances = 64.0;

}  // namespace

Weld weld(const double* points, std::size_t count, double tolerance) {
  Weld out;
  DisjointSets groups(count);
  std::array<double, 3> low{};
  low.fill(std::numeric_limits<double>::infinity());
  for (std::size_t i = 0; i < 3 * count; ++i) low[i % 3] = std::min(low[i % 3], points[i]);
  const double cell = kCellInTolerances * tolerance;
  // 21 bits per axis hold the at most 1e7 / 64 cells of a box of 1e7 tolerances.
  const auto index = [&](double x, int axis) {
    return static_cast<std::uint64_t>(std::max(0.0, std::floor((x - low[axis]) / cell)));
  };
  CellTable table(count);
  std::vector<std::int32_t> chain(count, -1);
  for (std::size_t i = 0; i < count; ++i) {
    const double* p = points + 3 * i;
    std::array<std::uint64_t, 3> from{}, to{};
    for (int axis = 0; axis < 3; ++axis) {
      from[axis] = index(p[axis] - tolerance, axis);
      to[axis] = index(p[axis] + tolerance, axis);
    }
    bool same_place = false;
    for (std::uint64_t x = from[0]; x <= to[0]; ++x) {
      for (std::uint64_t y = from[1]; y <= to[1]; ++y) {
        for (std::uint64_t z = from[2]; z <= to[2]; ++z) {
          for (std::int32_t j = table.find((x << 42) | (y << 21) | z); j >= 0; j = chain[j]) {
            const double* other = points + 3 * static_cast<std::size_t>(j);
            const double dx = p[0] - other[0], dy = p[1] - other[1], dz = p[2] - other[2];
            const double squared = dx * dx + dy * dy + dz * dz;
            if (squared > tolerance * tolerance) continue;
            groups.join(static_cast<std::int32_t>(i), j);
            same_place = same_place || squared == 0.0;
          }
        }
      }
    }
    if (same_place) continue;  // an equal point is in the table already: keep chains short
    const std::uint64_t key = (index(p[0], 0) << 42) | (index(p[1], 1) << 21) | index(p[2], 2);
    chain[i] = table.push(key, static_cast<std::int32_t>(i));
  }
  out.representative.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::int32_t first = groups.find(static_cast<std::int32_t>(i));
    out.representative[i] = first;
    const double* a = points + 3 * i;
    const double* b = points + 3 * static_cast<std::size_t>(first);
    const double distance = std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
    out.largest_distance = std::max(out.largest_distance, distance);
  }
  return out;
}

EdgeTable edge_table(const PolygonView& polygons, std::size_t vertex_count) {
  // Counting sort by the lower vertex, then a small sort inside each bucket: linear in practice.
  const std::size_t slots = static_cast<std::size_t>(polygons.offsets[polygons.count]);
  struct Half {
    std::int32_t high;
    std::int64_t slot;
  };
  std::vector<std::int32_t> low(slots), high(slots);
  std::vector<std::int64_t> start(vertex_count + 1, 0);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    for (std::int64_t s = polygons.offsets[p]; s < polygons.offsets[p + 1]; ++s) {
      const std::int32_t a = polygons.corners[s], b = polygons.corners[polygons.next(p, s)];
      low[s] = std::min(a, b);
      high[s] = std::max(a, b);
      if (a != b) ++start[low[s] + 1];
    }
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Half> halves(static_cast<std::size_t>(start[vertex_count]));
  std::vector<std::int64_t> fill(start.begin(), start.end() - 1);
  for (std::size_t s = 0; s < slots; ++s) {
    if (low[s] != high[s]) halves[fill[low[s]]++] = {high[s], static_cast<std::int64_t>(s)};
  }
  EdgeTable out;
  out.slot_edge.assign(slots, -1);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto first = halves.begin() + start[v], last = halves.begin() + start[v + 1];
    std::sort(first, last, [](const Half& a, const Half& b) {
      return a.high != b.high ? a.high < b.high : a.slot < b.slot;
    });
    for (auto half = first; half != last; ++half) {
      if (half == first || half->high != (half - 1)->high) {
        out.ends.push_back(static_cast<std::int32_t>(v));
        out.ends.push_back(half->high);
        out.users.push_back(0);
      }
      out.slot_edge[half->slot] = static_cast<std::int32_t>(out.users.size()) - 1;
      ++out.users.back();
    }
  }
  return out;
}

Duplicates duplicate_polygons(const PolygonView& polygons) {
  Duplicates out;
  out.first.resize(polygons.count);
  out.opposite.assign(polygons.count, 0);
  // Canonical cycle: from the lowest corner towards its lower neighbour.
  std::vector<std::int32_t> canonical(static_cast<std::size_t>(polygons.offsets[polygons.count]));
  std::vector<std::uint8_t> backwards(polygons.count, 0);
  CellTable table(polygons.count);
  std::vector<std::int32_t> chain(polygons.count, -1);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    const std::int64_t from = polygons.offsets[p], n = polygons.offsets[p + 1] - from;
    const std::int32_t* c = polygons.corners + from;
    const std::int64_t lowest = std::min_element(c, c + n) - c;
    const bool back = c[(lowest + n - 1) % n] < c[(lowest + 1) % n];
    backwards[p] = back;
    std::uint64_t hash = static_cast<std::uint64_t>(n);
    for (std::int64_t k = 0; k < n; ++k) {
      const std::int32_t corner = c[(lowest + (back ? n - k : k)) % n];
      canonical[from + k] = corner;
      hash = mix(hash ^ static_cast<std::uint64_t>(corner));
    }
    hash &= ~(std::uint64_t{1} << 63);  // the all-ones key marks a free place
    out.first[p] = static_cast<std::int32_t>(p);
    for (std::int32_t q = table.find(hash); q >= 0; q = chain[q]) {
      const std::int64_t other = polygons.offsets[q];
      if (polygons.offsets[q + 1] - other != n) continue;
      if (std::equal(&canonical[from], &canonical[from] + n, &canonical[other])) {
        out.first[p] = q;
        out.opposite[p] = backwards[p] != backwards[q];
        break;
      }
    }
    if (out.first[p] == static_cast<std::int32_t>(p)) {
      chain[p] = table.push(hash, static_cast<std::int32_t>(p));
    }
  }
  return out;
}

Orientation flood_fill(const PolygonView& polygons, const EdgeTable& edges) {
  constexpr std::int64_t kNone = -1;
  const std::size_t edge_count = edges.users.size();
  std::vector<std::int64_t> users(2 * edge_count, kNone);
  std::vector<std::int32_t> slot_polygon(edges.slot_edge.size());
  for (std::size_t p = 0; p < polygons.count; ++p) {
    for (std::int64_t s = polygons.offsets[p]; s < polygons.offsets[p + 1]; ++s) {
      slot_polygon[s] = static_cast<std::int32_t>(p);
      const std::int32_t edge = edges.slot_edge[s];
      if (edge < 0 || edges.users[edge] != 2) continue;
      users[2 * edge + (users[2 * edge] == kNone ? 0 : 1)] = s;
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
        const std::int32_t edge = edges.slot_edge[s];
        if (edge < 0 || edges.users[edge] != 2) continue;
        const std::int64_t twin = users[2 * edge] == s ? users[2 * edge + 1] : users[2 * edge];
        const std::int32_t q = slot_polygon[twin];
        if (q == p) continue;  // a seam of a polygon with itself tells nothing
        const bool same_way = polygons.corners[s] == polygons.corners[twin];
        const std::uint8_t wanted = out.flip[p] ^ static_cast<std::uint8_t>(same_way);
        if (out.component[q] < 0) {
          out.component[q] = label;
          out.flip[q] = wanted;
          queue.push_back(q);
        } else if (out.flip[q] != wanted) {
          out.one_sided[label] = 1;
        }
      }
    }
  }
  return out;
}

std::vector<std::int32_t> connected_components(std::size_t nodes, const std::int32_t* pairs,
                                               std::size_t pair_count) {
  DisjointSets sets(nodes);
  for (std::size_t k = 0; k < pair_count; ++k) sets.join(pairs[2 * k], pairs[2 * k + 1]);
  std::vector<std::int32_t> label(nodes, -1);
  std::int32_t used = 0;
  for (std::size_t i = 0; i < nodes; ++i) {
    const std::int32_t root = sets.find(static_cast<std::int32_t>(i));
    if (label[root] < 0) label[root] = used++;
    label[i] = label[root];
  }
  return label;
}

std::vector<std::int32_t> nesting_depth(const double* points, const std::int32_t* triangles,
                                        const std::int32_t* triangle_component,
                                        std::size_t triangle_count, const double* queries,
                                        const std::uint8_t* closed, std::size_t component_count) {
  // Parity of crossings of a ray from each query, in a generic direction so that rays do not run
  // along the axis-aligned faces and edges CAD is full of. The queries are sorted into a grid
  // across the ray, so each triangle meets only those near it.
  std::vector<std::int32_t> depth(component_count, 0);
  std::vector<std::int32_t> active;
  for (std::size_t c = 0; c < component_count; ++c) {
    if (closed[c]) active.push_back(static_cast<std::int32_t>(c));
  }
  if (active.size() < 2) return depth;
  using Vec = std::array<double, 3>;
  constexpr std::array<Vec, 3> kAxes = {{{0.81649658, -0.35355339, 0.45643546},
                                         {0.27735010, 0.93541435, 0.22839193},
                                         {-0.50770552, -0.05988616, 0.85945101}}};
  const auto turned = [&](const double* p) {
    Vec out{};
    for (int k = 0; k < 3; ++k) {
      out[k] = kAxes[k][0] * p[0] + kAxes[k][1] * p[1] + kAxes[k][2] * p[2];
    }
    return out;
  };
  std::vector<Vec> query(component_count);
  std::array<double, 2> low{}, high{};
  low.fill(std::numeric_limits<double>::infinity());
  high.fill(-std::numeric_limits<double>::infinity());
  for (const std::int32_t c : active) {
    query[c] = turned(queries + 3 * static_cast<std::size_t>(c));
    for (int k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], query[c][k]);
      high[k] = std::max(high[k], query[c][k]);
    }
  }
  const auto cells = static_cast<std::int64_t>(std::ceil(std::sqrt(double(active.size()))));
  const auto cell_of = [&](double x, int k) {
    const double width = std::max(high[k] - low[k], 1e-300);
    const double at = std::floor((x - low[k]) / width * static_cast<double>(cells));
    return static_cast<std::int64_t>(std::clamp(at, 0.0, static_cast<double>(cells - 1)));
  };
  std::vector<std::vector<std::int32_t>> grid(static_cast<std::size_t>(cells * cells));
  for (const std::int32_t c : active) {
    grid[cell_of(query[c][0], 0) * cells + cell_of(query[c][1], 1)].push_back(c);
  }
  std::unordered_map<std::uint64_t, bool> odd;
  for (std::size_t t = 0; t < triangle_count; ++t) {
    const std::int32_t owner = triangle_component[t];
    if (!closed[owner]) continue;
    std::array<std::int32_t, 3> index{};
    std::array<Vec, 3> corner{};
    std::array<double, 2> from{low[0], low[1]}, to{high[0], high[1]};
    for (int k = 0; k < 3; ++k) {
      index[k] = triangles[3 * t + k];
      corner[k] = turned(points + 3 * static_cast<std::size_t>(index[k]));
    }
    bool outside = false;
    for (int k = 0; k < 2; ++k) {
      const auto [least, most] = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
      outside = outside || least > high[k] || most < low[k];
      from[k] = least;
      to[k] = most;
    }
    if (outside) continue;
    for (std::int64_t x = cell_of(from[0], 0); x <= cell_of(to[0], 0); ++x) {
      for (std::int64_t y = cell_of(from[1], 1); y <= cell_of(to[1], 1); ++y) {
        for (const std::int32_t c : grid[x * cells + y]) {
          if (c == owner) continue;
          const Vec& q = query[c];
          bool inside = false;
          for (int k = 0; k < 3; ++k) {
            // Low index first, so that both users of an edge compute the very same number.
            int a = k, b = (k + 1) % 3;
            if (index[a] > index[b]) std::swap(a, b);
            if ((corner[a][1] > q[1]) == (corner[b][1] > q[1])) continue;
            const double share = (q[1] - corner[a][1]) / (corner[b][1] - corner[a][1]);
            if (q[0] < corner[a][0] + share * (corner[b][0] - corner[a][0])) inside = !inside;
          }
          if (!inside) continue;
          const Vec &a = corner[0], &b = corner[1], &d = corner[2];
          const double ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - a[0], vy = d[1] - a[1];
          const double area = ux * vy - uy * vx;
          if (area == 0.0) continue;
          const double s = ((q[0] - a[0]) * vy - (q[1] - a[1]) * vx) / area;
          const double r = ((q[1] - a[1]) * ux - (q[0] - a[0]) * uy) / area;
          if (a[2] + s * (b[2] - a[2]) + r * (d[2] - a[2]) <= q[2]) continue;
          const std::uint64_t key = (std::uint64_t(c) << 32) | std::uint64_t(owner);
          odd[key] = !odd[key];
        }
      }
    }
  }
  for (const auto& [key, value] : odd) {
    if (value) ++depth[key >> 32];
  }
  return depth;
}

}  // namespace sphshell
