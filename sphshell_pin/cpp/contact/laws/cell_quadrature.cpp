#include "contact/laws/cell_quadrature.hpp"

#include "contact/query/closest_on_side.hpp"

namespace sphshell {

// An arc turns by less than twice the angle of this cosine.
constexpr double kFlatArc = 0.92;
// Roots nearer than 2^-kMostHalvings of a side are none.
constexpr int kMostRootHalvings = 14;

// The one root between the ends, by Newton's method within what is known to hold it.
double Sextic::root() const {
  // In powers of t.
  double c[7];
  std::copy_n(f, 7, c);
  // Forward differences of the Bernstein coefficients, times binomials.
  for (int n = 1; n < 7; ++n)
    for (int i = 6; i >= n; --i) c[i] -= c[i - 1];
  static constexpr double kBinomial[7] = {1, 6, 15, 20, 15, 6, 1};
  for (int i = 0; i < 7; ++i) c[i] *= kBinomial[i];
  const bool begins_inside = f[0] < 0;
  double a = 0, b = 1, t = f[0] / (f[0] - f[6]);
  for (int i = 0; i < 60 && b - a > 1e-15; ++i) {
    // Horner's rule for the value and the slope together.
    double value = c[6], slope = 0;
    for (int k = 5; k >= 0; --k) slope = slope * t + value, value = value * t + c[k];
    if (value == 0) return t;
    ((value < 0) == begins_inside ? a : b) = t;
    double next = t - value / slope;
    if (!(next > a && next < b)) next = (a + b) / 2;
    if (std::abs(next - t) < 1e-15) return next;
    t = next;
  }
  return t;
}

void Sextic::roots(double begin, double end, int depth, double* out, int& count) const {
  // Descartes: as many roots as sign changes, or fewer by an even number.
  int changes = 0;
  for (int i = 0; i < 6; ++i) changes += (f[i] < 0) != (f[i + 1] < 0);
  if (changes == 0) return;
  if (changes == 1) {
    if (count < 6) out[count++] = begin + root() * (end - begin);
    return;
  }
  if (depth == kMostRootHalvings) return;
  Sextic low, high;
  halve(f, low.f, high.f);
  const double middle = (begin + end) / 2;
  low.roots(begin, middle, depth + 1, out, count);
  high.roots(middle, end, depth + 1, out, count);
}

// The arc from a to b, counterclockwise round the region, in pieces that are nearly straight.
template <class Region>
bool CellQuadrature<Region>::add_arc(const Vec2& a, const Vec2& b, const Corners& w, int depth) {
  // Halved at the point over the middle of its chord until it is nearly straight.
  const Arc arc(*this, a, b);
  if (arc.lean() > kFlatArc) {
    if (count_ >= kMostPieces - 8) return false;
    pieces_[count_++] = {a, b, true};
    return true;
  }
  Vec2 middle;
  if (depth > 6 || !root_towards((a + b) / 2, arc.out(), w, middle)) {
    // An arc shorter than round-off bounds nothing.
    return to_plane(b - a).squaredNorm() < 1e-20 * region_.size() * region_.size();
  }
  return add_arc(a, middle, w, depth + 1) && add_arc(middle, b, w, depth + 1);
}

// A boundary that meets no side; `found`: there is one.
template <class Region>
bool CellQuadrature<Region>::add_loop(const Corners& w, bool& found) {
  found = false;
  const Vec2 start = (w[0] + w[1] + w[2]) / 3;
  CellPoint lowest;
  if (!find_minimum(patch_, region_.probe(), {start.x(), start.y()}, lowest)) return true;
  if (!(region_.value(lowest.point) < 0)) return true;
  // A closed curve round the deepest point, if that is in the part: four
  // points of it, and the arcs between them.
  const Vec2 center(lowest.u, lowest.v);
  for (int k = 0; k < 3; ++k) {
    const Vec2 d = w[next_corner(k)] - w[k], from = center - w[k];
    if (d.x() * from.y() - d.y() * from.x() <= 0) return true;
  }
  Vec2 around[4];
  for (int i = 0; i < 4; ++i) {
    const Vec2 direction = i % 2 == 0 ? Vec2(1 - i, 0) : Vec2(0, 2 - i);
    if (!root_towards(center, to_parameters(direction), w, around[i])) return false;
  }
  for (int i = 0; i < 4; ++i)
    if (!add_arc(around[i], around[(i + 1) % 4], w, 0)) return false;
  found = true;
  return true;
}

// Where the ray from a place inside the region leaves it, within the part.
template <class Region>
bool CellQuadrature<Region>::root_towards(const Vec2& from, const Vec2& direction, const Corners& w,
                                          Vec2& out) const {
  double most = std::numeric_limits<double>::infinity();
  for (int k = 0; k < 3; ++k) {
    const Vec2 d = w[next_corner(k)] - w[k], to = w[k] - from;
    const double across = direction.x() * d.y() - direction.y() * d.x();
    // Up to the side of the triangle that the ray meets first.
    if (across > 0) most = std::min(most, (to.x() * d.y() - to.y() * d.x()) / across);
  }
  if (!(most > 0) || !std::isfinite(most)) return false;
  const Vec2 along = to_plane(direction);
  double a = 0, b = most * (1 + 1e-12), fa, fb, value = 0;
  gradient(from, &fa), gradient(from + b * direction, &fb);
  if (!(fa < 0) || !(fb >= 0)) return false;
  // The value is nearly a parabola: sqrt's guess, then Newton's method between the ends.
  double t = b * std::sqrt(-fa / (fb - fa));
  for (int i = 0; i < 60 && b - a > 1e-14 * most; ++i) {
    const double slope = 2 * gradient(from + t * direction, &value).dot(along);
    (value < 0 ? a : b) = t;
    double next = t - value / slope;
    if (!(next > a && next < b)) next = (a + b) / 2;
    const bool last = std::abs(next - t) < 1e-9 * most;
    t = next;
    if (last) break;
  }
  b = t;
  out = from + b * direction;
  return true;
}

template class CellQuadrature<BallRegion>;
template class CellQuadrature<HalfSpace>;

}  // namespace sphshell
