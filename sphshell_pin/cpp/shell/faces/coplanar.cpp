#include "shell/faces/coplanar.hpp"

#include <Eigen/Dense>
#include <cstring>
#include <tuple>

#include "shell/in_parallel.hpp"

namespace sphshell {
namespace {

// Facets whose normals differ by more than this (cosine) are not in one plane, slivers included.
constexpr double kSameSide = 0.9;
// Triangles within so many tolerances of a plane may be in it once it is fitted, to so many
// triangles at least, so many times.
constexpr double kBeside = 30;
constexpr std::size_t kFewToFit = 3, kMostFits = 6;

}  // namespace

CoplanarRegions::CoplanarRegions(const Shell& shell, double tolerance)
    : of_(shell.triangles().size(), -1), alone_(shell.triangles().size()) {
  const std::vector<Triangle>& triangles = shell.triangles();
  const std::vector<Vec3>& p = shell.vertices();
  const Topology& topology = shell.topology();
  const std::size_t count = triangles.size();
  // How far a triangle is off a plane [m]; infinite where it is turned away from it.
  const auto off_plane = [&](int t, const Vec3& normal, const Vec3& origin) {
    double most = 0;
    if (topology.face_normal[t].dot(normal) < kSameSide)
      return std::numeric_limits<double>::infinity();
    for (const int v : triangles[t]) most = std::max(most, std::abs((p[v] - origin).dot(normal)));
    return most;
  };
  LargeArray<float> area(count);
  LargeArray<std::uint64_t> order(count);
  std::vector<int> found;
  for_each_in_parallel(count, [&](std::size_t t) {
    const Triangle& c = triangles[t];
    area[t] = static_cast<float>((p[c[1]] - p[c[0]]).cross(p[c[2]] - p[c[0]]).norm() / 2);
    // Descending areas, then ascending numbers: the bits of positive floats are in their order.
    std::uint32_t bits;
    std::memcpy(&bits, &area[t], sizeof bits);
    order[t] = std::uint64_t(~bits) << 32 | t;
    // In the order of memory, which that of the areas is not.
    alone_[t] = 1;
    for (int k = 0; k < 3 && alone_[t]; ++k) {
      const int h = topology.other_half_edge(static_cast<int>(3 * t) + k);
      alone_[t] =
          h < 0 || !(off_plane(triangle_of(h), topology.face_normal[t], p[c[0]]) <= tolerance);
    }
  });
  // The largest triangle of a region gives its plane, as its normal is the most exact.
  std::sort(order.begin(), order.end());
  regions_.reserve(count);
  for (const std::uint64_t word : order) {
    const int first = static_cast<int>(static_cast<std::uint32_t>(word));
    if (of_[first] >= 0) continue;
    const int region = size();
    Region out{topology.face_normal[first], area[first], 0, 1};
    if (alone_[first]) {
      of_[first] = region;
      regions_.push_back(out);
      continue;
    }
    Vec3 origin = p[triangles[first][0]];
    Eigen::AlignedBox3d box;
    // The plane of the largest triangle is off far from it, by the rounding of its corners: where
    // triangles stand off by little, the plane is fitted to what was found, which is looked for
    // again.
    std::pair<Vec3, Vec3> last;  // normal and origin before the fit
    bool settled = false;
    for (std::size_t before = 0, round = 0;; ++round) {
      bool any_beside = false;
      const auto lies_in_plane = [&](int t) {
        const double most = off_plane(t, out.normal, origin);
        any_beside = any_beside || (most > tolerance && most < kBeside * tolerance);
        return most <= tolerance;
      };
      box.setEmpty(), out.area = 0;
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
      if (!settled && found.size() < before) {
        // The fit was ill-conditioned, as of needles in a line: back to the plane before.
        std::tie(out.normal, origin) = last;
        settled = true;
        for (const int t : found) of_[t] = -1;
        continue;
      }
      if (settled || !any_beside || found.size() < kFewToFit || found.size() == before ||
          round == kMostFits)
        break;
      last = {out.normal, origin};
      before = found.size();
      // Least squares over the areas, by their moments about the first triangle.
      Vec3 middle = Vec3::Zero();
      for (const int t : found)
        for (const int v : triangles[t]) middle += area[t] / (3 * out.area) * (p[v] - origin);
      Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
      for (const int t : found)
        for (const int v : triangles[t]) {
          const Vec3 off = p[v] - origin - middle;
          second += area[t] / out.area * off * off.transpose();
        }
      const Vec3 normal =
          Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(second).eigenvectors().col(0);
      out.normal = normal.dot(out.normal) < 0 ? Vec3(-normal) : normal;
      origin += middle;
      for (const int t : found) of_[t] = -1;
    }
    out.count = static_cast<int>(found.size());
    for (const int t : found) alone_[t] = found.size() == 1;
    out.extent = box.diagonal().norm();
    regions_.push_back(out);
  }
  // Area over the side's length, and no more than the region's extent: a region of several
  // triangles counts as a rectangle over the side.
  heights_.resize(3 * count);
  for (std::size_t t = 0; t < count; ++t)
    for (int k = 0; k < 3; ++k) {
      const Triangle& c = triangles[t];
      const Vec3 side = p[c[next_corner(k)]] - p[c[k]];
      heights_[3 * t + static_cast<std::size_t>(k)] =
          alone_[t] ? side.cross(p[c[previous_corner(k)]] - p[c[k]]).norm() / side.norm()
                    : std::min(regions_[of_[t]].area / side.norm(), regions_[of_[t]].extent);
    }
}

}  // namespace sphshell
