// Ear clipping of polygons in space, by shape rather than by order.
#include <numeric>

#include "shell/cleaning/mending.hpp"
#include "shell/point_tree.hpp"

namespace sphshell {
namespace {

using Point2 = Eigen::Vector2d;
using Box2 = PointTree<2>::Box;

// Twice the signed area of the triangle a, b, c.
double cross(const Point2& a, const Point2& b, const Point2& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}

// The square of its longest edge.
double longest2(const Point2& a, const Point2& b, const Point2& c) {
  return std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
}

// 2 area / longest edge^2, signed: the measure by which elements count as without area.
double shape(const Point2& a, const Point2& b, const Point2& c) {
  const double longest = longest2(a, b, c);
  return longest > 0.0 ? cross(a, b, c) / longest : 0.0;
}

constexpr double kFlat = 2e-12;  // 2 area / longest edge^2 of a triangle without area
constexpr double kTie = 1e-9;    // shapes nearer than this count as equal; place decides
constexpr double kLast = 1e-6;   // factor on the shape of ears that would leave a sliver behind

// The largest of n values that change one at a time, in O(log n): a complete binary tree over the
// values, each node the larger of its children.
class Tournament {
 public:
  void reset(int n) {
    for (leaves_ = 1; leaves_ < static_cast<std::size_t>(n);) leaves_ *= 2;
    value_.assign(2 * leaves_, kOut);
  }

  void set(int i, double value) { put(i, std::max(kLeast, value)); }  // NaN counts as kLeast
  void drop(int i) { put(i, kOut); }

  // The first of those within `margin` of the largest.
  int first(double margin) const {
    const double least = value_[1] - margin;
    std::size_t node = 1;
    while (node < leaves_) node = 2 * node + (value_[2 * node] >= least ? 0 : 1);
    return static_cast<int>(node - leaves_);
  }

 private:
  static constexpr double kLeast = -1.5, kOut = -2.0;  // below every shape and kBlocked

  void put(int i, double value) {
    std::size_t node = leaves_ + static_cast<std::size_t>(i);
    value_[node] = value;
    while (node /= 2) value_[node] = std::max(value_[2 * node], value_[2 * node + 1]);
  }

  std::size_t leaves_ = 1;
  std::vector<double> value_;
};

// One polygon at a time: projected onto the plane of its area vector, then ears are cut off, the
// best shape first, until three corners are left.
class Clipper {
 public:
  Clipper(const PolygonView& polygons, const Points& points, double tolerance)
      : polygons_(polygons), points_(points), tolerance_(tolerance) {}

  // Appends the triangles of one polygon; false if no proper ear was left at some point.
  bool clip(std::size_t polygon, EarClips& out) {
    project(polygon);
    const auto n = static_cast<int>(flat_.size());
    prepare(n);
    for (int i = 0; i < n; ++i) evaluate_ear(i);
    bool proper = true;
    int start = 0;
    for (int left = n; left > 3; --left) {
      int best = order_[ears_.first(kTie)];
      if (score_[best] <= kFlat) {
        // Nothing is an ear where the outline crosses itself: the corner with the best shape.
        proper = false;
        best = order_[shapes_.first(0.0)];
      }
      emit(polygon, best, out);
      start = previous_[best];
      remove(best);
    }
    proper = proper && shape_at(start) > kFlat;
    emit(polygon, start, out);
    return proper;
  }

 private:
  static constexpr double kBlocked = -1.0;

  void prepare(int n) {
    // The outline as a doubly linked list of corners.
    for (auto* list : {&next_, &previous_, &rank_, &order_, &first_copy_}) list->resize(n);
    score_.resize(n);
    copies_.assign(n, 0);
    blocker_.assign(n, -1);
    if (waiting_.size() < flat_.size()) waiting_.resize(n);
    for (int i = 0; i < n; ++i) {
      next_[i] = (i + 1) % n;
      previous_[i] = (i + n - 1) % n;
      waiting_[i].clear();
    }
    std::iota(order_.begin(), order_.end(), 0);
    std::sort(order_.begin(), order_.end(),
              [&](int i, int j) { return vertex(i) != vertex(j) ? vertex(i) < vertex(j) : i < j; });
    for (int k = 0; k < n; ++k) {
      const int i = order_[k];
      // Bridges to holes pass a vertex twice: its copies are found by sorting.
      first_copy_[i] = k > 0 && vertex(order_[k - 1]) == vertex(i) ? first_copy_[order_[k - 1]] : i;
      ++copies_[first_copy_[i]];
    }
    plant();
    std::sort(order_.begin(), order_.end(), [&](int i, int j) {
      const double *a = point(first_ + i), *b = point(first_ + j);
      if (std::equal(a, a + 3, b)) return i < j;
      return std::lexicographical_compare(a, a + 3, b, b + 3);
    });
    for (int k = 0; k < n; ++k) rank_[order_[k]] = k;
    ears_.reset(n);
    shapes_.reset(n);
  }

