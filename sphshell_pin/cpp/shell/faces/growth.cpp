// Regions of triangles that a primitive explains.
#include <algorithm>
#include <array>
#include <cmath>
#include <queue>
#include <utility>

#include "shell/faces/recognizer.hpp"

namespace sphshell {
namespace {

// A facet leans [rad] from the primitive's normals at its corners by no more than this; slivers
// that are absorbed later by more, since their own normals are noise.
constexpr double kMostLeanOnFace = 0.7, kMostLeanOfSlivers = 1.1;
// A curved side comes within this share of the flat side's distance.
constexpr double kMostOfFlat = 0.3;
// Nearer to the axis than this share of its middle, a corner is the tip of a cone.
constexpr double kTip = 1e-3;
constexpr double kMostMeanLean = 0.314;  // [rad], 18 degrees: the median over a face
// More points do not make a fit better than rounding.
constexpr std::size_t kMostFitted = 300;
constexpr int kMostRefits = 8, kMostSweeps = 40;
// Coplanar triangles of so many vertices are a face of their own, unless they are a band.
constexpr int kFewOfBand = 3;
constexpr std::size_t kVerticesOfPlane = 5;

// The normals of a shape at the corners of a facet. At the tip of a cone, where it has none, each
// facet takes that of its own middle.
std::array<Vec3, 3> normals_at(const Primitive& shape, const std::array<Vec3, 3>& corners) {
  std::array<Vec3, 3> out;
  for (int k = 0; k < 3; ++k) shape.distance(corners[k], out[k]);
  if (shape.kind != FaceKind::Cone) return out;
  const Vec3 centroid = (corners[0] + corners[1] + corners[2]) / 3;
  const auto off_axis = [&](const Vec3& x) { return (x - shape.point).cross(shape.axis).norm(); };
  for (int k = 0; k < 3; ++k)
    if (off_axis(corners[k]) < kTip * off_axis(centroid)) shape.distance(centroid, out[k]);
  return out;
}

}  // namespace

Vec3 Faces::normal(const Shell& shell, int t, int k) const {
  const Triangle& c = shell.triangles()[t];
  const std::vector<Vec3>& p = shell.vertices();
  // On the side of the facet's own normal.
  const Vec3 n = normals_at(shapes[of[t]], {p[c[0]], p[c[1]], p[c[2]]})[k];
  return n.dot(shell.topology().face_normal[t]) < 0 ? Vec3(-n) : n;
}

// Triangles around the seed until they have so many vertices: ring by ring, what turns most first,
// or over the longest sides first, which lead along a strip.
std::vector<int> Recognizer::patch(int seed, std::size_t vertices, bool along) {
  std::vector<int> out, seen;
  using Entry = std::pair<double, int>;
  std::priority_queue<Entry> open;
  open.push({0, seed});
  mark({seed});
  // A heap by priority: the next triangle is the largest.
  const auto add_vertices = [&](int t) {
    for (int v : corners(t))
      if (std::find(seen.begin(), seen.end(), v) == seen.end()) seen.push_back(v);
  };
  int ring = 0;
  while (!open.empty() && seen.size() < vertices && out.size() < 2 * vertices) {
    const int t = open.top().second;
    open.pop();
    out.push_back(t);
    add_vertices(t);
    ++ring;
    for (int k = 0; k < 3; ++k) {
      const int u = beside_[3 * t + k];
      if (u < 0 || is_marked(u) || of_[u] >= 0 || !curved_[u]) continue;
      mark_[u] = round_;
      const double side = (point(corners(t)[next_corner(k)]) - point(corners(t)[k])).norm();
      open.push({along ? side : -double(ring) + 0.1 * turn_[u], u});
    }
  }
  return out;
}

// The largest angle [rad] between a facet and the shape's normals at its corners.
double Recognizer::lean(int t, const Primitive& shape) const {
  double least = 1;
  const Triangle& c = corners(t);
  for (const Vec3& n : normals_at(shape, {point(c[0]), point(c[1]), point(c[2])}))
    least = std::min(least, std::abs(n.dot(facet_normal(t))));
  return std::acos(std::min(least, 1.0));
}

// Whether a triangle lies on the primitive: its vertices, its normal, and the cubic sides through
// the primitive's normals. What is checked is what is used: a primitive that passes and is wrong
// can do bounded harm only.
Recognizer::Explained Recognizer::explain(int t, const Primitive& shape, double tolerance,
                                          double most_lean) const {
  Explained out{false, 0, 0};
  const Triangle& c = corners(t);
  for (int v : c)
    if (!(std::abs(shape.distance(point(v))) <= tolerance)) return out;
  const std::array<Vec3, 3> normals = normals_at(shape, {point(c[0]), point(c[1]), point(c[2])});
  double sum = 0;
  for (const Vec3& n : normals) sum += n.dot(facet_normal(t));
  out.sign = sum < 0 ? -1 : 1;
  const double least = std::cos(most_lean);
  for (const Vec3& n : normals)
    if (!(out.sign * n.dot(facet_normal(t)) > least)) return out;
  double curved = 0;
  for (int k = 0; k < 3; ++k) {
    const int l = next_corner(k);
    const Vec3 d = point(c[l]) - point(c[k]), middle = (point(c[k]) + point(c[l])) / 2;
    // What the cubic side through these normals would add to the middle of the chord: an eighth of
    // the difference of the slopes.
    const Vec3 rise = (d.dot(normals[l]) * normals[l] - d.dot(normals[k]) * normals[k]) / 8;
    out.deviation = std::max(out.deviation, std::abs(shape.distance(middle)));
    curved = std::max(curved, std::abs(shape.distance(middle + rise)));
  }
  out.explained = curved <= kMostOfFlat * out.deviation + 1.5 * tolerance;
  return out;
}

// Flood fill over the neighbors that the shape explains, all on one side of it.
Growth Recognizer::grow(int seed, const Primitive& shape, double tolerance) {
  Growth out{shape, {}, 0, 0, tolerance};
  mark({seed});
  std::vector<int>& found = out.triangles;
  std::vector<int> open{seed};
  while (!open.empty()) {
    const int t = open.back();
    open.pop_back();
    ++visits_;
    if (inscribed_[regions_.of(t)] == Inscribed::Belt && shape.kind >= FaceKind::Sphere) continue;
    const Explained one = explain(t, shape, tolerance, kMostLeanOnFace);
    if (!one.explained || (out.sign != 0 && one.sign != out.sign)) continue;
    out.sign = one.sign;
    out.deviation = std::max(out.deviation, one.deviation);
    found.push_back(t);
    for (int k = 0; k < 3; ++k) {
      const int u = beside_[3 * t + k];
      if (u < 0 || is_marked(u)) continue;
      mark_[u] = round_;
      open.push_back(u);
    }
  }
  return out;
}

// Evenly taken where there are too many.
bool Recognizer::refit(Growth& growth) const {
  const std::vector<int> vertices = vertices_of(growth.triangles);
  std::vector<Vec3> points;
  const std::size_t n = vertices.size(), take = std::min(n, kMostFitted);
  for (std::size_t i = 0; i < take; ++i) points.push_back(point(vertices[i * n / take]));
  return fit_primitive(points, wide_, growth.shape);
}

// All vertices of a region say better what it is than those of a patch: it grows in rounds.
Growth Recognizer::grow_and_refit(int seed, const Primitive& shape) {
  Growth out = grow(seed, shape, 2 * tolerance_);
  for (int round = 0; round < kMostRefits && out.triangles.size() > 2; ++round) {
    Growth next = out;
    if (!refit(next)) break;
    next = grow(seed, next.shape, wide_);
    if (next.triangles.size() < out.triangles.size()) break;
    const bool done = next.triangles.size() == out.triangles.size();
    out = std::move(next);
    if (done) break;
  }
  return out;
}

// Flats on a shaft or a ball are inscribed in it as well: coplanar triangles that are no band
// between two rulings, and facets that lean or stand off far more than the others do.
void Recognizer::leave_own_faces_out(Growth& growth) {
  std::vector<int>& all = growth.triangles;
  if (all.empty()) return;
  std::vector<double> leans, off;
  for (const int t : all) {
    leans.push_back(lean(t, growth.shape));
    off.push_back(explain(t, growth.shape, growth.window, kMostLeanOnFace).deviation);
  }
  if (quantile(leans, 0.5) > kMostMeanLean) {
    all.clear();
    return;
  }
  // 0.009 rad is half a degree.
  const double most_lean = 2 * quantile(leans, 0.75) + 0.009, most_off = 5 * quantile(off, 0.75);
  std::vector<std::pair<int, int>> by_region;  // region, place in `all`
  for (std::size_t i = 0; i < all.size(); ++i)
    if (regions_.count(regions_.of(all[i])) >= kFewOfBand)
      by_region.push_back({regions_.of(all[i]), static_cast<int>(i)});
  std::sort(by_region.begin(), by_region.end());
  std::vector<char> keep(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    keep[i] = leans[i] <= most_lean && off[i] <= most_off;
    if (!keep[i]) growth.left_out.push_back(all[i]);
  }
  for (std::size_t i = 0, j; i < by_region.size(); i = j) {
    std::vector<int> members;
    for (j = i; j < by_region.size() && by_region[j].first == by_region[i].first; ++j)
      members.push_back(all[by_region[j].second]);
    const std::vector<int> vertices = vertices_of(members);
    if (vertices.size() < kVerticesOfPlane) continue;
    bool band = false;
    const Primitive& s = growth.shape;
    if (s.kind != FaceKind::Sphere) {
      // A band lies between two rulings; on a torus between two circles about the axis, as a whole.
      std::vector<double> where;
      const Vec3 u = s.axis.unitOrthogonal(), v = s.axis.cross(u);
      for (const int vertex : vertices) {
        const Vec3 y = point(vertex) - s.point;
        const double a = y.dot(u), b = y.dot(v);
        if (s.kind == FaceKind::Torus)
          where.push_back(std::hypot(a, b) / s.second * 10);
        else if (std::hypot(a, b) > 1e-3 * s.radius)
          where.push_back(std::atan2(b, a));
      }
      std::sort(where.begin(), where.end());
      int count = 1;
      // The number of distinct rulings: neighbors differ by more than 1e-3 rad.
      for (std::size_t n = 1; n < where.size(); ++n) count += where[n] - where[n - 1] > 1e-3;
      // Rulings on both sides of the cut at pi.
      if (s.kind != FaceKind::Torus && where.size() > 1 &&
          where.back() - where.front() > 2 * M_PI - 1e-3)
        --count;
      band = count <= 2 && (s.kind != FaceKind::Torus ||
                            regions_.count(by_region[i].first) == static_cast<int>(members.size()));
    }
    for (std::size_t n = i; n < j && !band; ++n) keep[by_region[n].second] = 0;
  }
  std::size_t kept = 0;
  growth.deviation = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!keep[i]) continue;
    all[kept++] = all[i];
    growth.deviation = std::max(growth.deviation, off[i]);
  }
  all.resize(kept);
}

// Slivers lean and turn too far, but their vertices lie on the primitive, and their sides stand off
// no more than the others'.
void Recognizer::absorb_slivers(Growth& growth) {
  mark(growth.triangles);
  std::vector<int>& all = growth.triangles;
  const Topology& topology = shell_.topology();
  std::size_t from = 0;
  for (int sweep = 0; sweep < kMostSweeps && from < all.size(); ++sweep) {
    const std::size_t end = all.size();
    for (; from < end; ++from)
      for (int k = 0; k < 3; ++k) {
        const int h = topology.other_half_edge(3 * all[from] + k);
        if (h < 0) continue;
        const int u = triangle_of(h);
        if (is_marked(u) || of_[u] >= 0 || inscribed_[regions_.of(u)] != Inscribed::No ||
            regions_.count(regions_.of(u)) >= kFewOfBand)
          continue;
        const Explained one = explain(u, growth.shape, growth.window, kMostLeanOfSlivers);
        if (!one.explained || one.sign != growth.sign ||
            one.deviation > growth.deviation + growth.window)
          continue;
        mark_[u] = round_;
        all.push_back(u);
      }
  }
}

}  // namespace sphshell
