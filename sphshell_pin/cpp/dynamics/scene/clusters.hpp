// Spheres that are far from a shell together: one test instead of one for each.
#pragma once

#include "dynamics/scene/multibody.hpp"
#include "dynamics/scene/pair.hpp"

namespace sphshell {

// Neighboring pairs of one group between the same two bodies and with the same shell; all their
// spheres are in one ball.
struct Cluster {
  std::size_t first, last;
  Vec3 center = Vec3::Zero();  // of the ball, in the joint of the spheres [m]
  double radius = 0;

  // Whether the ball, with its center in the shell's frame, is outside the box of the shell.
  bool is_far(const Pair& pair, const Vec3& center_in_shell) const;
  // The center in the frame of the shell, which has its place in the world.
  Vec3 center_in_shell(const Multibody& body, const Pair& pair, const SE3& world_from_j) const;
};

// Those of several pairs, in their order.
std::vector<Cluster> clusters_of(const std::vector<Pair>& pairs);

}  // namespace sphshell
