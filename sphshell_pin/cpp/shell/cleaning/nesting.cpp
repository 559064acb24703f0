// How much of each closed component of a surface lies inside which others, along lines.
#include <map>
#include <tuple>

#include "shell/cleaning/mending.hpp"
#include "shell/point_tree.hpp"

namespace sphshell {

Overlaps overlaps(Points points, Rows<std::int32_t, 3> triangles, Indices triangle_component,
                  Points places, Indices place_component, Indices group) {
  // Lines in a generic direction, so that they do not run along the axis-aligned faces and edges
  // CAD is full of. They are in a tree across that direction: each triangle meets only those near.
  // Orthonormal rows, none of them along an axis.
  const Mat3 turn{{0.81649658, -0.35355339, 0.45643546},
                  {0.27735010, 0.93541435, 0.22839193},
                  {-0.50770552, -0.05988616, 0.85945101}};
  // In the plane across the lines.
  std::vector<Eigen::Vector2d> at(places.count);
  std::vector<std::int32_t> lines(places.count);
  for (std::size_t k = 0; k < places.count; ++k) {
    at[k] = (turn * place(places, k)).head<2>();
    lines[k] = static_cast<std::int32_t>(k);
  }
  const PointTree<2> tree(at.data()->data(), std::move(lines));
  struct Crossing {
    std::int32_t line;
    double height;
    std::int32_t component;
  };
  std::vector<Crossing> crossings;
  for (std::size_t t = 0; t < triangles.count; ++t) {
    const std::int32_t owner = triangle_component[t];
    if (group[owner] < 0) continue;
    const std::int32_t* index = triangles.data + 3 * t;
    Vec3 corner[3];
    PointTree<2>::Box span;
    for (int k = 0; k < 3; ++k) {
      corner[k] = turn * place(points, index[k]);
      span.extend(corner[k].head<2>());
    }
    const auto meets = [&](const PointTree<2>::Box& box) { return box.intersects(span); };
    tree.search(meets, [&](std::int32_t line) {
      if (group[place_component[line]] != group[owner]) return false;
      const Eigen::Vector2d& q = at[line];
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
      const Vec3 &a = corner[0], &b = corner[1], &d = corner[2];
      const double ux = b[0] - a[0], uy = b[1] - a[1], vx = d[0] - a[0], vy = d[1] - a[1];
      // Barycentric coordinates of the line in the projection: the height of the triangle there. A
      // triangle on edge has one as well, for every component must be left as often as entered.
      const double area = ux * vy - uy * vx, scale = area == 0.0 ? 0.0 : 1.0 / area;
      const double s = ((q[0] - a[0]) * vy - (q[1] - a[1]) * vx) * scale;
      const double r = ((q[1] - a[1]) * ux - (q[0] - a[0]) * uy) * scale;
      const double height =
          a[2] + std::clamp(s, 0.0, 1.0) * (b[2] - a[2]) + std::clamp(r, 0.0, 1.0) * (d[2] - a[2]);
      crossings.push_back({line, height, owner});
      return false;
    });
  }
  std::sort(crossings.begin(), crossings.end(), [](const Crossing& x, const Crossing& y) {
    return std::tie(x.line, x.height, x.component) < std::tie(y.line, y.height, y.component);
  });
  // Along each line, the pieces inside the line's own component: their length, and how much of it
  // is inside each other component as well.
  std::map<std::pair<std::int32_t, std::int32_t>, double> shared;
  std::vector<std::int32_t> in;  // components the line is in
  for (std::size_t k = 0; k < crossings.size(); ++k) {
    const Crossing& here = crossings[k];
    if (k == 0 || crossings[k - 1].line != here.line) in.clear();
    const auto known = std::find(in.begin(), in.end(), here.component);
    if (known == in.end())
      in.push_back(here.component);
    else
      in.erase(known);
    const std::int32_t own = place_component[here.line];
    if (std::find(in.begin(), in.end(), own) == in.end()) continue;
    // Closed components leave every line outside: another crossing follows.
    const double length = crossings[k + 1].height - here.height;
    for (const std::int32_t component : in) shared[{own, component}] += length;
  }
  Overlaps out;
  for (const auto& [pair, length] : shared) {
    const double own = shared.at({pair.first, pair.first});
    if (pair.first == pair.second || !(own > 0.0)) continue;
    out.pairs.push_back({pair.first, pair.second});
    out.share.push_back(length / own);
  }
  return out;
}

}  // namespace sphshell
