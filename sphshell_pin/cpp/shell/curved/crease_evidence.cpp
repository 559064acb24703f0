// Estimates of the surface by single elements, and the evidence that an edge is smooth.

#include "shell/curved/crease_search.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {

// A joint of a curved surface turns by what the elements on its two sides, each by itself, have
// turned when they reach it, but for this share; and its two sides bend alike within this factor.
constexpr double kUneven = 0.3, kAlike = 5;
// Helmholtz's principle (Desolneux, Moisan, Morel, Int. J. Computer Vision 40 (2000) 7): a run of
// joints is a curved surface if joints that have nothing to do with each other would agree as well
// in one of a thousand cases only. One joint agrees to the share s by chance with probability
// kChance * s, and is worth no more than the least probability, so that a run has two at least.
constexpr double kChance = 1.5, kLeastProbability = 0.01, kEnough = 7;  // of -log of the product
constexpr int kLongestRun = 6;                                          // to either side
// A mean as a file has it: to so much, and so much of the lean; and a share of all normals.
constexpr double kDigits = 2e-6, kSurelyMean = 1e-3, kMostMeans = 0.9;
// A fan goes on beyond its corner where a side leads away from the opposite edge by this sine.
constexpr double kBeyond = 0.3;
// A given normal is a mean of its elements' if it is nearer to one than this share of what they
// lean.
constexpr double kAveraged = 0.1;

// How far a fan's normal is from the nearest mean of those of its elements, and how much it leans
// from them.
static std::array<double, 2> off_mean(const Shell& shell, Span fan, const Vec3& normal) {
  Vec3 alike = Vec3::Zero(), by_area = Vec3::Zero(), by_angle = Vec3::Zero();
  double lean = 0, off = std::numeric_limits<double>::infinity();
  for (const int c : fan) {
    const Vec3 a = shell.along(c), b = shell.point(corner_before(c)) - shell.point(c);
    const Vec3& n = shell.topology().face_normal[c / 3];
    const double area = a.cross(b).norm();
    alike += n, by_area += area * n, by_angle += std::atan2(area, a.dot(b)) * n;
    lean = std::max(lean, (normal - n).norm());
  }
  for (const Vec3& mean : {alike, by_area, by_angle, max_normal(shell, fan)})
    off = std::min(off, (mean.normalized() - normal).norm());
  return {off, lean};
}

// Per corner whether its normal tells more than those of its elements do.
std::vector<char> independent_normals(const Shell& shell, const Fans& fans,
                                      const std::vector<Vec3>& normals) {
  std::vector<char> out(normals.size(), 0);
  for (int f = 0; f < fans.size(); ++f) {
    const auto [off, lean] = off_mean(shell, fans[f], normals[*fans[f].first]);
    for (const int c : fans[f]) out[c] = !(off <= kAveraged * lean);
  }
  return out;
}

// Whether nearly all normals that lean from their elements are means of theirs, to the digits of a
// file.
bool are_means(const Shell& shell, const Fans& fans, const std::vector<Vec3>& normals) {
  int leaning = 0, means = 0;
  for (int f = 0; f < fans.size(); ++f) {
    const auto [off, lean] = off_mean(shell, fans[f], normals[*fans[f].first]);
    if (lean <= kSameNormal) continue;
    ++leaning;
    means += off <= kDigits + kSurelyMean * lean;
  }
  return means > kMostMeans * leaning;
}

// The surface at a side, from the normal at the opposite corner, if each of the two chords from
// there leans alike at both ends: exact where it is quadratic.
SideEstimate CreaseSearch::estimate_side(const Fans& fans, int h) const {
  const int i = h, j = corner_after(h), o = opposite(h);
  const Vec3 &p = point(i), &q = point(j), &r = point(o);
  const Vec3 a = p - r, b = q - r;
  Vec3 along = q - p;
  const double length = along.norm();
  along /= length;
  const double height = a.cross(b).norm() / length;
  // With the normal at the opposite corner, and those at the joint's ends, the element is a
  // quadratic: its rise and its slope across the joint follow.
  const double at_first = -normals()[o].dot(a), at_last = -normals()[o].dot(b);
  const double far_first = a.dot(along), far_last = b.dot(along);
  const double bend_first = normals()[i].dot(along), bend_last = normals()[j].dot(along);
  // The nearer end is more accurate: at the other a cone has become narrower, say.
  const double weight_first = std::sqrt(b.norm()), weight_last = std::sqrt(a.norm());
  const double rise = (weight_first * (at_first - bend_first * far_first) +
                       weight_last * (at_last - bend_last * far_last)) /
                      (weight_first + weight_last);
  const double along_side = (bend_last - bend_first) / length;
  const double across = 2 * (far_last * at_first - far_first * at_last) / length;
  SideEstimate out;
  // How far the element, by itself, has turned when it reaches the joint [rad].
  out.turn = static_cast<float>(std::asin(std::clamp(rise / height, -1.0, 1.0)));
  out.curvature =
      static_cast<float>((across + far_first * far_last * along_side) / (height * height));
  out.height = static_cast<float>(height);
  out.known = reaches_beyond(fans, h) || (given_ && !divided_[o]);
  return out;
}

// Whether the opposite corner's fan has elements on its far side: only then its normal knows
// anything of the surface there.
bool CreaseSearch::reaches_beyond(const Fans& fans, int h) const {
  const int o = opposite(h), fan = fans.of(o);
  const Vec3 outward = shell_.along(h).cross(shell_.topology().face_normal[h / 3]);
  const double least = kBeyond * kBeyond * outward.squaredNorm();
  for (const int c : fans[fan])
    for (int k : {corner_after(c), corner_before(c)}) {
      const Vec3 d = point(k) - point(o);
      const double away = -d.dot(outward);
      if (away > 0 && away * away >= least * d.squaredNorm()) return true;
    }
  return false;
}

