#include "dynamics/run/continuous_detection.hpp"

namespace sphshell {

constexpr double kApart = 1.0 / 16, kTouching = 0.25;  // shares of the radius
// A touch on a shorter way than this share of the radius may be missed.
constexpr double kSeen = 1e-3;
// A chord is not taken for the path where something turns by more than this in a step [rad].
constexpr double kTurn = 0.5;
constexpr double kMostTurned = 16;

// A lower bound of the distance from a center to what is on body j [m].
static double distance_of(const Pair& pair, const Vec3& center) {
  return pair.ask([&](const auto& one) { return one.distance(center); });
}

// One known distance for each pair and each cluster.
ContinuousDetection::ContinuousDetection(const SceneData& scene)
    : known_(scene.pairs().size()), known_of_cluster_(scene.clusters().size()) {}

// Where each sphere is at the begin of the step, and whether it touches.
void ContinuousDetection::begin(const SceneData& scene) {
  for (std::size_t k = 0; k < known_.size(); ++k) {
    known_[k].center = scene.states()[k].center;
    known_[k].touching = scene.states()[k].count > 0;
  }
  for (std::size_t c = 0; c < known_of_cluster_.size(); ++c) {
    const Cluster& cluster = scene.clusters()[c];
    const std::size_t k = cluster.first;
    Known& known = known_of_cluster_[c];
    known.center =
        cluster.center_in_shell(scene.body(), scene.pairs()[k], scene.states()[k].world_from_j);
    known.touching = false;
    for (std::size_t i = k; i <= cluster.last; ++i)
      known.touching = known.touching || known_[i].touching;
  }
}

// Whether the ball of a cluster has been as far from the shell as none of its spheres moved: then
// none of them needs a look of its own.
bool ContinuousDetection::is_clear(const SceneData& scene, const Cluster& cluster,
                                   Known& known) const {
  if (known.touching) return false;
  double moved = 0, radius = std::numeric_limits<double>::infinity();
  for (std::size_t k = cluster.first; k <= cluster.last; ++k) {
    if (scene.excursions()[k].touched) return false;
    moved = std::max(moved, scene.excursions()[k].moved);
    radius = std::min(radius, scene.pairs()[k].radius);
  }
  const double slack = kApart * radius;
  return moved <= slack ||
         moved <= slack + gap(scene.pairs()[cluster.first], cluster.radius, known);
}

// The share of the step up to which no sphere can have passed through anything unseen; 1 and more:
// all of it. A touching sphere may move by kTouching of its radius, another one by its gap and
// kApart.
double ContinuousDetection::allowed(SceneData& scene, const State& from, const State& to,
                                    bool gap_at_end) {
  double share = std::numeric_limits<double>::infinity();
  const double h = to.t - from.t;
  const double turned =
      h * std::max(from.v.lpNorm<Eigen::Infinity>(), to.v.lpNorm<Eigen::Infinity>());
  std::size_t next = 0;
  for (std::size_t k = 0; k < known_.size(); ++k) {
    if (next < known_of_cluster_.size() && scene.clusters()[next].first == k) {
      const Cluster& cluster = scene.clusters()[next];
      Known& known = known_of_cluster_[next++];
      if (turned <= kTurn && is_clear(scene, cluster, known)) {
        k = cluster.last;
        continue;
      }
    }
    const Pair& pair = scene.pairs()[k];
    if (!pair.has_sphere()) continue;
    const double radius = pair.least_radius();
    Known& known = known_[k];
    const Excursion& excursion = scene.excursions()[k];
    // In and out again within a step: what the stages saw of it is not the motion.
    const bool skipped = excursion.touched && !known.touching && scene.states()[k].count == 0 &&
                         excursion.moved > kSeen * radius;
    if (skipped) share = std::min(share, 0.5);
    double moved = excursion.moved;
    const double slack = radius * (known.touching ? kTouching : kApart);
    if (turned > kMostTurned) share = std::min(share, kMostTurned / turned);
    if (turned > kTurn) moved = std::max(moved, path(scene, k, from, to, turned));
    if (moved <= slack) continue;
    double limit = slack + (known.touching ? 0 : gap(pair, pair.radius, known));
    if (gap_at_end && moved > limit && !known.touching)
      limit += std::max(0.0, distance_of(pair, scene.states()[k].center) - pair.radius);
    share = std::min(share, limit / moved);
  }
  if (turned > kTurn) scene.body().kinematics(to.q, to.v);
  return share;
}

// A lower bound of the gap of a sphere at the begin of the step; the distance is looked up where
// the one known is worn out.
double ContinuousDetection::gap(const Pair& pair, double radius, Known& known) {
  // The distance known at the anchor, less the way since: still a lower bound.
  double distance = known.distance - (known.center - known.anchor).norm();
  if (known.distance < 0 || distance < std::max(2 * radius, 0.5 * known.distance)) {
    known.anchor = known.center;
    distance = known.distance = distance_of(pair, known.center);
  }
  return std::max(0.0, distance - radius);
}

// Length of the center's path in the shell's frame, by chords.
double ContinuousDetection::path(SceneData& scene, std::size_t k, const State& from,
                                 const State& to, double turned) {
  const Pair& pair = scene.pairs()[k];
  Multibody& body = scene.body();
  const double h = to.t - from.t;
  const int chords = static_cast<int>(std::ceil(std::min(turned, kMostTurned) / (0.5 * kTurn)));
  q_.resize(from.q.size());
  Vec3 last = known_[k].center;
  double length = 0;
  for (int i = 1; i <= chords; ++i) {
    const double share = double(i) / chords;
    u_ = share * h * (from.v + 0.5 * share * (to.v - from.v));
    body.integrate(from.q, u_, q_);
    body.kinematics(q_);
    const Vec3 center = body.world_from(pair.joint_j, pair.placement_j)
                            .actInv(body.world_from(pair.joint_i, pair.placement_i).translation());
    length += (center - last).norm();
    last = center;
  }
  return length;
}

}  // namespace sphshell
