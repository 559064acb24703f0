// Which closed components of a surface lie inside which others.
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "shell/cleaning/mending.hpp"
#include "shell/point_tree.hpp"

namespace sphshell {

std::vector<std::int32_t> nesting_depth(const double* points, const std::int32_t* triangles,
                                        const std::int32_t* triangle_component,
                                        std::size_t triangle_count, const double* queries,
                                        const std::uint8_t* closed, std::size_t component_count) {
  // Parity of crossings of a ray from each query, in a generic direction so that rays do not run
  // along the axis-aligned faces and edges CAD is full of. The queries are in a tree
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
  // In the plane across the ray, by component.
  std::vector<Vec> query(component_count);
  std::vector<double> place(2 * component_count);
  for (const std::int32_t c : active) {
    query[c] = turned(queries + 3 * static_cast<std::size_t>(c));
    place[2 * c] = query[c][0], place[2 * c + 1] = query[c][1];
  }
  const PointTree<2> tree(place.data(), std::move(active));
  std::unordered_map<std::uint64_t, bool> odd;
  for (std::size_t t = 0; t < triangle_count; ++t) {
    const std::int32_t owner = triangle_component[t];
    if (!closed[owner]) continue;
    std::array<std::int32_t, 3> index{};
    std::array<Vec, 3> corner{};
    PointTree<2>::Box span{};
    for (int k = 0; k < 3; ++k) {
      index[k] = triangles[3 * t + k];
      corner[k] = turned(points + 3 * static_cast<std::size_t>(index[k]));
    }
    for (int k = 0; k < 2; ++k)
      std::tie(span.low[k], span.high[k]) = std::minmax({corner[0][k], corner[1][k], corner[2][k]});
    const auto meets = [&](const PointTree<2>::Box& box) {
      return box.low[0] <= span.high[0] && box.high[0] >= span.low[0] &&
             box.low[1] <= span.high[1] && box.high[1] >= span.low[1];
    };
    tree.search(meets, [&](std::int32_t c) {
      if (c == owner) return false;
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
      if (!inside) return false;
      const Vec &a = corner[0], &b = corner[1], &d = corner[2];
      const double ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - a[0], vy = d[1] - a[1];
      // Barycentric coordinates of the query in the projection: the height of the triangle
      // there.
      const double area = ux * vy - uy * vx;
      if (area == 0.0) return false;
      const double s = ((q[0] - a[0]) * vy - (q[1] - a[1]) * vx) / area;
      const double r = ((q[1] - a[1]) * ux - (q[0] - a[0]) * uy) / area;
      if (a[2] + s * (b[2] - a[2]) + r * (d[2] - a[2]) <= q[2]) return false;
      const std::uint64_t key = (std::uint64_t(c) << 32) | std::uint64_t(owner);
      // The ray along the third axis crosses this triangle above the query.
      odd[key] = !odd[key];
      return false;
    });
  }
  for (const auto& [key, value] : odd) {
    // Inside each component with an odd number of crossings.
    if (value) ++depth[key >> 32];
  }
  return depth;
}

}  // namespace sphshell
