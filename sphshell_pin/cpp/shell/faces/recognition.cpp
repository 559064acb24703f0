#include "shell/faces/recognition.hpp"

#include "shell/faces/recognizer.hpp"

namespace sphshell {

// Where nothing has been found from so many seeds, nothing is looked for any longer; and so many
// triangles per seed more. Nor where more seeds than these have failed in all than triangles were
// found: a free shape has strips here and there that look like cones.
constexpr std::size_t kPatience = 60, kTrianglesPerSeed = 3000;
// Growths that lead to nothing look at so many triangles in all, and at so many times those that
// there are: else seeds on a large free shape cost the square of its size.
constexpr std::size_t kFewVisits = 300'000, kMostVisits = 4;
// A plane is so many times wider across a smooth side than what goes on beyond it there, if that
// was not recognized; one of fewer triangles more.
constexpr int kFewOfPlane = 4;
constexpr double kFarther = 3, kFarLarger = 6;
// Or it turns there by so many times more than beside what is narrow; by less if it also stands off
// by so many times more.
constexpr double kMuchSharper = 3, kSharper = 1.5;
// A prism with sides that turn by this share of the crease angle may be meant as one.
constexpr double kMostTurn = 0.95;
// A turn [rad] that is none.
constexpr double kNoTurn = 1e-5;
// A zone of a free shape is less than so many shortest sides of its triangles long; or an arc over
// its triangles rises by less than so many deviations of its flat sides.
constexpr double kShort = 6, kMostRise = 4;

// The others keep their order.
void Faces::give_up(const std::vector<char>& gone) {
  std::vector<int> number(shapes.size(), -1);
  std::vector<Primitive> kept;
  for (std::size_t f = 0; f < shapes.size(); ++f) {
    if (gone[f]) continue;
    number[f] = static_cast<int>(kept.size());
    kept.push_back(shapes[f]);
  }
  shapes = std::move(kept);
  for (int& face : of)
    if (face >= 0) face = number[face];
}

Recognizer::Recognizer(const Shell& shell, const CoplanarRegions& regions, double tolerance)
    : shell_(shell),
      regions_(regions),
      tolerance_(tolerance),
      wide_(std::max(3 * tolerance, 1e-6 * shell.size())),
      tries_(shell.triangles().size(), 0),
      of_(shell.triangles().size(), -1),
      inscribed_(static_cast<std::size_t>(regions.size()), Inscribed::No),
      mark_(shell.triangles().size(), 0) {
  find_candidates();
}

Vec3 Recognizer::centroid(int t) const {
  const auto [a, b, c] = shell_.corners(t);
  return (a + b + c) / 3;
}

double Recognizer::area(int t) const {
  const auto [a, b, c] = shell_.corners(t);
  return (b - a).cross(c - a).norm() / 2;
}

double Recognizer::longest_side(int t) const {
  double longest = 0;
  for (int k = 0; k < 3; ++k) longest = std::max(longest, shell_.along(3 * t + k).norm());
  return longest;
}

double Recognizer::off(int t, const Primitive& shape) const {
  double most = 0;
  for (const int v : corners(t)) most = std::max(most, std::abs(shape.distance(point(v))));
  return most;
}

std::vector<int> Recognizer::vertices_of(const std::vector<int>& triangles) const {
  std::vector<int> out;
  out.reserve(3 * triangles.size());
  for (const int t : triangles) out.insert(out.end(), corners(t).begin(), corners(t).end());
  sort_unique(out);
  return out;
}

// Vertices, and centroids, normals and areas of the triangles, as guess_primitives() takes them.
FacetSample Recognizer::sample(const std::vector<int>& triangles) const {
  FacetSample out;
  for (const int v : vertices_of(triangles)) out.vertices.push_back(point(v));
  for (const int t : triangles) {
    out.centroids.push_back(centroid(t));
    out.normals.push_back(facet_normal(t));
    out.areas.push_back(area(t));
  }
  return out;
}

// Marks of earlier rounds count as none, so nothing needs to be cleared.
void Recognizer::mark(const std::vector<int>& triangles) {
  ++round_;
  for (const int t : triangles) mark_[t] = round_;
}

// Neighbors over edges that may be inside a face: no creases, and turns below the limit.
// Candidates: what turns smoothly somewhere, and is no part of a plane: of few coplanar triangles,
// or of a strip all of which turn, and not far larger than what lies beside it.
void Recognizer::find_candidates() {
  const Topology& topology = shell_.topology();
  const int count = static_cast<int>(of_.size());
  beside_.assign(topology.edge_of.size(), -1);
  turn_.assign(of_.size(), 0);
  std::vector<char> straight(static_cast<std::size_t>(regions_.size()), 0);
  std::vector<double> around(straight.size(), 0);
  for (const Edge& edge : topology.edges) {
    if (edge.count != 2 || !(edge.inner || edge.kind == EdgeClass::Smooth)) continue;
    const auto [h, g] = topology.half_edges(edge);
    const int t = triangle_of(h), u = triangle_of(g), r = regions_.of(t), s = regions_.of(u);
    const double angle = turn(t, u);
    if (angle > kMostTurn * shell_.crease_angle()) continue;
    beside_[h] = u, beside_[g] = t;
    if (r == s) continue;
    for (float* most : {&turn_[t], &turn_[u]}) *most = std::max(*most, static_cast<float>(angle));
    around[r] = std::max(around[r], regions_.area(s));
    around[s] = std::max(around[s], regions_.area(r));
  }
  for (int t = 0; t < count; ++t)
    if (!(turn_[t] > kNoTurn)) straight[regions_.of(t)] = 1;
  curved_.assign(of_.size(), 0);
  for (int t = 0; t < count; ++t) {
    const int r = regions_.of(t);
    const bool few = regions_.count(r) <= 2;
    const bool wall = few && regions_.area(r) > kFarLarger * around[r];
    curved_[t] = turn_[t] > kNoTurn && (few || !straight[r]) && !wall;
  }
}

// What lies on faces found before is taken from them as a whole, or not at all.
bool Recognizer::take(Growth growth) {
  if (growth.triangles.empty()) return false;
  leave_wide_bands_out(growth);
  std::vector<int>& all = growth.triangles;
  std::vector<int> shared(faces_.size(), 0);
  for (const int t : all)
    if (of_[t] >= 0) ++shared[of_[t]];
  growth.explained = double(all.size());
  // A face gives way where nearly all of it is shared, and the new one explains clearly more: so a
  // triangle changes hands a few times at most, and no two faces take each other's for ever.
  const auto stays = [&](int f) {
    const Growth& face = faces_[f];
    return shared[f] < 0.9 * double(face.triangles.size()) ||
           growth.explained < 1.3 * face.explained;
  };
  // Its flats go with it.
  for (std::size_t f = 0; f < shared.size(); ++f)
    for (const int region : faces_[f].wide)
      if (shared[f] > 0 && !stays(int(f))) inscribed_[region] = Inscribed::No;
  const auto is_taken = [&](int t) { return is_own_plane(t) || (of_[t] >= 0 && stays(of_[t])); };
  erase_if(all, is_taken);
  if (all.size() < 3) return false;
  for (const int region : growth.wide)
    inscribed_[region] = growth.shape.kind == FaceKind::Sphere ? Inscribed::Belt : Inscribed::Plane;
  for (const int t : all) of_[t] = static_cast<int>(faces_.size());
  faces_.push_back(std::move(growth));
  return true;
}

// Strips whose border is smooth for a quarter or more, to what was not recognized or to each other,
// may be zones of a free shape: they look like cones. A zone is short against its triangles; or
// hardly wider than what goes on beyond its border, and an arc that turns as it does there would
// rise over it hardly more than the face itself does: who divides a free shape keeps that alike in
// both directions.
void Recognizer::drop_zones_of_free_shapes() {
  std::vector<char> weak(faces_.size(), 0);
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    std::vector<int>& all = faces_[f].triangles;
    erase_if(all, [&](int t) { return of_[t] != int(f); });
    weak[f] = !all.empty() && is_weak(faces_[f]);
  }
  // First all are judged, then dropped: the order does not matter.
  std::vector<int> dropped;
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    if (!weak[f]) continue;
    const Growth& face = faces_[f];
    std::size_t border = 0, vague = 0;
    std::vector<double> shortest, rises, wider;
    double low = 0, high = 0, mean = 0;
    for (const int t : face.triangles) mean += area(t) / double(face.triangles.size());
    for (const int t : face.triangles) {
      double least = longest_side(t);
      for (int k = 0; k < 3; ++k) {
        const double side = shell_.along(3 * t + k).norm();
        least = std::min(least, side);
        const double along = (shell_.point(3 * t + k) - face.shape.point).dot(face.shape.axis);
        if (shortest.empty() && k == 0) low = high = along;
        low = std::min(low, along), high = std::max(high, along);
        const int u = beside_[3 * t + k], other = shell_.topology().neighbor(3 * t + k);
        border += other < 0 || of_[other] != int(f);
        if (u < 0 || of_[u] == int(f)) continue;
        if (!(of_[u] >= 0 ? weak[of_[u]]
                          : curved_[u] && !is_own_plane(u) &&
                                regions_.area(regions_.of(u)) < 2 * kFarLarger * mean))
          continue;
        ++vague;
        rises.push_back(turn(t, u) * (2 * area(t) / side) / 8);
        wider.push_back(area(t) / area(u));  // on one base
      }
      shortest.push_back(least);
    }
    if (4 * vague < border + 1) continue;
    if (high - low < kShort * median(shortest) ||
        (median(wider) < kFarther && median(rises) < kMostRise * face.deviation))
      dropped.push_back(static_cast<int>(f));
  }
  for (const int f : dropped)
    for (const int t : faces_[f].triangles) of_[t] = -1;
}

