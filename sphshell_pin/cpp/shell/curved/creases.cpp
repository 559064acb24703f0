#include <Eigen/Dense>

#include "shell/curved/crease_search.hpp"

namespace sphshell {

// A wall ends in a fillet where its element bends by less than this share of the fillet's, and is
// longer by this factor.
constexpr double kWall = 0.1, kLongWall = 2.5;
// A crease goes on along a joint in the same direction (cosine) that turns alike (factor).
constexpr float kOnward = 0.85f, kSameTurn = 1.3f;
constexpr int kMostRounds = 40;

// Directions, turning angles and half-edges of all edges, and the edges at each vertex.
void CreaseSearch::list_joints() {
  const Topology& topology = shell_.topology();
  const std::size_t count = topology.edges.size();
  joints_.resize(count);
  edge_at_.resize(topology.neighbors.size());
  std::vector<int> fill(topology.neighbor_begin.begin(), topology.neighbor_begin.end() - 1);
  for (std::size_t e = 0; e < count; ++e) {
    const Edge& edge = topology.edges[e];
    edge_at_[fill[edge.first_vertex]++] = static_cast<int>(e);
    edge_at_[fill[edge.last_vertex]++] = static_cast<int>(e);
    Joint& joint = joints_[e];
    joint.direction =
        (points()[edge.last_vertex] - points()[edge.first_vertex]).normalized().cast<float>();
    joint.angle = static_cast<float>(shell_.angle(edge));
    joint.half_edge[0] = joint.half_edge[1] = -1;
    if (edge.count != 2 || edge.on_rim()) continue;
    std::tie(joint.half_edge[0], joint.half_edge[1]) = topology.half_edges(edge);
  }
}

// The fans that the normals come with, and the edges that are creases at any rate.
void CreaseSearch::start() {
  const Topology& topology = shell_.topology();
  crease_.assign(joints_.size(), 1);
  const auto differ = [&](int i, int j) {
    return (original_[i] - original_[j]).squaredNorm() > kSameNormal * kSameNormal;
  };
  for (std::size_t e = 0; e < joints_.size(); ++e) {
    if (!joints_[e].exists()) continue;
    const auto [h, g] = joints_[e].half_edge;
    // Given normals tell by themselves where they differ; settled joints likewise; else the angle
    // decides.
    crease_[e] = given_ ? differ(h, corner_after(g)) && differ(corner_after(h), g)
                 : is_settled(e)
                     ? differ(h, corner_after(g)) || differ(corner_after(h), g)
                     : !topology.edges[e].inner && topology.edges[e].kind != EdgeClass::Smooth;
  }
  const Fans& before = fans();
  original_count_.resize(original_.size());
  for (std::size_t c = 0; c < original_.size(); ++c)
    original_count_[c] = before.count(before.of(static_cast<int>(c)));
  if (!given_) return;
  independent_ = independent_normals(shell_, before, original_);
  // Averaged normals of a cube are those of a sphere: only the angle can tell. Where it is moderate
  // the normals stand, unless they were averaged over a sharper edge beside it.
  const auto sharpen = [&](double angle, auto&& also) {
    bool any = false;
    for (std::size_t e = 0; e < joints_.size(); ++e)
      if (!crease_[e] && !is_settled(e) && std::abs(joints_[e].angle) >= angle && also(joints_[e]))
        crease_[e] = any = true;
    if (any) forget_fans();
    return any;
  };
  bool any =
      sharpen(std::max(kSurelySharp, shell_.crease_angle()), [](const Joint&) { return true; });
  // A sharper edge beside it divides a fan, whose mean normal was wrong: then the crease angle
  // itself is the limit there, and so on along the surface.
  while (any) {
    const Fans& now = fans();
    any = sharpen(shell_.crease_angle(), [&](const Joint& joint) {
      const auto whole = [&](int c) { return now.count(now.of(c)) == original_count_[c]; };
      const int h = joint.half_edge[0];
      return !whole(h) || !whole(corner_after(h));
    });
  }
}

const Fans& CreaseSearch::fans() {
  if (!fans_)
    fans_.emplace(shell_, [&](const Edge& edge) {
      return !crease_[static_cast<std::size_t>(&edge - shell_.topology().edges.data())];
    });
  return *fans_;
}

// Fans that were divided have the normal of their own elements, and so have open fans beside them,
// whose normals were fitted across what is a crease now.
void CreaseSearch::divide_normals() {
  const Fans& fans = this->fans();
  if (!divided_.empty()) return;
  divided_.assign(original_.size(), 0);
  const int corners = static_cast<int>(original_.size());
  for (int c = 0; c < corners; ++c) divided_[c] = fans.count(fans.of(c)) < original_count_[c];
  std::vector<char> beside(fans.size(), 0);
  if (!given_) {
    for (int c = 0; c < corners; ++c)
      if (divided_[c])
        for (int k : {corner_after(c), corner_before(c)}) beside[fans.of(k)] = !divided_[k];
    // A closed fan has as many joints as corners.
    std::vector<int> joints(fans.size(), 0);
    for (std::size_t e = 0; e < joints_.size(); ++e) {
      if (crease_[e] || !joints_[e].exists()) continue;
      const int h = joints_[e].half_edge[0];
      ++joints[fans.of(h)], ++joints[fans.of(corner_after(h))];
    }
    for (int f = 0; f < fans.size(); ++f) beside[f] = beside[f] && joints[f] < fans.count(f);
  }
  for (int f = 0; f < fans.size(); ++f) {
    if (!(divided_[*fans[f].first] || beside[f]) || has_known(fans[f])) continue;
    const Vec3 normal = max_normal(shell_, fans[f]);
    if (divided_normals_.empty()) divided_normals_ = original_;
    for (const int c : fans[f]) divided_normals_[c] = normal;
  }
}

// The joints of one line are classified together: a crease that ended inside a fan would not
// divide it.
template <class May>
void CreaseSearch::extend_lines(std::vector<int> ends, May&& may) {
  const auto& edges = shell_.topology().edges;
  while (!ends.empty()) {
    const int e = ends.back();
    ends.pop_back();
    for (int end : {edges[e].first_vertex, edges[e].last_vertex}) {
      const float sign = end == edges[e].last_vertex ? 1 : -1;
      const Eigen::Vector3f onward = sign * joints_[e].direction;
      int next = -1;
      float straightest = kOnward;
      at_vertex(end, [&](int other) {
        // Of the angle between going on along the line and the other joint, seen from the common
        // vertex.
        const float cosine = (edges[other].first_vertex == end ? 1.0f : -1.0f) *
                             onward.dot(joints_[other].direction);
        if (other == e || cosine < straightest) return;
        straightest = cosine;
        next = other;
      });
      if (next < 0 || crease_[next] || !may(next)) continue;
      const float here = joints_[e].angle, there = joints_[next].angle;
      if (here * there <= 0 || std::abs(here) > kSameTurn * std::abs(there) ||
          std::abs(there) > kSameTurn * std::abs(here))
        continue;
      crease_[next] = 1;
      ends.push_back(next);
    }
  }
}

// What is not smooth becomes a crease, unless its elements would bulge there by less than those
// around do: the worst first, since it spoils the estimates beside it. False where nothing is
// left.
bool CreaseSearch::add_creases() {
  const std::size_t count = joints_.size();
  const auto vertices_of = [&](std::size_t e) {
    const auto [h, g] = joints_[e].half_edge;
    return std::array<int, 4>{vertex(h), vertex(corner_after(h)), vertex(opposite(h)),
                              vertex(opposite(g))};
  };
  // The larger of the two estimates' heights over the joint.
  const auto height = [&](std::size_t e) {
    return double(std::max(estimates_[e][0].height, estimates_[e][1].height));
  };
  std::vector<double> around(points().size(), 0);
  const auto raise_around = [&](std::size_t e, double value) {
    for (int v : vertices_of(e)) around[v] = std::max(around[v], value);
  };
  const auto largest = [&](std::size_t e) {
    double most = 0;
    for (int v : vertices_of(e)) most = std::max(most, around[v]);
    return most;
  };
  for (std::size_t e = 0; e < count; ++e)
    if (smooth_[e]) raise_around(e, std::abs(joints_[e].angle) * height(e));
  // A side bulges by an eighth of its turn times its length: nothing that is less than the rounding
  // of the coordinates needs a crease.
  const double least = 8 * kRounded * shell_.size();
  std::vector<std::pair<std::size_t, double>> doubtful;
  for (std::size_t e = 0; e < count; ++e) {
    const float angle = std::abs(joints_[e].angle);
    if (crease_[e] || smooth_[e] || angle == 0) continue;
    // A crease can mend no more than the joint's own turn.
    const double harm = (explained_[e] ? angle : std::min(off_[e], angle)) * height(e);
    if (harm > least && harm > largest(e)) doubtful.push_back({e, harm});
  }
  if (doubtful.empty()) return false;
  // A second pass among the doubtful ones: only the worst of a neighborhood are divided in this
  // round.
  std::fill(around.begin(), around.end(), 0.0);
  for (const auto& [e, harm] : doubtful) raise_around(e, harm);
  std::vector<int> added;
  for (const auto& [e, harm] : doubtful)
    // Ties within a factor of two go together.
    if (harm >= largest(e) / 2) added.push_back(static_cast<int>(e));
  for (int e : added) crease_[e] = 1;
  extend_lines(std::move(added), [&](int e) { return !smooth_[e]; });
  forget_fans();
  return true;
}

// Where a wall ends in a fillet each takes its own normal: they agree, and the wall stays straight.
void CreaseSearch::separate_straight_walls() {
  std::vector<int> added;
  for (std::size_t e = 0; e < joints_.size(); ++e) {
    if (crease_[e] || !smooth_[e] || core_[e] || alike_[e]) continue;
    const int side = curved_side(estimates_[e]);
    const SideEstimate &curved = estimates_[e][side], &wall = estimates_[e][1 - side];
    // The curvature that is left for the wall, if the fillet takes its own turn.
    const double left = 2 * std::abs(joints_[e].angle - curved.turn) / wall.height;
    if (wall.height > kLongWall * curved.height && left <= kWall * std::abs(curved.curvature))
      added.push_back(static_cast<int>(e));
  }
  if (added.empty()) return;
  for (int e : added) crease_[e] = 1;
  extend_lines(std::move(added), [&](int e) { return explained_[e] && !alike_[e]; });
  forget_fans();
}

// Divided fans lean along each side that leads across smooth joints as the side's other end does;
// else as their own elements.
void CreaseSearch::lean_as_other_ends(const Fans& fans) {
  std::vector<std::pair<int, Vec3>> found;  // first all, as they are estimated from each other
  for (int f = 0; f < fans.size(); ++f) {
    if (!divided_[*fans[f].first] || has_known(fans[f])) continue;
    constexpr double kTrust = 0.01;  // in the fan's own elements
    const Vec3& own = normals()[*fans[f].first];
    // Least squares: perpendicular to what the sides' tangents would be, each mirrored from its
    // other end, and near the own normal.
    Eigen::Matrix3d square = kTrust * Eigen::Matrix3d::Identity();
    Vec3 along = kTrust * own;
    double before = 0;
    for (const int c : fans[f]) {
      before = std::max(before, (original_[c] - own).norm());
      for (int w : {corner_after(c), corner_before(c)}) {
        if (divided_[w]) continue;
        const Vec3 d = (point(w) - point(c)).normalized();
        square += d * d.transpose();
        along -= d * normals()[w].dot(d);
      }
    }
    const Vec3 normal = square.ldlt().solve(along).normalized();
    // No farther from its elements' than before it was divided.
    if ((normal - own).norm() <= 1.5 * before) found.push_back({f, normal});
  }
  for (const auto& [f, normal] : found)
    for (const int c : fans[f]) divided_normals_[c] = normal;
}

// Classification depends on the estimates, which change as fans are divided: repeated until nothing
// changes.
CornerNormals CreaseSearch::divide() {
  const auto before = std::count(crease_.begin(), crease_.end(), 1);
  for (int round = 0; round < kMostRounds; ++round) {
    classify_joints();
    if (!add_creases()) break;
  }
  if (!given_) separate_straight_walls();
  // Building takes the most memory here.
  LargeArray<std::array<SideEstimate, 2>>().swap(estimates_);
  std::vector<std::array<float, 2>>().swap(run_);
  divide_normals();
  lean_as_other_ends(fans());
  CornerNormals out;
  out.creases = static_cast<int>(std::count(crease_.begin(), crease_.end(), 1) - before);
  out.normals = std::move(divided_normals_.empty() ? original_ : divided_normals_);
  out.set_aside = std::move(divided_);
  return out;
}

CornerNormals divide_at_creases(const Shell& shell, std::vector<Vec3> normals, bool given,
                                const Faces& faces) {
  return CreaseSearch(shell, std::move(normals), given, faces).divide();
}

}  // namespace sphshell
