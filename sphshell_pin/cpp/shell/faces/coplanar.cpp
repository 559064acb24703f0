#include "shell/faces/coplanar.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace sphshell {

CoplanarRegions::CoplanarRegions(const Shell& shell, double tolerance)
    : shell_(shell), of_(shell.triangles().size(), -1) {
  const std::vector<Triangle>& triangles = shell.triangles();
  const std::vector<Vec3>& p = shell.vertices();
  const Topology& topology = shell.topology();
  const std::size_t count = triangles.size();
  std::vector<float> area(count);
  std::vector<int> order(count), found;
  for (std::size_t t = 0; t < count; ++t) {
    const Triangle& c = triangles[t];
    area[t] = static_cast<float>((p[c[1]] - p[c[0]]).cross(p[c[2]] - p[c[0]]).norm() / 2);
  }
  std::iota(order.begin(), order.end(), 0);
  // The largest triangle of a region gives its plane, as its normal is the most exact.
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return area[a] != area[b] ? area[a] > area[b] : a < b; });
  for (const int first : order) {
    if (of_[first] >= 0) continue;
    const int region = size();
    const Vec3& normal = topology.face_normal[first];
    const Vec3& origin = p[triangles[first][0]];
    // The normals of slivers are noise.
    constexpr double kSameSide = 0.9;
    const auto lies_in_plane = [&](int t) {
      if (topology.face_normal[t].dot(normal) < kSameSide) return false;
      for (const int v : triangles[t])
        if (std::abs((p[v] - origin).dot(normal)) > tolerance) return false;
      return true;
    };
    Region out{normal, 0, 0, 0};
    Eigen::AlignedBox3d box;
    of_[first] = region;
    found.assign(1, first);
    for (std::size_t i = 0; i < found.size(); ++i) {
      const int t = found[i];
      out.area += area[t];
      for (int k = 0; k < 3; ++k) {
        box.extend(p[triangles[t][k]]);
        const int h = topology.other_half_edge(3 * t + k);
        if (h < 0) continue;
        const int u = triangle_of(h);
        if (of_[u] >= 0 || !lies_in_plane(u)) continue;
        of_[u] = region;
        found.push_back(u);
      }
    }
    out.count = static_cast<int>(found.size());
    out.extent = box.diagonal().norm();
    regions_.push_back(out);
  }
}

// Area over the side's length, and no more than the region's extent: a region of several triangles
// counts as a rectangle over the side.
double CoplanarRegions::height(int half_edge) const {
  const int t = triangle_of(half_edge), k = side_of(half_edge);
  const Triangle& c = shell_.triangles()[t];
  const std::vector<Vec3>& p = shell_.vertices();
  const Vec3 side = p[c[next_corner(k)]] - p[c[k]];
  const Region& region = regions_[of_[t]];
  if (region.count == 1) return side.cross(p[c[previous_corner(k)]] - p[c[k]]).norm() / side.norm();
  return std::min(region.area / side.norm(), region.extent);
}

}  // namespace sphshell