// How far a region reaches from the middle of a side, straight across it [m]: a strip that goes
// around a corner is no wider there than elsewhere.
double Recognizer::reach_across(int h) const {
  const int region = regions_.of(triangle_of(h));
  const Vec3 middle = (shell_.point(h) + shell_.point(corner_after(h))) / 2;
  const Vec3 along = shell_.along(h).normalized();
  const Vec3 across = regions_.normal(region).cross(along);
  double reach = 0;
  for (int steps = 0;
       h >= 0 && regions_.of(triangle_of(h)) == region && steps < regions_.count(region); ++steps) {
    const bool beyond = (shell_.point(corner_before(h)) - middle).dot(along) > 0;
    const int side = beyond ? corner_before(h) : corner_after(h);
    const Vec3 x = shell_.point(side) - middle, y = shell_.point(corner_after(side)) - middle;
    const double share = x.dot(along) / (x.dot(along) - y.dot(along));
    reach = std::max(reach, (x + share * (y - x)).dot(across));
    h = shell_.topology().other_half_edge(side);
  }
  return reach;
}

// Coplanar triangles with a vertex more than a plane needs, that are wider across each smooth side
// than what turns away from them there: the long side of a turn does not bend.
void Recognizer::add_planes(Faces& faces) const {
  const Topology& topology = shell_.topology();
  const auto count = static_cast<std::size_t>(regions_.size());
  // Those that may be planes have a row.
  std::vector<char> plane(count, 0);
  std::vector<int> row(count, -1);
  std::size_t rows = 0;
  for (std::size_t r = 0; r < count; ++r)
    if (regions_.count(int(r)) > 1 || inscribed_[r] == Inscribed::Plane)
      plane[r] = 1, row[r] = static_cast<int>(rows++);
  std::vector<int> number(rows, -1), some(rows, -1);
  // The largest turn at sides beyond which a region goes on narrowly, the smallest at others [rad],
  // and the sagitta of that [m].
  struct Turns {
    double narrow = 0, alike = std::numeric_limits<double>::infinity(), sagitta = alike;
  };
  std::vector<Turns> turns(rows);
  // Of coplanar regions of several triangles.
  std::vector<Moments> moments(rows);
  for (std::size_t t = 0; t < of_.size(); ++t) {
    if (regions_.is_alone(int(t))) continue;
    const int r = row[regions_.of(int(t))];
    if (some[r] < 0) moments[r] = Moments(shell_.point(3 * int(t)));
    some[r] = static_cast<int>(t);
    // A triangle has the moments of its corners and its middle, weighted 1 : 1 : 1 : 9.
    const Vec3 middle = centroid(int(t));
    moments[r].add(area(int(t)) / 4, shell_.corners(int(t)));
    moments[r].add(area(int(t)) * 3 / 4, {middle, middle, middle});
  }
  // How far a vertex is off the plane of the largest triangle [m].
  std::vector<double> apart(rows, 0);
  for (std::size_t t = 0; t < of_.size(); ++t) {
    if (regions_.is_alone(int(t))) continue;
    const int r = row[regions_.of(int(t))];
    const Vec3 middle = moments[r].middle(), &normal = regions_.normal(regions_.of(int(t)));
    for (const Vec3& x : shell_.corners(int(t)))
      apart[r] = std::max(apart[r], std::abs((x - middle).dot(normal)));
  }
  // Of a region across a side: that of a rectangle with the same second moment [m].
  const auto width = [&](int h) {
    const int t = triangle_of(h), r = regions_.of(t);
    if (regions_.is_alone(t)) return regions_.height(h);
    const Vec3 across = regions_.normal(r).cross(shell_.along(h)).normalized();
    return std::sqrt(std::max(12 * across.dot(moments[row[r]].second() * across), 0.0));
  };
  for (std::size_t t = 0; t < of_.size(); ++t) {
    // Each triangle may speak against its region.
    char& is_plane = plane[regions_.of(int(t))];
    if (!is_plane) continue;
    some[row[regions_.of(int(t))]] = static_cast<int>(t);
    if (is_own_plane(int(t))) continue;
    if (of_[t] >= 0) is_plane = 0;
    for (int k = 0; k < 3 && is_plane; ++k) {
      const int h = 3 * static_cast<int>(t) + k, u = beside_[h];
      if (u < 0 || regions_.of(u) == regions_.of(int(t))) continue;
      const bool few = regions_.count(regions_.of(int(t))) < kFewOfPlane;
      auto& [narrow, alike, sagitta] = turns[row[regions_.of(int(t))]];
      const int g = topology.other_half_edge(h);
      const double here = width(h);
      double there = width(g);
      if (regions_.count(regions_.of(u)) >= kFewOfPlane) there = std::min(there, reach_across(g));
      if (here > (few ? kFarLarger : kFarther) * there)
        narrow = std::max(narrow, turn(int(t), u));
      else if (of_[u] < 0)  // else its normals are known
        alike = std::min(alike, turn(int(t), u)),
        sagitta = std::min(sagitta, turn(int(t), u) * std::min(here, there) / 8);
    }
  }
  // A program that divides a round surface into narrow strips makes no turns that are much larger,
  // and no chords that stand off much more, than those of the faces that were found.
  double most = -1;
  for (const int face : of_)
    if (face >= 0) most = std::max(most, faces_[face].deviation);
  if (most < 0) most = std::numeric_limits<double>::infinity();
  for (std::size_t r = 0; r < count; ++r) {
    if (!plane[r]) continue;
    const auto& [narrow, alike, sagitta] = turns[row[r]];
    const bool sharper = alike > kMuchSharper * narrow ||
                         (alike > kSharper * narrow && sagitta > kMuchSharper * most);
    plane[r] = std::isinf(alike) || (narrow > 0 && sharper);
  }
  for (std::size_t t = 0; t < of_.size(); ++t) {
    const int region = regions_.of(int(t)), r = row[region];
    if (!plane[region] || of_[t] >= 0) continue;
    if (number[r] < 0) {
      number[r] = static_cast<int>(faces.shapes.size());
      // Fitted where the vertices are off the plane of the largest triangle by their rounding.
      const Vec3& own = regions_.normal(region);
      std::pair<Vec3, Vec3> plane{point(corners(some[r])[0]), own};
      if (apart[r] > kMostGap * shell_.size())
        plane = {moments[r].middle(), moments[r].normal(own)};
      // A plane has no second number: it says whether the plane is inscribed in a round face.
      faces.shapes.push_back(
          {FaceKind::Plane, plane.first, plane.second, 0, double(is_own_plane(int(t)))});
    }
    faces.of[t] = number[r];
  }
}

