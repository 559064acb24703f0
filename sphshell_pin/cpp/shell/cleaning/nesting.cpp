// Which closed components of a surface lie inside which others.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "shell/cleaning/mending.hpp"

namespace sphshell {

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
  // Orthonormal rows, none of them along an axis.
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
  // About one query in each cell.
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
          // Barycentric coordinates of the query in the projection: the height of the triangle
          // there.
          const double area = ux * vy - uy * vx;
          if (area == 0.0) continue;
          const double s = ((q[0] - a[0]) * vy - (q[1] - a[1]) * vx) / area;
          const double r = ((q[1] - a[1]) * ux - (q[0] - a[0]) * uy) / area;
          if (a[2] + s * (b[2] - a[2]) + r * (d[2] - a[2]) <= q[2]) continue;
          const std::uint64_t key = (std::uint64_t(c) << 32) | std::uint64_t(owner);
          // The ray along the third axis crosses this triangle above the query.
          odd[key] = !odd[key];
        }
      }
    }
  }
  for (const auto& [key, value] : odd) {
    // Inside each component with an odd number of crossings.
    if (value) ++depth[key >> 32];
  }
  return depth;
}

}  // namespace sphshell
