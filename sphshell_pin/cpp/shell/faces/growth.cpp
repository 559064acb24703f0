// Regions of triangles that a primitive explains.

#include "shell/faces/recognizer.hpp"

namespace sphshell {

// The normal of a facet that leans more than this [rad] from the primitive's at its corners says
// nothing.
constexpr double kMostLeanOnFace = 0.7;
// A curved side comes within this share of the flat sides' distance.
constexpr double kMostOfFlat = 0.3;
// Nearer to the axis than this share of its middle, a corner is the tip of a cone.
constexpr double kTip = 1e-3;
constexpr double kMostMeanLean = 0.314;  // [rad], 18 degrees: the median over a face
// More points do not make a fit better than rounding.
constexpr std::size_t kMostFitted = 300;
constexpr int kMostRefits = 8;
// Coplanar triangles of so many vertices are a face of their own, unless they are a band.
constexpr int kFewOfBand = 3;
constexpr std::size_t kVerticesOfPlane = 5;

// The normals of a shape at the corners of a facet. At the tip of a cone, where it has none, each
// facet takes that of its own middle.
static std::array<Vec3, 3> normals_at(const Primitive& shape, const std::array<Vec3, 3>& corners) {
  std::array<Vec3, 3> out;
  for (int k = 0; k < 3; ++k) shape.distance(corners[k], out[k]);
  if (shape.kind != FaceKind::Cone) return out;
  const Vec3 centroid = (corners[0] + corners[1] + corners[2]) / 3;
  const auto off_axis = [&](const Vec3& x) { return (x - shape.point).cross(shape.axis).norm(); };
  for (int k = 0; k < 3; ++k)
    if (off_axis(corners[k]) < kTip * off_axis(centroid)) shape.distance(centroid, out[k]);
  return out;
}

int turned_on(const Primitive& shape, const std::array<Vec3, 3>& x, double tolerance) {
  double doubled, longest2 = 0;
  if (shape.kind == FaceKind::Plane) return 0;
  if (shape.kind == FaceKind::Sphere) {
    doubled = (x[0] - shape.point).dot((x[1] - shape.point).cross(x[2] - shape.point));
    doubled /= shape.radius;
    for (int k = 0; k < 3; ++k)
      longest2 = std::max(longest2, (x[next_corner(k)] - x[k]).squaredNorm());
  } else {
    // Lengths around the axis and across, about the middle of the facet.
    const Vec3 middle = (x[0] + x[1] + x[2]) / 3 - shape.point;
    const double off = (middle - middle.dot(shape.axis) * shape.axis).norm();
    const double across = shape.kind == FaceKind::Torus  ? shape.second
                          : shape.kind == FaceKind::Cone ? 1 / std::cos(shape.second)
                                                         : 1;
    const Eigen::Vector2d first = shape.parameters(x[0], 1);
    Eigen::Vector2d d[2];
    for (int k = 0; k < 2; ++k) {
      d[k] = shape.parameters(x[k + 1], 1) - first;
      d[k][0] = off * std::remainder(d[k][0], 2 * M_PI);
      if (shape.kind == FaceKind::Torus) d[k][1] = std::remainder(d[k][1], 2 * M_PI);
      d[k][1] *= across;
    }
    doubled = d[0][0] * d[1][1] - d[0][1] * d[1][0];
    longest2 = std::max({d[0].squaredNorm(), d[1].squaredNorm(), (d[1] - d[0]).squaredNorm()});
  }
  // Twice the area over the longest side is the height.
  if (!(std::abs(doubled) > tolerance * std::sqrt(longest2))) return 0;
  return doubled < 0 ? -1 : 1;
}

Vec3 Faces::normal(const Shell& shell, int corner) const {
  const int t = triangle_of(corner);
  const std::array<Vec3, 3> corners = shell.corners(t);
  const Primitive& shape = shapes[of[t]];
  const Vec3 n = normals_at(shape, corners)[side_of(corner)];
  // On the side of the facet's own normal, if that says anything.
  const double along = n.dot(shell.topology().face_normal[t]);
  const int turned = std::abs(along) > std::cos(kMostLeanOnFace) ? 0 : turned_on(shape, corners, 0);
  return (turned == 0 ? along < 0 : turned < 0) ? Vec3(-n) : n;
}

// The largest angle [rad] between a facet and the shape's normals at its corners.
double Recognizer::lean(int t, const Primitive& shape) const {
  double least = 1;
  for (const Vec3& n : normals_at(shape, shell_.corners(t)))
    least = std::min(least, std::abs(n.dot(facet_normal(t))));
  return std::acos(std::min(least, 1.0));
}

// Whether a triangle lies on the primitive: its vertices, its normal or else its place in the
// parameters, and the cubic sides through the primitive's normals. What is checked is what is used:
// a primitive that passes and is wrong can do bounded harm only.
Recognizer::Explained Recognizer::explain(int t, const Primitive& shape, double tolerance) const {
  Explained out{false, false, 0, 0};
  const std::array<Vec3, 3> at = shell_.corners(t);
  for (const Vec3& x : at)
    if (!(std::abs(shape.distance(x)) <= tolerance)) return out;
  const std::array<Vec3, 3> normals = normals_at(shape, at);
  double flat[3], curved[3], beyond[3] = {0, 0, 0}, sum = 0;
  for (int k = 0; k < 3; ++k) {
    const int l = next_corner(k);
    const Vec3 d = at[l] - at[k], middle = (at[k] + at[l]) / 2;
    // What the cubic side through these normals would add to the middle of the chord: an eighth of
    // the difference of the slopes.
    const Vec3 rise = (d.dot(normals[l]) * normals[l] - d.dot(normals[k]) * normals[k]) / 8;
    flat[k] = std::abs(shape.distance(middle)), curved[k] = std::abs(shape.distance(middle + rise));
    out.deviation = std::max(out.deviation, flat[k]);
    sum += normals[k].dot(facet_normal(t));
    // A chord around a torus may cross its crest, and its cubic side lies beyond: where the tube
    // has turned off by the chord's sagitta.
    if (shape.kind != FaceKind::Torus || shape.radius < shape.second) continue;
    const double sagitta = d.squaredNorm() / (8 * shape.radius);
    beyond[k] = std::min(sagitta * sagitta / (2 * shape.second), kMostOfFlat * shape.second);
  }
  out.sign = sum < 0 ? -1 : 1;
  const double least = std::cos(kMostLeanOnFace);
  for (const Vec3& n : normals)
    out.leans = out.leans || !(out.sign * n.dot(facet_normal(t)) > least);
  const double most = kMostOfFlat * out.deviation;
  bool closer = true, no_farther = true;
  for (int k = 0; k < 3; ++k) {
    closer = closer && curved[k] <= most + 1.5 * tolerance;
    no_farther = no_farther && curved[k] <= std::max({most, flat[k], beyond[k]}) + 1.5 * tolerance;
  }
  // A chord along the crest of a torus is as near to it as its cubic side. But so are the ears of a
  // plane that is tangent there, whose corners are on one line of the parameters.
  if (out.leans || !closer) {
    const int turned = turned_on(shape, at, 2 * tolerance);
    if (turned != (out.leans ? turned : out.sign)) return out;
    out.sign = turned;
  }
  out.explained = out.sign != 0 && no_farther;
  return out;
}

// Flood fill over the neighbors that the shape explains, all on one side of it. Edges of facets
// that lean are no creases.
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
    const Explained one = explain(t, shape, tolerance);
    if (!one.explained || (out.sign != 0 && one.sign != out.sign)) continue;
    out.sign = one.sign;
    out.deviation = std::max(out.deviation, one.deviation);
    found.push_back(t);
    for (int k = 0; k < 3; ++k) {
      int u = beside_[3 * t + k];
      if (u < 0) {
        u = shell_.topology().neighbor(3 * t + k);
        if (u < 0 || is_marked(u) || !(one.leans || explain(u, shape, tolerance).leans)) continue;
      }
      if (is_marked(u)) continue;
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
  std::vector<double> leans, off, told;
  std::vector<char> needle;
  for (const int t : all) {
    const Explained one = explain(t, growth.shape, growth.window);
    leans.push_back(lean(t, growth.shape));
    off.push_back(one.deviation);
    needle.push_back(one.leans);
    if (!one.leans) told.push_back(leans.back());
  }
  // Of those whose normals say something.
  if (told.empty() || quantile(told, 0.5) > kMostMeanLean) {
    all.clear();
    return;
  }
  // 0.009 rad is half a degree.
  const double most_lean = 2 * quantile(told, 0.75) + 0.009, most_off = 5 * quantile(off, 0.75);
  std::vector<std::pair<int, int>> by_region;  // region, place in `all`
  for (std::size_t i = 0; i < all.size(); ++i)
    if (regions_.count(regions_.of(all[i])) >= kFewOfBand)
      by_region.push_back({regions_.of(all[i]), static_cast<int>(i)});
  std::sort(by_region.begin(), by_region.end());
  std::vector<char> keep(all.size());
  for (std::size_t i = 0; i < all.size(); ++i) {
    // A flat on a ring ends on a curve of many vertices: one triangle is none.
    keep[i] = ((needle[i] || leans[i] <= most_lean) && off[i] <= most_off) ||
              (is_precise() && growth.shape.kind == FaceKind::Torus &&
               regions_.count(regions_.of(all[i])) == 1);
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
      for (const int vertex : vertices) {
        const Place place = place_on(s, point(vertex));
        if (s.kind == FaceKind::Torus)
          where.push_back(place.off / s.second * 10);
        else if (place.off > 1e-3 * s.radius)
          where.push_back(place.around);
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
    if (band) continue;
    for (std::size_t n = i; n < j; ++n) keep[by_region[n].second] = 0;
    growth.wide.push_back(by_region[i].first);
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

// What was left out of a face, was taken for a strip before the face was known or is another part
// of it goes to it where it lies on it and stands off no more than the rest.
void Recognizer::absorb(int face) {
  Growth& growth = faces_[face];
  const auto fits = [&](int t) {
    const Explained one = explain(t, growth.shape, growth.window);
    return one.explained && one.sign == growth.sign &&
           one.deviation <= growth.deviation + growth.window;
  };
  std::vector<int> open, gained;
  for (const int t : growth.triangles)
    if (of_[t] == face) open.push_back(t);
  const std::size_t own = open.size();
  std::vector<char> asked(faces_.size(), 0);
  asked[face] = 1;
  while (!open.empty()) {
    const int t = open.back();
    open.pop_back();
    for (int k = 0; k < 3; ++k) {
      const int u = shell_.topology().neighbor(3 * t + k);
      if (u < 0) continue;
      const int other = of_[u], region = regions_.of(u);
      gained.clear();
      if (other < 0) {
        if (inscribed_[region] == Inscribed::No && regions_.count(region) < kFewOfBand && fits(u))
          gained.push_back(u);
      } else if (!asked[other]) {
        asked[other] = 1;
        for (const int one : faces_[other].triangles)
          if (of_[one] == other) gained.push_back(one);
        const bool strip = 3 * gained.size() <= own;
        if (!(strip || faces_[other].shape.kind == growth.shape.kind) ||
            !std::all_of(gained.begin(), gained.end(), fits))
          gained.clear();
      }
      for (const int one : gained) {
        of_[one] = face;
        open.push_back(one);
        growth.triangles.push_back(one);
      }
    }
  }
}

}  // namespace sphshell
