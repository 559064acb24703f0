#include "shell/faces/coplanar.hpp"

#include <cstring>

#include "shell/faces/primitive.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {

// Facets whose normals differ by more than this (cosine) are not in one plane, slivers included.
constexpr double kSameSide = 0.9;
// Triangles within so many tolerances of a plane may be in it once it is fitted. Fits go on until
// so many triangles were looked at per triangle of the region, and these in small ones.
constexpr double kBeside = 30;
constexpr std::size_t kLooksPerTriangle = 8, kFewLooks = 300;

void Moments::add(double area, const std::array<Vec3, 3>& corners) {
  area_ += area;
  for (const Vec3& x : corners) {
    first_ += area / 3 * (x - about_);
    second_ += area / 3 * (x - about_) * (x - about_).transpose();
  }
}

Vec3 Moments::normal(const Vec3& side) const {
  const Vec3 out = eigenvectors(second()).col(0);
  return out.dot(side) < 0 ? Vec3(-out) : out;
}

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
  // Two triangles of a plane may be off each other's where coordinates are rounded coarsely.
  const double near = (is_precise(shell, tolerance) ? 1 : kBeside) * tolerance;
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
      const int u = topology.neighbor(static_cast<int>(3 * t) + k);
      alone_[t] = u < 0 || !(off_plane(u, topology.face_normal[t], p[c[0]]) <= near);
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
    Eigen::AlignedBox3d box;
    std::size_t visits = 0;
    int next = -1;  // the nearest of the triangles beside
    std::pair<Vec3, Vec3> plane{out.normal, p[triangles[first][0]]};  // normal and origin
    found.clear();
    const auto flood = [&] {
      double nearest = kBeside * tolerance;
      next = -1;
      for (const int t : found) of_[t] = -1;
      box.setEmpty(), out.area = 0;
      of_[first] = region;
      found.assign(1, first);
      for (std::size_t i = 0; i < found.size(); ++i) {
        const int t = found[i];
        out.area += area[t];
        for (int k = 0; k < 3; ++k) {
          box.extend(p[triangles[t][k]]);
          const int u = topology.neighbor(3 * t + k);
          if (u < 0 || of_[u] >= 0) continue;
          const double off = off_plane(u, plane.first, plane.second);
          if (off > tolerance) {
            if (off < nearest) nearest = off, next = u;
            continue;
          }
          of_[u] = region;
          found.push_back(u);
        }
      }
      visits += found.size();
    };
    flood();
    // The plane of the largest triangle is off far from it, by the rounding of its corners: where
    // triangles stand off by little, the plane is fitted to what was found, and then to the nearest
    // of them as well, and all is looked for again. A fit may be ill-conditioned, as of needles in
    // a line.
    for (bool grew = true;
         grew && next >= 0 && visits < kLooksPerTriangle * found.size() + kFewLooks;) {
      grew = false;
      const std::size_t before = found.size();
      const int beside = next;
      Moments fit(plane.second);
      const auto add = [&](int t) { fit.add(area[t], shell.corners(t)); };
      for (const int t : found) add(t);
      for (const bool with_beside : {false, true}) {
        if (grew) break;
        const std::pair<Vec3, Vec3> last = plane;
        if (with_beside) add(beside);
        plane = {fit.normal(out.normal), fit.middle()};
        flood();
        grew = found.size() > before;
        if (found.size() < before + with_beside) plane = last, flood();
      }
    }
    out.normal = plane.first;
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
