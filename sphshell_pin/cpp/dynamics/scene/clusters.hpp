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
  bool is_far(const Pair& pair, const Vec3& center_in_shell) const {
    const Shell& shell = *std::get<ShellSurface>(pair.geometry).shell;
    const double bulge = shell.curved() != nullptr ? shell.curved()->bulge() : 0;
    return !shell.bvh().may_meet(center_in_shell, radius + bulge);
  }
  // The center in the frame of the shell, which has its place in the world.
  Vec3 center_in_shell(const Multibody& body, const Pair& pair, const SE3& world_from_j) const {
    // As find_contacts() does it with the center of one sphere.
    return world_from_j.actInv(body.world_from(pair.joint_i, center));
  }
};

// Those of several pairs, in their order.
std::vector<Cluster> clusters_of(const std::vector<Pair>& pairs);

}  // namespace sphshell
