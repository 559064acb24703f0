#include "dynamics/scene/clusters.hpp"

namespace sphshell {

// Whether both are of one group and touch one surface at one place.
static bool stand_alike(const Pair& a, const Pair& b) {
  const auto *one = std::get_if<ShellSurface>(&a.geometry),
             *other = std::get_if<ShellSurface>(&b.geometry);
  return !a.group.empty() && a.group == b.group && one && other && one->shell == other->shell &&
         one->method == other->method && a.joint_i == b.joint_i && a.joint_j == b.joint_j &&
         a.placement_j == b.placement_j;
}

std::vector<Cluster> clusters_of(const std::vector<Pair>& pairs) {
  std::vector<Cluster> out;
  for (std::size_t k = 1; k < pairs.size(); ++k) {
    if (!stand_alike(pairs[k - 1], pairs[k])) continue;
    if (out.empty() || out.back().last != k - 1) out.push_back({k - 1, k, Vec3::Zero(), 0});
    out.back().last = k;
  }
  for (Cluster& cluster : out) {
    // Not the smallest ball, but nearly: about the middle of the centers' box.
    Eigen::AlignedBox3d box;
    for (std::size_t k = cluster.first; k <= cluster.last; ++k)
      box.extend(pairs[k].placement_i.translation());
    cluster.center = box.center();
    for (std::size_t k = cluster.first; k <= cluster.last; ++k) {
      const double away = (pairs[k].placement_i.translation() - cluster.center).norm();
      cluster.radius = std::max(cluster.radius, away + pairs[k].radius);
    }
  }
  return out;
}

}  // namespace sphshell