  // Puts the vertices that are left into the tree.
  void plant() {
    std::vector<std::int32_t> left;
    for (std::size_t i = 0; i < flat_.size(); ++i)
      if (copies_[i] > 0) left.push_back(static_cast<std::int32_t>(i));
    planted_ = left_ = left.size();
    tree_ = PointTree<2>(flat_.front().data(), std::move(left));
  }

  // Finds the score of corner i, after its neighbors changed or what blocked it is gone.
  void evaluate_ear(int i) {
    score_[i] = ear_shape(i);
    if (blocker_[i] >= 0) waiting_[blocker_[i]].push_back(i);
    ears_.set(rank_[i], score_[i]);
    shapes_.set(rank_[i], shape_at(i));
  }

  // Cuts the ear at i off. Only its two neighbors change their shape; ears that were blocked by its
  // vertex are looked at again once no copy of that is left.
  void remove(int i) {
    const int before = previous_[i], after = next_[i], copy = first_copy_[i];
    next_[before] = after;
    previous_[after] = before;
    blocker_[i] = -1;
    ears_.drop(rank_[i]);
    shapes_.drop(rank_[i]);
    const bool gone = --copies_[copy] == 0;
    if (gone && 2 * --left_ < planted_) plant();
    evaluate_ear(before);
    evaluate_ear(after);
    if (!gone) return;
    // An ear that was blocked by this vertex may be free now; all others stay as they are.
    for (const int k : waiting_[copy])
      if (blocker_[k] == copy) evaluate_ear(k);
  }

  double shape_at(int i) const { return shape(flat_[previous_[i]], flat_[i], flat_[next_[i]]); }

  // Newell's normal gives the plane; in it the polygon runs counter-clockwise.
  void project(std::size_t polygon) {
    first_ = polygons_.offsets[polygon];
    const std::int64_t last = polygons_.offsets[polygon + 1];
    const auto at = [&](std::int64_t slot) { return place(points_, polygons_.corners[slot]); };
    // The first axis lies along the longest edge, so that coordinates do not depend on the
    // polygon's first corner.
    const Vec3 origin = at(first_);
    Vec3 normal = Vec3::Zero(), along = Vec3::Zero();
    double longest = 0.0;
    for (std::int64_t s = first_; s < last; ++s) {
      const Vec3 p = at(s) - origin, q = at(polygons_.next(polygon, s)) - origin;
      const Vec3 edge = q - p;
      normal += p.cross(q);
      if (edge.norm() > longest) longest = edge.norm(), along = edge;
    }
    normal.normalize();
    along = (along - normal.dot(along) * normal).normalized();
    const Vec3 across = normal.cross(along);
    flat_.clear();
    for (std::int64_t s = first_; s < last; ++s) {
      const Vec3 d = at(s) - origin;
      flat_.push_back({d.dot(along), d.dot(across)});
    }
  }

