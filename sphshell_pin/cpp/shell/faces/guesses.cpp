// What a mesh may be at a place: shapes through a patch, and about the axes of faces beside it.
#include <queue>

#include "shell/faces/recognizer.hpp"

namespace sphshell {

// Vertices to guess from: enough for the kinds of up to six parameters, and for a torus.
constexpr std::size_t kFewVertices = 8, kManyVertices = 12;
// Simpler kinds win ties (cylinder, cone, sphere, torus).
constexpr double kSimpler[] = {0, 1, 0.98, 0.97, 0.95};
// A torus whose circle is this small over its tube is none.
constexpr double kLeastRadius = 1e-3;
// A side is an end of a column where it leans so little along its axis.
constexpr double kAcross = 0.5;
// What is beyond a ring is off it by more windows.
constexpr double kAtOnce = 100;

// Triangles around the seed until they have so many vertices: ring by ring, what turns most first,
// or over the longest sides first, which lead along a strip.
std::vector<int> Recognizer::patch(int seed, std::size_t vertices, bool along, int beside) {
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
      if (u < 0 || is_marked(u) || (beside < 0 ? of_[u] >= 0 : of_[u] == beside) || !curved_[u])
        continue;
      mark_[u] = round_;
      const double side = shell_.along(3 * t + k).norm();
      open.push({along ? side : -double(ring) + 0.1 * turn_[u], u});
    }
  }
  return out;
}

// Growth over all that a shape explains; the kind that explains most triangles wins. False where
// they do not determine it.
bool Recognizer::try_shape(int seed, const Primitive& guess, Growth& best, double& score) {
  Growth growth = grow_and_refit(seed, guess);
  const Primitive shape = growth.shape;
  // A sphere is tried as one.
  if (shape.kind == FaceKind::Torus && shape.radius < kLeastRadius * shape.second) return false;
  leave_own_faces_out(growth);
  if (!is_over_determined(growth)) {
    // Fine meshes stand off so little that only the closest vertices count.
    growth = grow(seed, shape, tolerance_);
    leave_own_faces_out(growth);
    if (!is_over_determined(growth)) return false;
  }
  const double worth =
      double(growth.triangles.size()) * kSimpler[static_cast<int>(growth.shape.kind)];
  if (worth > score) score = worth, best = std::move(growth);
  return true;
}

// The best of the kinds that the patch lies on. False where it lies on none.
bool Recognizer::try_kinds(int seed, const std::vector<int>& patch, bool torus, bool others,
                           Growth& best, double& score) {
  bool any = false;
  const FacetSample facets = sample(patch);
  for (const FaceKind kind :
       {FaceKind::Cylinder, FaceKind::Cone, FaceKind::Sphere, FaceKind::Torus}) {
    if (!(kind == FaceKind::Torus ? torus : others) ||
        facets.vertices.size() < std::size_t(num_parameters(kind)) + 1)
      continue;
    for (Primitive guess : guess_primitives(kind, facets)) {
      if (!fit_primitive(facets.vertices, tolerance_, guess)) continue;
      any = true;
      if (try_shape(seed, guess, best, score)) break;
    }
  }
  return any;
}