bool Recognizer::is_fruitless() const { return fruitless_ > kFewVisits + kMostVisits * of_.size(); }

Faces Recognizer::run() {
  std::vector<int> seeds;
  for (std::size_t t = 0; t < of_.size(); ++t)
    if (curved_[t]) seeds.push_back(static_cast<int>(t));
  // Any order will do, as long as it is the same one and visits all places soon.
  std::uint64_t state = 1;
  for (std::size_t i = seeds.size(); i > 1; --i) {
    // Knuth's linear congruence (MMIX), and the shuffle of Fisher and Yates.
    state = state * 6364136223846793005u + 1442695040888963407u;
    std::swap(seeds[i - 1], seeds[(state >> 33) % i]);
  }
  const std::size_t patience = kPatience + seeds.size() / kTrianglesPerSeed;
  std::size_t failures = 0, all_failures = 0, explained = 0;
  for (const int seed : seeds) {
    if (failures >= patience || all_failures >= patience + explained || is_fruitless()) break;
    if (of_[seed] >= 0 || tries_[seed] >= 2) continue;
    const std::size_t before = visits_;
    const bool found = recognize_from(seed);
    failures = found ? 0 : failures + 1;
    all_failures += !found;
    explained += found ? faces_.back().triangles.size() : 0;
    fruitless_ += found ? 0 : visits_ - before;
  }
  fruitless_ = 0;
  for (std::size_t f = 0; is_precise() && f < faces_.size(); ++f) recognize_rims(int(f));
  drop_zones_of_free_shapes();
  for (std::size_t f = 0; f < faces_.size(); ++f) absorb(int(f));
  Faces out;
  out.of.assign(of_.size(), -1);
  std::vector<int> number(faces_.size(), -1);
  for (std::size_t t = 0; t < of_.size(); ++t) {
    if (of_[t] < 0) continue;
    int& at = number[of_[t]];
    if (at < 0)
      at = static_cast<int>(out.shapes.size()), out.shapes.push_back(faces_[of_[t]].shape);
    out.of[t] = at;
  }
  add_planes(out);
  if (is_precise()) agree_on_borders(shell_, out, 2 * tolerance_);
  if (out.shapes.empty()) out.of.clear();
  return out;
}

Faces recognize_faces(const Shell& shell, const CoplanarRegions& regions, double tolerance) {
  return Recognizer(shell, regions, tolerance).run();
}

}  // namespace sphshell