  // Shape of the ear at corner i, or kBlocked if it is flat, reflex or not empty; then blocker_
  // tells a vertex in it. A corner that lies beyond the diagonal by less than the tolerance (as
  // inserted ones do) would be left with a sliver: such ears come last.
  double ear_shape(int i) {
    const int h = previous_[i], j = next_[i];
    const Point2 &a = flat_[h], &b = flat_[i], &c = flat_[j];
    blocker_[i] = -1;
    const double quality = shape(a, b, c);
    if (quality <= kFlat) return kBlocked;
    // Rounding of the cross products: points on the border count as inside.
    const double slack = 1e-14 * longest2(a, b, c);
    const double base = (a - c).squaredNorm(), reach = tolerance_ * std::sqrt(base);
    bool sliver = false;
    const auto blocks = [&](int k) {
      // The two banks of a bridge to a hole share their vertices: those do not block.
      if (vertex(k) == vertex(h) || vertex(k) == vertex(i) || vertex(k) == vertex(j)) return false;
      const Point2& p = flat_[k];
      if (cross(a, b, p) >= -slack && cross(b, c, p) >= -slack && cross(c, a, p) >= -slack) {
        blocker_[i] = first_copy_[k];
        return true;
      }
      const double beyond = -cross(c, a, p);
      const double along = (p - a).dot(c - a);
      sliver = sliver || (beyond >= 0.0 && beyond <= reach && along > 0.0 && along < base);
      return false;
    };
    // A point within the slack is at most 0.5 % of an edge outside: shape > kFlat = 200 * 1e-14.
    const double grow = 0.02 * std::sqrt(slack / 1e-14) + 2.0 * reach;
    const Box2 ear = Box2(a).extend(b).extend(c);
    const Box2 around(Point2(ear.min().array() - grow), Point2(ear.max().array() + grow));
    // Rounding is monotone: the computed product of no point in the box is beyond its extremes.
    const auto extreme = [](const Point2& from, const Point2& to, const Box2& box, bool most) {
      return cross(from, to,
                   {(to[1] > from[1]) == most ? box.min()[0] : box.max()[0],
                    (to[0] > from[0]) == most ? box.max()[1] : box.min()[1]});
    };
    const auto meets = [&](const Box2& box) {
      if (!box.intersects(around)) return false;
      const double across = extreme(c, a, box, true);
      if (!sliver && across >= -reach && extreme(c, a, box, false) <= 0.0) return true;
      return across >= -slack && extreme(a, b, box, true) >= -slack &&
             extreme(b, c, box, true) >= -slack;
    };
    tree_.search(meets, [&](int k) { return copies_[k] > 0 && blocks(k); });
    if (blocker_[i] >= 0) return kBlocked;
    return sliver ? kLast * quality : quality;
  }

  void emit(std::size_t polygon, int i, EarClips& out) const {
    // Cyclic order starting at the first-listed corner of the three.
    std::array<int, 3> ear{previous_[i], i, next_[i]};
    std::rotate(ear.begin(), std::min_element(ear.begin(), ear.end()), ear.end());
    out.triangle_slots.push_back({first_ + ear[0], first_ + ear[1], first_ + ear[2]});
    out.triangle_polygon.push_back(static_cast<std::int32_t>(polygon));
  }

  const double* point(std::int64_t slot) const {
    return points_.data + 3 * static_cast<std::size_t>(polygons_.corners[slot]);
  }
  std::int32_t vertex(int i) const { return polygons_.corners[first_ + i]; }

  const PolygonView& polygons_;
  const Points& points_;
  double tolerance_;
  std::int64_t first_ = 0;
  std::vector<Point2> flat_;
  std::vector<int> next_, previous_;
  std::vector<double> score_;
  std::vector<int> first_copy_;  // of each corner: the first one that is the same vertex
  std::vector<int> copies_;      // of each first copy: how many corners of its vertex are left
  std::vector<int> blocker_;     // of each blocked ear: the first copy of a vertex in it, else -1
  std::vector<std::vector<int>>
      waiting_;                         // of each first copy: ears that it blocks or once blocked
  PointTree<2> tree_;                   // of the first copies
  std::size_t planted_ = 0, left_ = 0;  // points when the tree was built, and now
  std::vector<int> order_, rank_;       // corners by x, y, z of their points
  Tournament ears_, shapes_;            // by rank: scores, and shapes as they stand
};

}  // namespace

EarClips clip_ears(const PolygonView& polygons, Points points, double tolerance) {
  EarClips out;
  out.tangled.assign(polygons.count, 0);
  Clipper clipper(polygons, points, tolerance);
  for (std::size_t p = 0; p < polygons.count; ++p)
    if (!clipper.clip(p, out)) out.tangled[p] = 1;
  return out;
}

}  // namespace sphshell