// Each column of a thin ring is a cylinder to rounding. The ring's circle goes through the centers
// of one and of those beyond both of its ends.
void Recognizer::try_ring(int seed, Growth& best, double& score) {
  const Primitive tube = best.shape;
  Vec3 middle[3] = {Vec3::Zero(), Vec3::Zero(), Vec3::Zero()};
  double count[3] = {0, 0, 0};
  std::vector<int> all = best.triangles;
  mark(all);
  const auto add = [&](int t, int to) {
    middle[to] += centroid(t) - best.sign * tube.radius * facet_normal(t), ++count[to];
  };
  for (const int t : best.triangles) {
    add(t, 0);
    for (int k = 0; k < 3; ++k) {
      const int u = beside_[3 * t + k];
      const Vec3 side = shell_.along(3 * t + k);
      if (u < 0 || is_marked(u) || std::abs(side.dot(tube.axis)) > kAcross * side.norm()) continue;
      add(u, (centroid(u) - centroid(t)).dot(tube.axis) < 0 ? 1 : 2);
      all.push_back(u);
    }
  }
  const Vec3 a = middle[1] / count[1] - middle[0] / count[0];
  const Vec3 b = middle[2] / count[2] - middle[0] / count[0], n = a.cross(b);
  const Vec3 out =
      (b.squaredNorm() * n.cross(a) + a.squaredNorm() * b.cross(n)) / (2 * n.squaredNorm());
  Primitive ring{FaceKind::Torus, middle[0] / count[0] + out, n.normalized(), out.norm(),
                 tube.radius};
  std::vector<Vec3> points;
  for (const int v : vertices_of(all)) points.push_back(point(v));
  // Any three columns are nearly on a ring: it must go on, and end at once.
  Growth found;
  double few = 2 * double(all.size()), worth = few;
  if (!out.allFinite() || !fit_primitive(points, tolerance_, ring) ||
      !try_shape(seed, ring, found, worth) || !(worth > few))
    return;
  mark(found.triangles);
  bool ends = true;
  for_each_beside(found.triangles, [&](int u) {
    const double most = off(u, found.shape);
    ends = ends && !(most > found.window && most < kAtOnce * found.window);
  });
  if (ends) score = worth, best = std::move(found);
}

bool Recognizer::recognize_from(int seed) {
  Growth best;
  double score = 0;
  std::vector<int> tried;
  for (const bool along : {false, true}) {
    const std::vector<int> few = patch(seed, kFewVertices, along);
    if (few.size() < 3) return false;
    const std::vector<int> many = patch(seed, kManyVertices, along);
    // What no kind fits it fits no better with more triangles.
    const bool fits = try_kinds(seed, few, false, true, best, score);
    if (fits) try_kinds(seed, many, false, true, best, score);
    try_kinds(seed, many, true, false, best, score);
    if (best.triangles.size() > 2 * many.size()) break;
    tried = many;
  }
  // What one kind explains is a better sample for the others than the patch was.
  for (std::size_t size = 0; best.triangles.size() > size;) {
    size = best.triangles.size();
    std::vector<int> region = best.triangles;
    try_kinds(seed, region, true, true, best, score);
    if (!is_weak(best)) continue;
    // A strip may be a zone of something rounder: with the strips beside it.
    mark(region);
    for_each_beside(std::vector<int>(region), [&](int u) {
      if (curved_[u]) mark_[u] = round_, region.push_back(u);
    });
    try_kinds(seed, region, true, true, best, score);
    if (best.triangles.size() == size) try_ring(seed, best, score);
  }
  if (take(std::move(best))) return true;
  tries_[seed] = 2;
  for (const int t : tried) ++tries_[t];
  return false;
}

// Rounded and chamfered rims share the axis of a face beside them, whose long facets tell it better
// than theirs: they are guessed about it.
void Recognizer::recognize_rims(int face) {
  const Primitive about = faces_[face].shape;
  if (about.kind == FaceKind::Sphere) return;
  const std::vector<int> all = faces_[face].triangles;
  std::vector<char> asked(faces_.size(), 0);
  for (const int t : all)
    for (int k = 0; k < 3 && of_[t] == face; ++k) {
      const int seed = shell_.topology().neighbor(3 * t + k);
      if (seed < 0 || of_[seed] == face || !curved_[seed]) continue;
      const int other = of_[seed];
      asked.resize(faces_.size(), 0);
      if (other >= 0) {
        if (asked[other] || !is_weak(faces_[other])) continue;
        asked[other] = 1;
      }
      std::vector<Vec3> points;
      for (const int v : vertices_of(patch(seed, kManyVertices, false, face)))
        points.push_back(point(v));
      if (points.size() < kFewVertices) continue;
      if (is_fruitless()) return;
      Growth best;
      double score = 0;
      const std::size_t before = visits_;
      for (const FaceKind kind : {FaceKind::Cylinder, FaceKind::Cone, FaceKind::Torus}) {
        Primitive guess = with_axis(kind, about.point, about.axis, points);
        if (fit_primitive(points, tolerance_, guess)) try_shape(seed, guess, best, score);
      }
      if (!take(std::move(best))) fruitless_ += visits_ - before;
    }
}

}  // namespace sphshell
