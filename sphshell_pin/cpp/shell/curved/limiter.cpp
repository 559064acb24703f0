#include "shell/curved/limiter.hpp"

namespace sphshell {

// A facet holds no turn beyond a side if it is so many times higher than the one beside it.
constexpr double kMuchHigher = 5;
// A side may leave its chord by so many times the sagitta of the turns around: regular triangles
// need 2, irregular ones up to 8.
constexpr double kMostSagittas = 8;
// And by so many times what this share of all sides, by length, account for: a mesher makes its
// errors alike. A surface that fits the vertices around is better evidence, but not along a needle,
// so many times longer than high, of which it sees the ends alone.
constexpr double kMostUsual = 2, kMost = 0.75, kNeedle = 10;

Dominance::Dominance(const Shell& shell, const CoplanarRegions& regions)
    : shell_(shell), regions_(regions), uneven_(shell.topology().edges.size(), 0) {
  const Topology& topology = shell.topology();
  for (std::size_t e = 0; e < uneven_.size(); ++e) {
    const Edge& edge = topology.edges[e];
    if (edge.count != 2 || edge.kind != EdgeClass::Smooth) continue;
    const auto [h, g] = topology.half_edges(edge);
    const double a = regions.height(h), b = regions.height(g);
    // Heights over the common side, of coplanar regions as a whole.
    uneven_[e] = a > kMuchHigher * b || b > kMuchHigher * a;
  }
}

bool Dominance::normal(Span fan, Vec3& normal, double& ratio) const {
  const Topology& topology = shell_.topology();
  if (std::none_of(fan.first, fan.last, [&](int c) {
        return uneven_[topology.edge_of[c]] || uneven_[topology.edge_of[corner_before(c)]];
      }))
    return false;
  // One coplanar region of the fan: how high it stands over what it dominates; what dominates it.
  struct Member {
    int region;
    double height, under;
  };
  struct Pair {
    int here, there;
    double height;
  };
  std::vector<Member> members;
  std::vector<Pair> sides;
  // Fans have few regions: a search in order.
  const auto member = [&](int region) -> Member& {
    for (Member& m : members)
      if (m.region == region) return m;
    members.push_back({region, 0, 0});
    return members.back();
  };
  bool any = false;
  ratio = 0;
  for (const int c : fan)
    for (const int h : {c, corner_before(c)}) {
      const int g = topology.other_half_edge(h);
      if (g < 0) continue;
      const int here = regions_.of(triangle_of(h)), there = regions_.of(triangle_of(g));
      if (here == there || std::none_of(fan.first, fan.last, [&](int d) { return d / 3 == g / 3; }))
        continue;
      const double up = regions_.height(h), down = regions_.height(g);
      ratio = std::max(ratio, up / down);
      if (up > kMuchHigher * down)
        any = true, member(here).height = std::max(member(here).height, up);
      if (down > kMuchHigher * up) member(here).under = std::max(member(here).under, down);
      sides.push_back({here, there, down});
    }
  if (!any) return false;
  // What lies beside a dominated facet, and is as low, is dominated with it.
  for (bool more = true; more;) {
    more = false;
    for (const Pair& side : sides) {
      const double under = member(side.here).under;
      if (!(under > kMuchHigher * side.height) || member(side.there).under >= under) continue;
      member(side.there).under = under;
      more = true;
    }
  }
  double highest = 0;
  for (const Member& m : members)
    if (m.under == 0) highest = std::max(highest, m.height);
  if (!(highest > 0)) return false;
  Vec3 sum = Vec3::Zero();
  for (const int c : fan) {
    const Member& m = member(regions_.of(c / 3));
    // The mean over the highest regions, weighted as any vertex normal.
    if (m.under == 0 && kMuchHigher * m.height >= highest)
      sum += max_weight(shell_, c) * regions_.normal(m.region);
  }
  if (sum.isZero(0)) return false;
  normal = sum.normalized();
  return true;
}

void SagittaWitness::add(const Shell& shell, const Edge& edge) {
  const auto [h, g] = shell.topology().half_edges(edge);
  const int a = regions_.of(triangle_of(h)), b = regions_.of(triangle_of(g));
  if (a == b) return;
  const double turn = std::abs(shell.angle(edge));
  // turn x height / 8: the sagitta of an arc of that turn over that length.
  const auto s = static_cast<float>(turn * std::min(regions_.height(h), regions_.height(g)) / 8);
  sagitta_[a] = std::max(sagitta_[a], s);
  sagitta_[b] = std::max(sagitta_[b], s);
  sides_.push_back({s, static_cast<float>(shell.along(h).norm())});
}

// The weighted quantile by the lengths of the sides: the last one before which no more of them
// lies.
void SagittaWitness::find_usual() {
  double length = 0, below = 0;
  for (const auto& side : sides_) length += side.second;
  auto first = sides_.begin(), last = sides_.end();
  while (last - first > 1) {
    const auto middle = first + (last - first) / 2;
    std::nth_element(first, middle, last);
    double more = below;
    for (auto side = first; side != middle; ++side) more += side->second;
    if (more > kMost * length)
      last = middle;
    else
      first = middle, below = more;
  }
  if (first != last) usual_ = first->first;
  std::vector<std::pair<float, float>>().swap(sides_);
}

// A side of a smooth surface by the lesser witness of its two regions, a border or crease by the
// larger one.
double SagittaWitness::most(const Shell& shell, const Edge& edge, bool smooth, bool fitted) const {
  double least = std::numeric_limits<double>::infinity(), lowest = least, most = 0;
  for (const int h : shell.topology().around(edge)) {
    const double s = sagitta_[regions_.of(triangle_of(h))];
    least = std::min(least, s), most = std::max(most, s);
    lowest = std::min(lowest, regions_.height(h));
  }
  const double local = kMostSagittas * (smooth ? least : most);
  const double length = shell.along(shell.topology().incidence[edge.begin]).norm();
  return fitted && length <= kNeedle * lowest ? local : std::min(local, kMostUsual * usual_);
}

}  // namespace sphshell
