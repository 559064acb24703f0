// Ear clipping of polygons in space, by shape rather than by order.
#include <algorithm>
#include <array>
#include <cmath>

#include "shell/mending.hpp"

namespace sphshell {
namespace {

using Vec2 = std::array<double, 2>;

double cross(const Vec2& a, const Vec2& b, const Vec2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

double squared(const Vec2& a, const Vec2& b) {
  return (b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]);
}

// 2 area / longest edge^2, signed: the measure by which elements count as without area.
double shape(const Vec2& a, const Vec2& b, const Vec2& c) {
  const double longest = std::max({squared(a, b), squared(b, c), squared(c, a)});
  return longest > 0.0 ? cross(a, b, c) / longest : 0.0;
}

constexpr double kFlat = 2e-12;  // 2 area / longest edge^2 of a triangle without area
constexpr double kTie = 1e-9;    // shapes nearer than this count as equal; place decides
constexpr double kLast = 1e-6;   // factor on the shape of ears that would leave a sliver behind

class Clipper {
 public:
  Clipper(const PolygonView& polygons, const double* points, double tolerance)
      : polygons_(polygons), points_(points), tolerance_(tolerance) {}

  // Appends the triangles of one polygon; false if no proper ear was left at some point.
  bool clip(std::size_t polygon, EarClips& out) {
    project(polygon);
    const auto n = static_cast<int>(flat_.size());
    next_.resize(n);
    previous_.resize(n);
    score_.resize(n);
    for (int i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
    }
    for (int i = 0; i < n; ++i) score_[i] = ear_shape(i);
    bool proper = true;
    int start = 0;
    for (int left = n; left > 3; --left) {
      int best = start;
      for (int i = next_[start]; i != start; i = next_[i]) {
        if (better(i, best)) best = i;
      }
      if (score_[best] <= kFlat) {
        proper = false;
        best = bluntest(start);
      }
      emit(polygon, best, out);
      const int before = previous_[best], after = next_[best];
      next_[before] = after;
      previous_[after] = before;
      start = before;
      score_[before] = ear_shape(before);
      score_[after] = ear_shape(after);
      // Corners seen only through the cut: an ear that was blocked by `best` may be free now.
      for (int i = next_[after]; i != before; i = next_[i]) {
        if (score_[i] < 0.0) score_[i] = ear_shape(i);
      }
    }
    proper = proper && shape(flat_[previous_[start]], flat_[start], flat_[next_[start]]) > kFlat;
    emit(polygon, start, out);
    return proper;
  }

 private:
  static constexpr double kBlocked = -1.0;

  // Newell's normal gives the plane; in it the polygon runs counter-clockwise.
  void project(std::size_t polygon) {
    first_ = polygons_.offsets[polygon];
    const std::int64_t last = polygons_.offsets[polygon + 1];
    std::array<double, 3> normal{}, along{};
    const double* origin = point(first_);
    double longest = 0.0;
    for (std::int64_t s = first_; s < last; ++s) {
      const double* a = point(s);
      const double* b = point(polygons_.next(polygon, s));
      std::array<double, 3> p{}, q{}, edge{};
      for (int k = 0; k < 3; ++k) {
        p[k] = a[k] - origin[k];
        q[k] = b[k] - origin[k];
        edge[k] = q[k] - p[k];
      }
      for (int k = 0; k < 3; ++k) {
        normal[k] += p[(k + 1) % 3] * q[(k + 2) % 3] - p[(k + 2) % 3] * q[(k + 1) % 3];
      }
      const double length = std::hypot(edge[0], edge[1], edge[2]);
      if (length > longest) {
        longest = length;
        along = edge;
      }
    }
    double size = std::hypot(normal[0], normal[1], normal[2]);
    for (double& x : normal) x /= size > 0.0 ? size : 1.0;
    double lean = 0.0;
    for (int k = 0; k < 3; ++k) lean += normal[k] * along[k];
    for (int k = 0; k < 3; ++k) along[k] -= lean * normal[k];
    size = std::hypot(along[0], along[1], along[2]);
    for (double& x : along) x /= size > 0.0 ? size : 1.0;
    flat_.clear();
    for (std::int64_t s = first_; s < last; ++s) {
      const double* a = point(s);
      Vec2 uv{};
      for (int k = 0; k < 3; ++k) {
        const double d = a[k] - origin[k];
        uv[0] += d * along[k];
        uv[1] += d * (normal[(k + 1) % 3] * along[(k + 2) % 3] -
                      normal[(k + 2) % 3] * along[(k + 1) % 3]);
      }
      flat_.push_back(uv);
    }
  }

