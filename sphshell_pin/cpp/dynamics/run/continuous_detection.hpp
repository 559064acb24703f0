// No sphere passes through a shell between two evaluations of the forces.
#pragma once

#include "dynamics/integrators/chart.hpp"

namespace sphshell {

// A step may move the center of a sphere, in the shell's frame, by the gap and a sixteenth of the
// radius while they are apart, and by a quarter of the radius while they touch. So the force acts
// before the center comes near the surface, at any speed, and what is missed between two
// evaluations is a touch of at most r / 2000.
class ContinuousDetection {
 public:
  explicit ContinuousDetection(const SceneData& scene);

  // The scene's last evaluate() was at the state where the next step begins.
  void begin(const SceneData& scene);
  // The share of the step from `from` to `to` that is allowed; 1 or more: all of it. The scene's
  // last evaluate() was at `to`. With `gap_at_end`, a sphere that is apart may also move by the gap
  // at the end: it cannot have touched on a way of that length either.
  double allowed(SceneData& scene, const State& from, const State& to, bool gap_at_end = false);

 private:
  struct Known {
    Vec3 center = Vec3::Zero();  // at the begin of the step
    bool touching = false;
    // A place of the center, and its distance to the shell there at least.
    Vec3 anchor = Vec3::Zero();
    double distance = -1;
  };

  // Lower bounds at the begin of the step, and the length of a center's path, in meters, where
  // nothing turns by more than `turned` [rad].
  static double gap(const Pair& pair, double radius, Known& known);
  bool is_clear(const SceneData& scene, const Cluster& cluster, Known& known) const;
  double path(SceneData& scene, std::size_t k, const State& from, const State& to, double turned);

  std::vector<Known> known_;
  std::vector<Known> known_of_cluster_;  // of the ball round its spheres
  VectorX u_, q_;
};

}  // namespace sphshell
