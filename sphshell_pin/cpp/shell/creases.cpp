#include "shell/creases.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "shell/fans.hpp"

namespace sphshell {
namespace {

// A joint of a curved surface turns by what the elements on its two sides, each by itself, have
// turned when they reach it, but for this share; and its two sides bend alike within this factor.
constexpr double kUneven = 0.3, kAlike = 5;
// Helmholtz's principle (Desolneux, Moisan, Morel, Int. J. Computer Vision 40 (2000) 7): a run of
// joints is a curved surface if joints that have nothing to do with each other would agree as well
// in one of a thousand cases only. One joint agrees to the share s by chance with probability
// kChance * s, and is worth no more than the least probability, so that a run has two at least.
constexpr double kChance = 1.5, kLeastProbability = 0.01, kEnough = 7;  // of -log of the product
constexpr int kLongestRun = 6;                                          // to either side
// Coordinates are known to this share of the box at best: single precision.
constexpr double kRounded = 1.2e-7;
// A fan goes on beyond its corner where a side leads away from the opposite edge by this sine.
constexpr double kBeyond = 0.3;
// Normals closer than this [rad] are one.
constexpr double kSameNormal = 1e-3;
// A given normal is a mean of its elements' if it is nearer to one than this share of what they
// lean.
constexpr double kAveraged = 0.1;
// Where joints turn this much [rad], no normals of a file make one surface of them.
constexpr double kSurelySharp = 1.2;
// A wall ends in a fillet where its element bends by less than this share of the fillet's, and is
// longer by this factor.
constexpr double kWall = 0.1, kLonger = 2.5;
// A crease goes on along a joint in the same direction (cosine) that turns alike (factor).
constexpr double kOnward = 0.85, kSameTurn = 1.3;
constexpr int kMostRounds = 40;

// What an element says by itself about the surface where it reaches one of its sides.
struct Claim {
  float turn;       // from its plane to the side [rad], > 0 convex
  float curvature;  // across the side [1/m]
  float height;     // of the opposite corner over the side [m]
  bool known;       // there are elements beyond the opposite corner to tell
};

struct Joint {
  Vec3 direction;
  int half_edge[2];  // none where < 0: an edge that is no joint of two elements wound alike
  double angle;      // [rad], > 0 convex
  bool exists() const { return half_edge[0] >= 0; }
};

// The side of a joint that bends more, of those that are known.
int curved_side(const std::array<Claim, 2>& claims) {
  const auto& [a, b] = claims;
  return a.known && (!b.known || std::abs(a.curvature) >= std::abs(b.curvature)) ? 0 : 1;
}

class Creases {
 public:
  Creases(const Shell& shell, std::vector<Vec3> normals, bool given)
      : shell_(shell), given_(given), original_(std::move(normals)) {
    list_joints();
    start();
  }

  CornerNormals divide();

 private:
  const std::vector<Vec3>& points() const { return shell_.vertices(); }
  int vertex(int corner) const { return shell_.triangles()[corner / 3][corner % 3]; }
  // The corner opposite a half-edge.
  static int opposite(int h) { return Fans::before(h); }

  void list_joints();
  void find_witnesses(const Fans& fans);
  void start();
  Fans fans() const;
  void normals_of(const Fans& fans);
  Claim claim(const Fans& fans, int h) const;
  bool reaches_beyond(const Fans& fans, int h) const;
  void judge();
  void weigh_runs();
  double held(int vertex, const Vec3& direction, const std::vector<char>& joints) const;
  bool add_creases();
  template <class May>
  void extend_lines(std::vector<int> ends, May&& may);
  bool separate_walls();
  void lean_as_other_ends(const Fans& fans);

  template <class Visit>
  void at_vertex(int vertex, Visit&& visit) const {
    const Topology& topology = shell_.topology();
    for (int i = topology.neighbour_begin[vertex]; i < topology.neighbour_begin[vertex + 1]; ++i)
      visit(edge_at_[i]);
  }