  // Shape of the ear at corner i, or kBlocked if it is flat, reflex or not empty. A corner that
  // lies beyond the diagonal by less than the tolerance (as inserted ones do) would be left with
  // a sliver: such ears come last.
  double ear_shape(int i) const {
    const int h = previous_[i], j = next_[i];
    const double quality = shape(flat_[h], flat_[i], flat_[j]);
    if (quality <= kFlat) return kBlocked;
    const double slack = 1e-14 * std::max({squared(flat_[h], flat_[i]), squared(flat_[i], flat_[j]),
                                           squared(flat_[j], flat_[h])});
    const double base = squared(flat_[j], flat_[h]);
    bool sliver = false;
    for (int k = next_[j]; k != h; k = next_[k]) {
      // The two banks of a bridge to a hole share their vertices: those do not block.
      if (vertex(k) == vertex(h) || vertex(k) == vertex(i) || vertex(k) == vertex(j)) continue;
      if (cross(flat_[h], flat_[i], flat_[k]) >= -slack &&
          cross(flat_[i], flat_[j], flat_[k]) >= -slack &&
          cross(flat_[j], flat_[h], flat_[k]) >= -slack) {
        return kBlocked;
      }
      const double beyond = -cross(flat_[j], flat_[h], flat_[k]);
      const double along = (flat_[k][0] - flat_[h][0]) * (flat_[j][0] - flat_[h][0]) +
                           (flat_[k][1] - flat_[h][1]) * (flat_[j][1] - flat_[h][1]);
      sliver = sliver || (beyond >= 0.0 && beyond <= tolerance_ * std::sqrt(base) && along > 0.0 &&
                          along < base);
    }
    return sliver ? kLast * quality : quality;
  }

  bool better(int i, int than) const {
    if (score_[i] > score_[than] + kTie) return true;
    if (score_[i] < score_[than] - kTie) return false;
    const double* a = point(first_ + i);
    const double* b = point(first_ + than);
    return std::lexicographical_compare(a, a + 3, b, b + 3);
  }

  // Where nothing is an ear (the outline crosses itself): the corner with the best shape.
  int bluntest(int start) const {
    int best = start;
    double most = -2.0;
    int i = start;
    do {
      const double quality = shape(flat_[previous_[i]], flat_[i], flat_[next_[i]]);
      if (quality > most) {
        most = quality;
        best = i;
      }
      i = next_[i];
    } while (i != start);
    return best;
  }

  void emit(std::size_t polygon, int i, EarClips& out) const {
    // Cyclic order starting at the first-listed corner of the three.
    std::array<int, 3> ear{previous_[i], i, next_[i]};
    std::rotate(ear.begin(), std::min_element(ear.begin(), ear.end()), ear.end());
    for (const int k : ear) out.triangle_slots.push_back(first_ + k);
    out.triangle_polygon.push_back(static_cast<std::int32_t>(polygon));
  }

  const double* point(std::int64_t slot) const {
    return points_ + 3 * static_cast<std::size_t>(polygons_.corners[slot]);
  }
  std::int32_t vertex(int i) const { return polygons_.corners[first_ + i]; }

  const PolygonView& polygons_;
  const double* points_;
  double tolerance_;
  std::int64_t first_ = 0;
  std::vector<Vec2> flat_;
  std::vector<int> next_, previous_;
  std::vector<double> score_;
};

}  // namespace

EarClips clip_ears(const PolygonView& polygons, const double* points, double tolerance) {
  EarClips out;
  out.tangled.assign(polygons.count, 0);
  Clipper clipper(polygons, points, tolerance);
  for (std::size_t p = 0; p < polygons.count; ++p) {
    if (!clipper.clip(p, out)) out.tangled[p] = 1;
  }
  return out;
}

}  // namespace sphshell