// Which joints the estimates of their two sides explain, and what that is worth as evidence.
void CreaseSearch::classify_joints() {
  divide_normals();
  const Fans& now = fans();
  const std::size_t count = joints_.size();
  for (auto* list : {&explained_, &alike_, &core_, &smooth_}) list->assign(count, 0);
  off_.assign(count, 0);
  evidence_.assign(count, 0);
  estimates_.resize(count);
  for_each_in_parallel(count, [&](std::size_t e) {
    const Joint& joint = joints_[e];
    if (crease_[e] || joint.angle == 0) return;  // planar: nothing turns
    if (is_settled(e)) {
      smooth_[e] = 1, estimates_[e] = {};
      return;
    }
    const SideEstimate a = estimate_side(now, joint.half_edge[0]),
                       b = estimate_side(now, joint.half_edge[1]);
    estimates_[e] = {a, b};
    // The joint's turn less what both sides account for should be nothing.
    const float most = std::max({std::abs(joint.angle), std::abs(a.turn), std::abs(b.turn)});
    float rest = joint.angle - (a.known ? a.turn : 0) - (b.known ? b.turn : 0);
    // A side of which nothing is known may be anything from flat to as curved as the other.
    const float free = a.known == b.known ? 0
                       : a.known          ? a.curvature * b.height
                                          : b.curvature * a.height;
    rest -= std::clamp(rest, std::min(free, 0.0f), std::max(free, 0.0f));
    off_[e] = std::abs(rest);
    explained_[e] = (a.known || b.known) && off_[e] <= kUneven * most;
    const double ca = std::abs(a.curvature), cb = std::abs(b.curvature);
    alike_[e] = explained_[e] && a.known && b.known && (a.curvature > 0) == (b.curvature > 0) &&
                std::max(ca, cb) <= kAlike * std::min(ca, cb);
    core_[e] = alike_[e] && std::abs(joint.angle) >= most / 2;
    if (!core_[e]) return;
    // The angle that rounded coordinates make.
    const double noise = kRounded * shell_.size() / std::min(a.height, b.height);
    evidence_[e] = static_cast<float>(
        -std::log(std::clamp(kChance * (off_[e] + noise) / most, kLeastProbability, 1.0)));
  });
  weigh_runs();
  // At the end of a run only one side is known.
  for (std::size_t e = 0; e < count; ++e) {
    if (crease_[e] || smooth_[e]) continue;
    smooth_[e] = core_[e];
    if (core_[e] || !explained_[e]) continue;
    const int far = vertex(opposite(joints_[e].half_edge[curved_side(estimates_[e])]));
    smooth_[e] = count_along(far, joints_[e].direction, core_) >= 0.5;
  }
}

// Adds up the evidence along runs of core joints, from joint to joint across the elements between.
void CreaseSearch::weigh_runs() {
  const std::size_t count = joints_.size();
  run_.assign(count, {0, 0});
  std::vector<std::array<float, 2>> next;
  const auto total = [&](std::size_t e) { return evidence_[e] + run_[e][0] + run_[e][1]; };
  const auto middle = [&](std::size_t e) -> Vec3 {
    const Edge& edge = shell_.topology().edges[e];
    return (points()[edge.first_vertex] + points()[edge.last_vertex]) / 2;
  };
  std::vector<int> open;  // joints that do not have enough yet
  open.reserve(count);
  for (std::size_t e = 0; e < count; ++e)
    if (core_[e]) open.push_back(static_cast<int>(e));
  for (int step = 0; step < kLongestRun && !open.empty(); ++step) {
    // Each step carries evidence one joint farther along the run, to either side.
    next.assign(open.size(), {0, 0});
    for (std::size_t n = 0; n < open.size(); ++n) {
      const int e = open[n];
      const Vec3 here = middle(e);
      for (int side = 0; side < 2; ++side) {
        float& most = next[n][side];
        at_vertex(vertex(opposite(joints_[e].half_edge[side])), [&](int other) {
          if (!core_[other]) return;
          // What cannot be the most, whichever way it leads, needs no look.
          const auto [back_run, on_run] = run_[other];
          if (evidence_[other] + std::max(back_run, on_run) <= most) return;
          const float cosine = joints_[e].direction.dot(joints_[other].direction);
          if (cosine * cosine < 0.5) return;
          // The side of the other joint that leads on, away from this one.
          const auto [back, beyond] = joints_[other].half_edge;
          const Vec3 on = point(opposite(beyond)) - point(opposite(back));
          const bool second = on.dot(middle(other) - here) > 0;
          most = std::max(most, evidence_[other] + run_[other][second ? 1 : 0]);
        });
      }
    }
    for (std::size_t n = 0; n < open.size(); ++n) run_[open[n]] = next[n];
    erase_if(open, [&](std::size_t e) { return total(e) >= kEnough; });
  }
  const auto has_independent_normals = [&](std::size_t e) {
    const auto [h, g] = joints_[e].half_edge;
    return given_ && independent_[opposite(h)] && independent_[opposite(g)];
  };
  for (std::size_t e = 0; e < count; ++e)
    core_[e] = core_[e] && (total(e) >= kEnough || has_independent_normals(e));
}

// How many of the joints at a vertex lie along a direction: the sum of their squared cosines.
float CreaseSearch::count_along(int vertex, const Eigen::Vector3f& direction,
                                const std::vector<char>& joints) const {
  float sum = 0;
  at_vertex(vertex, [&](int e) {
    if (!joints[e]) return;
    const float cosine = joints_[e].direction.dot(direction);
    sum += cosine * cosine;
  });
  return sum;
}

}  // namespace sphshell