  const Shell& shell_;
  bool given_;
  std::vector<Vec3> original_, normals_;
  std::vector<int> original_count_;  // per corner: of its fan before it was divided
  std::vector<char> divided_;        // per corner
  std::vector<char> witness_;        // per corner: its given normal is no mean of its elements'
  std::vector<Joint> joints_;        // per edge
  std::vector<int> edge_at_;         // beside Topology::neighbours
  std::vector<char> crease_;         // per edge, as all that follows
  std::vector<char> explained_, alike_, core_, smooth_;
  std::vector<double> off_;
  std::vector<float> evidence_, most_;
  std::vector<std::array<float, 2>> run_;  // evidence beyond either side
  std::vector<std::array<Claim, 2>> claims_;
};

void Creases::list_joints() {
  const Topology& topology = shell_.topology();
  const std::size_t count = topology.edges.size();
  joints_.resize(count);
  edge_at_.resize(topology.neighbours.size());
  std::vector<int> fill(topology.neighbour_begin.begin(), topology.neighbour_begin.end() - 1);
  for (std::size_t e = 0; e < count; ++e) {
    const Edge& edge = topology.edges[e];
    edge_at_[fill[edge.first_vertex]++] = static_cast<int>(e);
    edge_at_[fill[edge.last_vertex]++] = static_cast<int>(e);
    Joint& joint = joints_[e];
    joint.direction = (points()[edge.last_vertex] - points()[edge.first_vertex]).normalized();
    joint.angle = topology.angle(shell_.vertices(), shell_.triangles(), edge);
    joint.half_edge[0] = joint.half_edge[1] = -1;
    if (edge.count != 2 || edge.on_rim()) continue;
    joint.half_edge[0] = topology.incidence[edge.begin];
    joint.half_edge[1] = topology.incidence[edge.begin + 1];
  }
}

// The fans that the normals come with, and the edges that are creases at any rate.
void Creases::start() {
  const Topology& topology = shell_.topology();
  crease_.assign(joints_.size(), 1);
  const auto differ = [&](int i, int j) {
    return (original_[i] - original_[j]).squaredNorm() > kSameNormal * kSameNormal;
  };
  for (std::size_t e = 0; e < joints_.size(); ++e) {
    if (!joints_[e].exists()) continue;
    const auto [h, g] = joints_[e].half_edge;
    crease_[e] = given_ ? differ(h, Fans::after(g)) && differ(Fans::after(h), g)
                        : !topology.edges[e].inner && topology.edges[e].kind != EdgeClass::Smooth;
  }
  const Fans before = fans();
  original_count_.resize(original_.size());
  for (std::size_t c = 0; c < original_.size(); ++c)
    original_count_[c] = before.count(before.of(static_cast<int>(c)));
  if (!given_) return;
  find_witnesses(before);
  // Averaged normals of a cube are those of a sphere: only the angle can tell. Where it is moderate
  // the normals stand, unless they were averaged over a sharper edge beside it.
  const auto sharpen = [&](double angle, auto&& also) {
    bool any = false;
    for (std::size_t e = 0; e < joints_.size(); ++e)
      if (!crease_[e] && std::abs(joints_[e].angle) >= angle && also(joints_[e]))
        crease_[e] = any = true;
    return any;
  };
  bool any =
      sharpen(std::max(kSurelySharp, shell_.crease_angle()), [](const Joint&) { return true; });
  while (any) {
    const Fans now = fans();
    any = sharpen(shell_.crease_angle(), [&](const Joint& joint) {
      const auto whole = [&](int c) { return now.count(now.of(c)) == original_count_[c]; };
      const int h = joint.half_edge[0];
      return !whole(h) || !whole(Fans::after(h));
    });
  }
}

// Normals that are no mean of the elements' say something that the elements do not.
void Creases::find_witnesses(const Fans& fans) {
  witness_.assign(original_.size(), 0);
  const std::vector<Vec3>& facet_normal = shell_.topology().face_normal;
  for (int f = 0; f < fans.size(); ++f) {
    if (fans.count(f) == 0) continue;
    const Vec3& normal = original_[*fans.begin(f)];
    Vec3 alike = Vec3::Zero(), by_area = Vec3::Zero(), by_angle = Vec3::Zero();
    double lean = 0;
    for (const int* c = fans.begin(f); c != fans.end(f); ++c) {
      const Vec3& p = points()[vertex(*c)];
      const Vec3 a = points()[vertex(Fans::after(*c))] - p,
                 b = points()[vertex(Fans::before(*c))] - p;
      const Vec3& n = facet_normal[*c / 3];
      const double area = a.cross(b).norm();
      alike += n, by_area += area * n, by_angle += std::atan2(area, a.dot(b)) * n;
      lean = std::max(lean, (normal - n).norm());
    }
    bool is_mean = false;
    for (const Vec3& mean :
         {alike, by_area, by_angle, max_normal(shell_, fans.begin(f), fans.end(f))})
      is_mean = is_mean || (mean.normalized() - normal).norm() <= kAveraged * lean;
    for (const int* c = fans.begin(f); c != fans.end(f); ++c) witness_[*c] = !is_mean;
  }
}

Fans Creases::fans() const {
  return Fans(shell_, [&](const Edge& edge) {
    return !crease_[static_cast<std::size_t>(&edge - shell_.topology().edges.data())];
  });
}

// Fans that were divided have the normal of their own elements, and so have open fans beside them,
// whose normals were fitted across what is a crease now.
void Creases::normals_of(const Fans& fans) {
  normals_ = original_;
  divided_.assign(original_.size(), 0);
  const int corners = static_cast<int>(original_.size());
  for (int c = 0; c < corners; ++c) divided_[c] = fans.count(fans.of(c)) < original_count_[c];
  std::vector<char> beside(original_.size(), 0), joined(original_.size(), 0);  // per fan
  if (!given_) {
    for (int c = 0; c < corners; ++c)
      if (divided_[c])
        for (int k : {Fans::after(c), Fans::before(c)}) beside[fans.of(k)] = !divided_[k];
    // A closed fan has as many joints as corners.
    std::vector<int> joints(original_.size(), 0);
    for (std::size_t e = 0; e < joints_.size(); ++e) {
      if (crease_[e] || !joints_[e].exists()) continue;
      const int h = joints_[e].half_edge[0];
      ++joints[fans.of(h)], ++joints[fans.of(Fans::after(h))];
    }
    for (int f = 0; f < corners; ++f) beside[f] = beside[f] && joints[f] < fans.count(f);
  }
  for (int f = 0; f < fans.size(); ++f) {
    if (fans.count(f) == 0 || !(divided_[*fans.begin(f)] || beside[f])) continue;
    const Vec3 normal = max_normal(shell_, fans.begin(f), fans.end(f));
    for (const int* c = fans.begin(f); c != fans.end(f); ++c) normals_[*c] = normal;
  }
}

// The surface at a side, from the normal at the opposite corner, if each of the two chords from
// there leans alike at both ends: exact where it is quadratic.
Claim Creases::claim(const Fans& fans, int h) const {
  const int i = h, j = Fans::after(h), o = opposite(h);
  const Vec3 &p = points()[vertex(i)], &q = points()[vertex(j)], &r = points()[vertex(o)];
  const Vec3 a = p - r, b = q - r;
  Vec3 along = q - p;
  const double length = along.norm();
  along /= length;
  const double height = a.cross(b).norm() / length;
  const double at_first = -normals_[o].dot(a), at_last = -normals_[o].dot(b);
  const double far_first = a.dot(along), far_last = b.dot(along);
  const double bend_first = normals_[i].dot(along), bend_last = normals_[j].dot(along);
  // The nearer end tells more: the other lies where a cone has become narrower, say.
  const double weight_first = std::sqrt(b.norm()), weight_last = std::sqrt(a.norm());
  const double rise = (weight_first * (at_first - bend_first * far_first) +
                       weight_last * (at_last - bend_last * far_last)) /
                      (weight_first + weight_last);
  const double along_side = (bend_last - bend_first) / length;
  const double across = 2 * (far_last * at_first - far_first * at_last) / length;
  Claim out;
  out.turn = static_cast<float>(std::asin(std::clamp(rise / height, -1.0, 1.0)));
  out.curvature =
      static_cast<float>((across + far_first * far_last * along_side) / (height * height));
  out.height = static_cast<float>(height);
  out.known = reaches_beyond(fans, h) || (given_ && !divided_[o]);
  return out;
}

bool Creases::reaches_beyond(const Fans& fans, int h) const {
  const int o = opposite(h), fan = fans.of(o);
  const Vec3& r = points()[vertex(o)];
  const Vec3 along = points()[vertex(Fans::after(h))] - points()[vertex(h)];
  const Vec3 outward = along.cross(shell_.topology().face_normal[h / 3]);
  const double least = kBeyond * kBeyond * outward.squaredNorm();
  for (const int* c = fans.begin(fan); c != fans.end(fan); ++c)
    for (int k : {Fans::after(*c), Fans::before(*c)}) {
      const Vec3 d = points()[vertex(k)] - r;
      const double away = -d.dot(outward);
      if (away > 0 && away * away >= least * d.squaredNorm()) return true;
    }
  return false;
}

// Which joints the claims of their two sides explain, and what that is worth as evidence.
void Creases::judge() {
  const Fans now = fans();
  normals_of(now);
  const std::size_t count = joints_.size();
  for (auto* list : {&explained_, &alike_, &core_, &smooth_}) list->assign(count, 0);
  off_.assign(count, 0);
  most_.assign(count, 0);
  evidence_.assign(count, 0);
  claims_.resize(count);
  for (std::size_t e = 0; e < count; ++e) {
    const Joint& joint = joints_[e];
    if (crease_[e] || joint.angle == 0) continue;  // planar: nothing turns
    const Claim a = claim(now, joint.half_edge[0]), b = claim(now, joint.half_edge[1]);
    claims_[e] = {a, b};
    const double most =
        std::max({std::abs(joint.angle), double(std::abs(a.turn)), double(std::abs(b.turn))});
    double rest = joint.angle - (a.known ? a.turn : 0) - (b.known ? b.turn : 0);
    // A side of which nothing is known may be anything from flat to as curved as the other.
    const double free = a.known == b.known ? 0
                        : a.known          ? a.curvature * b.height
                                           : b.curvature * a.height;
    rest -= std::clamp(rest, std::min(free, 0.0), std::max(free, 0.0));
    off_[e] = std::abs(rest);
    most_[e] = static_cast<float>(most);
    explained_[e] = (a.known || b.known) && off_[e] <= kUneven * most;
    const double ca = std::abs(a.curvature), cb = std::abs(b.curvature);
    alike_[e] = explained_[e] && a.known && b.known && a.curvature * b.curvature > 0 &&
                std::max(ca, cb) <= kAlike * std::min(ca, cb);
    core_[e] = alike_[e] && std::abs(joint.angle) >= most / 2;
    if (!core_[e]) continue;
    const double noise = kRounded * shell_.size() / std::min(a.height, b.height);
    evidence_[e] = static_cast<float>(
        -std::log(std::clamp(kChance * (off_[e] + noise) / most, kLeastProbability, 1.0)));
  }
  weigh_runs();
  // At the end of a run one side alone tells.
  for (std::size_t e = 0; e < count; ++e) {
    if (crease_[e]) continue;
    smooth_[e] = core_[e];
    if (core_[e] || !explained_[e]) continue;
    const int far = vertex(opposite(joints_[e].half_edge[curved_side(claims_[e])]));
    smooth_[e] = held(far, joints_[e].direction, core_) >= 0.5;
  }
}

// Adds up the evidence along runs of core joints, from joint to joint across the elements between.
void Creases::weigh_runs() {
  const std::size_t count = joints_.size();
  run_.assign(count, {0, 0});
  std::vector<std::array<float, 2>> next;
  const auto total = [&](std::size_t e) { return evidence_[e] + run_[e][0] + run_[e][1]; };
  const auto middle = [&](std::size_t e) -> Vec3 {
    const Edge& edge = shell_.topology().edges[e];
    return (points()[edge.first_vertex] + points()[edge.last_vertex]) / 2;
  };
  std::vector<std::size_t> open;  // joints that do not have enough yet
  for (std::size_t e = 0; e < count; ++e)
    if (core_[e]) open.push_back(e);
  for (int step = 0; step < kLongestRun && !open.empty(); ++step) {
    next.assign(open.size(), {0, 0});
    for (std::size_t n = 0; n < open.size(); ++n) {
      const std::size_t e = open[n];
      const Vec3 here = middle(e);
      for (int side = 0; side < 2; ++side) {
        float& most = next[n][side];
        at_vertex(vertex(opposite(joints_[e].half_edge[side])), [&](int other) {
          if (!core_[other]) return;
          const double cosine = joints_[e].direction.dot(joints_[other].direction);
          if (cosine * cosine < 0.5) return;
          // The side of the other joint that leads on, away from this one.
          const int beyond = vertex(opposite(joints_[other].half_edge[1]));
          const int back = vertex(opposite(joints_[other].half_edge[0]));
          const bool second = (points()[beyond] - points()[back]).dot(middle(other) - here) > 0;
          most = std::max(most, evidence_[other] + run_[other][second ? 1 : 0]);
        });
      }
    }
    for (std::size_t n = 0; n < open.size(); ++n) run_[open[n]] = next[n];
    open.erase(std::remove_if(open.begin(), open.end(),
                              [&](std::size_t e) { return total(e) >= kEnough; }),
               open.end());
  }
  const auto is_borne_out = [&](std::size_t e) {
    const auto [h, g] = joints_[e].half_edge;
    return given_ && witness_[opposite(h)] && witness_[opposite(g)];
  };
  for (std::size_t e = 0; e < count; ++e)
    core_[e] = core_[e] && (total(e) >= kEnough || is_borne_out(e));
}

// How many of the joints at a vertex lie along a direction: the sum of their squared cosines.
double Creases::held(int vertex, const Vec3& direction, const std::vector<char>& joints) const {
  double sum = 0;
  at_vertex(vertex, [&](int e) {
    if (!joints[e]) return;
    const double cosine = joints_[e].direction.dot(direction);
    sum += cosine * cosine;
  });
  return sum;
}

// The joints of one line are decided about together: a crease that ended inside a fan would not
// divide it.
template <class May>
void Creases::extend_lines(std::vector<int> ends, May&& may) {
  const auto& edges = shell_.topology().edges;
  while (!ends.empty()) {
    const int e = ends.back();
    ends.pop_back();
    for (int end : {edges[e].first_vertex, edges[e].last_vertex}) {
      const Vec3 onward =
          end == edges[e].last_vertex ? joints_[e].direction : Vec3(-joints_[e].direction);
      int next = -1;
      double straightest = kOnward;
      at_vertex(end, [&](int other) {
        const Vec3& d = joints_[other].direction;
        const double cosine = onward.dot(edges[other].first_vertex == end ? d : Vec3(-d));
        if (other == e || cosine < straightest) return;
        straightest = cosine;
        next = other;
      });
      if (next < 0 || crease_[next] || !may(next)) continue;
      const double here = joints_[e].angle, there = joints_[next].angle;
      if (here * there <= 0 || std::abs(here) > kSameTurn * std::abs(there) ||
          std::abs(there) > kSameTurn * std::abs(here))
        continue;
      crease_[next] = 1;
      ends.push_back(next);
    }
  }
}

// What is not smooth becomes a crease, unless its elements would bulge there by less than those
// around do: the worst first, since it spoils what its neighbours claim. False where nothing is
// left.
bool Creases::add_creases() {
  const std::size_t count = joints_.size();
  const auto vertices_of = [&](std::size_t e) {
    const auto [h, g] = joints_[e].half_edge;
    return std::array<int, 4>{vertex(h), vertex(Fans::after(h)), vertex(opposite(h)),
                              vertex(opposite(g))};
  };
  const auto height = [&](std::size_t e) {
    return double(std::max(claims_[e][0].height, claims_[e][1].height));
  };
  std::vector<double> around(points().size(), 0);
  const auto spread = [&](std::size_t e, double value) {
    for (int v : vertices_of(e)) around[v] = std::max(around[v], value);
  };
  const auto largest = [&](std::size_t e) {
    double most = 0;
    for (int v : vertices_of(e)) most = std::max(most, around[v]);
    return most;
  };
  for (std::size_t e = 0; e < count; ++e)
    if (smooth_[e]) spread(e, std::abs(joints_[e].angle) * height(e));
  std::vector<std::pair<std::size_t, double>> doubtful;
  for (std::size_t e = 0; e < count; ++e) {
    const double angle = std::abs(joints_[e].angle);
    if (crease_[e] || smooth_[e] || angle == 0) continue;
    // A crease can mend no more than the joint's own turn.
    const double harm = (explained_[e] ? angle : std::min(off_[e], angle)) * height(e);
    if (harm > largest(e)) doubtful.push_back({e, harm});
  }
  if (doubtful.empty()) return false;
  std::fill(around.begin(), around.end(), 0.0);
  for (const auto& [e, harm] : doubtful) spread(e, harm);
  std::vector<int> added;
  for (const auto& [e, harm] : doubtful)
    if (harm >= largest(e) / 2) added.push_back(static_cast<int>(e));
  for (int e : added) crease_[e] = 1;
  extend_lines(std::move(added), [&](int e) { return !smooth_[e]; });
  return true;
}

// Where a wall ends in a fillet each takes its own normal: they agree, and the wall stays straight.
bool Creases::separate_walls() {
  std::vector<int> added;
  for (std::size_t e = 0; e < joints_.size(); ++e) {
    if (crease_[e] || !smooth_[e] || core_[e] || alike_[e]) continue;
    const int side = curved_side(claims_[e]);
    const Claim &curved = claims_[e][side], &wall = claims_[e][1 - side];
    const double left = 2 * std::abs(joints_[e].angle - curved.turn) / wall.height;
    if (wall.height > kLonger * curved.height && left <= kWall * std::abs(curved.curvature))
      added.push_back(static_cast<int>(e));
  }
  for (int e : added) crease_[e] = 1;
  if (added.empty()) return false;
  extend_lines(std::move(added), [&](int e) { return explained_[e] && !alike_[e]; });
  return true;
}

// Divided fans lean along each side that leads across smooth joints as the side's other end does;
// else as their own elements.
void Creases::lean_as_other_ends(const Fans& fans) {
  const std::vector<Vec3> plain = normals_;
  for (int f = 0; f < fans.size(); ++f) {
    if (fans.count(f) == 0 || !divided_[*fans.begin(f)]) continue;
    constexpr double kTrust = 0.01;  // in the fan's own elements
    const Vec3& own = plain[*fans.begin(f)];
    Eigen::Matrix3d square = kTrust * Eigen::Matrix3d::Identity();
    Vec3 along = kTrust * own;
    double before = 0;
    for (const int* c = fans.begin(f); c != fans.end(f); ++c) {
      before = std::max(before, (original_[*c] - own).norm());
      for (int w : {Fans::after(*c), Fans::before(*c)}) {
        if (divided_[w]) continue;
        const Vec3 d = (points()[vertex(w)] - points()[vertex(*c)]).normalized();
        square += d * d.transpose();
        along -= d * plain[w].dot(d);
      }
    }
    const Vec3 normal = square.ldlt().solve(along).normalized();
    // No farther from its elements' than before it was divided.
    if (!((normal - own).norm() <= 1.5 * before)) continue;
    for (const int* c = fans.begin(f); c != fans.end(f); ++c) normals_[*c] = normal;
  }
}

CornerNormals Creases::divide() {
  const auto before = std::count(crease_.begin(), crease_.end(), 1);
  for (int round = 0; round < kMostRounds; ++round) {
    judge();
    if (!add_creases()) break;
  }
  if (!given_) separate_walls();
  const Fans now = fans();
  normals_of(now);
  lean_as_other_ends(now);
  CornerNormals out;
  out.creases = static_cast<int>(std::count(crease_.begin(), crease_.end(), 1) - before);
  out.normals = std::move(normals_);
  out.set_aside = std::move(divided_);
  return out;
}

}  // namespace

CornerNormals divide_at_creases(const Shell& shell, std::vector<Vec3> normals, bool given) {
  return Creases(shell, std::move(normals), given).divide();
}

}  // namespace sphshell
