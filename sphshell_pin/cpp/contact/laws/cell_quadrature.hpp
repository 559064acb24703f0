// Integrals over the part of a curved element inside a ball, or below a plane.
#pragma once

#include "contact/laws/gauss.hpp"
#include "contact/laws/integration_region.hpp"
#include "contact/query/closest_on_cell.hpp"

namespace sphshell {

// An arc turns by less than twice the angle of this cosine.
inline constexpr double kFlatArc = 0.92;

// Green's formula in the plane of the parameters: with H(w) the integral of s g(o + s (w - o)) over
// s from 0 to 1, that of g over a region is the one of H(w) (w - o) x dw round it, for any pole o.
// The region is the part of a triangle inside the ball, where rho^2 is convex, or below the plane:
// round it go pieces of the triangle's sides, between roots of a polynomial, and arcs of the
// border, each over a chord. All that g is evaluated at is inside the triangle. Parts that are
// large against their distance from the center, and those in which the walk fails, are divided.
template <class Region>
class CellQuadrature {
 public:
  using Vec2 = Eigen::Vector2d;

  // The patch is relative to the region's origin; least_order: of Gauss's rules.
  CellQuadrature(const CubicPatch& patch, const FacetAxes& axes, const Region& region,
                 int least_order)
      : patch_(patch), axes_(axes), region_(region), least_order_(least_order) {}

  // visit(x, area vector by parameters, weight) for all quadrature points.
  template <class Visit>
  void run(Visit&& visit) {
    part({Vec2(0, 0), Vec2(1, 0), Vec2(0, 1)}, 0, visit);
  }

 private:
  // A piece of the boundary: a straight one, or an arc over the chord from a to b.
  struct Piece {
    Vec2 a, b;
    bool is_arc;
  };
  // In levels a quarter counts two, a half one.
  static constexpr int kMostPieces = 64, kMostLevels = 24;

  template <class Visit>
  void part(const Corners& w, int level, Visit& visit) {
    // Its control points: of the three sides, each from its corner on, and the middle one.
    Vec3 net[3][4], middle;
    if (level == 0) {
      const CubicPatch& c = patch_;
      net[0][0] = c.c00;
      net[0][1] = c.c00 + c.c10 / 3;
      net[0][2] = c.c00 + (2 * c.c10 + c.c20) / 3;
      net[1][0] = c.c00 + c.c10 + c.c20 + c.c30;
      net[1][1] = c.c00 + (2 * c.c10 + c.c01 + c.c20 + c.c11 + c.c21) / 3;
      net[1][2] = c.c00 + (c.c10 + 2 * c.c01 + c.c02 + c.c11 + c.c12) / 3;
      net[2][0] = c.c00 + c.c01 + c.c02 + c.c03;
      net[2][1] = c.c00 + (2 * c.c01 + c.c02) / 3;
      net[2][2] = c.c00 + c.c01 / 3;
      middle = c.c00 + (c.c10 + c.c01) / 3 + c.c11 / 6;
    } else {
      for (int k = 0; k < 3; ++k) {
        const Vec2 &p = w[k], &q = w[next_corner(k)];
        net[k][0] = patch_.polar(p, p, p);
        net[k][1] = patch_.polar(p, p, q);
        net[k][2] = patch_.polar(p, q, q);
      }
      middle = patch_.polar(w[0], w[1], w[2]);
    }
    for (int k = 0; k < 3; ++k) net[k][3] = net[next_corner(k)][0];
    // From the convex hull of the control points.
    const Range bounds = region_.bounds(net, middle);
    if (region_.misses(bounds)) return;
    double size2 = 0;
    for (int k = 0; k < 3; ++k) size2 = std::max(size2, (net[k][3] - net[k][0]).squaredNorm());
    const Plan plan = region_.plan(bounds, size2);
    if (plan.too_large && level < kMostLevels) return divide(w, level, visit);
    const int order = std::max(least_order_, plan.order);
    // All of it is inside: a rule for triangles.
    if (region_.holds(bounds)) return whole(w, order, visit);

    count_ = 0;
    int corners_inside = 0;
    bool any = false, fails = false, has_exit = false, has_entry = false;
    Vec2 exit, first_entry;
    for (int k = 0; k < 3; ++k) {
      const Vec2 &p = w[k], &q = w[next_corner(k)];
      // Walks round the triangle: pieces of the sides inside the region, and arcs from where the
      // boundary leaves it to where it comes back.
      const Sextic along = region_.along(net[k][0], net[k][1], net[k][2], net[k][3]);
      double t[8];
      int count = 0;
      along.roots(0, 1, 0, t, count);
      bool inside = along.f[0] < 0;
      corners_inside += inside;
      any = any || inside || count > 0;
      double from = 0;
      for (int i = 0; i <= count; ++i) {
        const double to = i < count ? t[i] : 1;
        if (inside) pieces_[count_++] = {p + from * (q - p), p + to * (q - p), false};
        if (i == count) break;
        const Vec2 place = p + to * (q - p);
        if (inside) {
          exit = place, has_exit = true;
        } else if (has_exit) {
          fails = fails || !add_arc(exit, place, w, 0);
          has_exit = false;
        } else {
          first_entry = place, has_entry = true;
        }
        inside = !inside, from = to;
      }
    }
    // A root was missed: divided parts have fewer.
    if (has_exit != has_entry) fails = true;
    if (has_exit && has_entry) fails = fails || !add_arc(exit, first_entry, w, 0);
    const bool looped = !any;
    if (looped) fails = !add_loop(w, any);
    // Its sides are inside; its middle may not be.
    if (corners_inside == 3 && count_ == 3 && level < 4) fails = true;
    if (fails && level < kMostLevels) return divide(w, level, visit);
    if (!any) return;

    // Pieces in line with the pole contribute nothing: a corner inside, else a crossing.
    Vec2 pole = pieces_[0].a;
    for (int k = 0; k < 3; ++k)
      if (region_.value(net[k][0]) < 0) pole = w[k];
    if (corners_inside == 0 && looped) pole = (pieces_[0].a + pieces_[count_ / 2].a) / 2;
    const GaussRule& rule = gauss_rule(order);
    const GaussRule& along_arc = gauss_rule(std::max(order, 5));
    for (int i = 0; i < count_; ++i) {
      const Piece& piece = pieces_[i];
      if (!piece.is_arc) {
        const Vec2 d = piece.b - piece.a, from = piece.a - pole;
        if (std::abs(from.x() * d.y() - from.y() * d.x()) <= 1e-15) continue;
        for (int j = 0; j < rule.size; ++j)
          sector(pole, piece.a + rule.nodes[j] * d, d, rule.weights[j], rule, visit);
        continue;
      }
      const Arc arc(*this, piece.a, piece.b);
      if (arc.lean() <= 0) continue;
      for (int j = 0; j < along_arc.size; ++j) {
        const ArcPoint on = arc.at(along_arc.nodes[j]);
        sector(pole, on.w, on.dw, along_arc.weights[j], rule, visit);
      }
    }
  }

  // Into four similar triangles by the middles of the sides. Those of a long one would all be long:
  // it is cut in two, from its longest side to the corner opposite.
  template <class Visit>
  void divide(const Corners& w, int level, Visit& visit) {
    int k = 0;
    double longest2 = 0;
    for (int i = 0; i < 3; ++i) {
      const double side2 = to_plane(w[next_corner(i)] - w[i]).squaredNorm();
      if (side2 > longest2) longest2 = side2, k = i;
    }
    const Vec2 &p = w[k], &q = w[next_corner(k)];
    const Vec2& top = w[next_corner(next_corner(k))];
    const Vec2 base = to_plane(q - p), up = to_plane(top - p);
    // No longer than four times its height.
    if (longest2 <= 4 * (base.x() * up.y() - base.y() * up.x())) {
      for (const Corners& quarter : quarters(w)) part(quarter, level + 2, visit);
      return;
    }
    // Halved time and again, a needle falls into ever more and thinner ones side by side. It is cut
    // at once to the size that is wanted round the point nearest to the center, which is its
    // distance from the center. Where that vanishes, cuts would leave slivers: a share of the
    // radius instead.
    const Vec3 from = patch_.point(p.x(), p.y()), along = patch_.point(q.x(), q.y()) - from;
    const double near = std::clamp(-from.dot(along) / longest2, 0.0, 1.0);
    const double size = std::max((from + near * along).norm(), region_.size() / 16);
    const double reach = size / (2 * std::sqrt(longest2));
    const double t = reach > 0.25 ? 0.5 : near < 0.5 ? near + reach : near - reach;
    const Vec2 cut = p + t * (q - p);
    part({p, cut, top}, level + 1, visit);
    part({cut, q, top}, level + 1, visit);
  }

  // Stroud's rule of degree 5, Dunavant's of degree 8 (Int. J. Numer. Methods Eng. 21 (1985) 1129),
  // or a product of Gauss's.
  template <class Visit>
  void whole(const Corners& w, int order, Visit& visit) {
    struct Orbit {
      double weight, a, b, c;
    };
    static constexpr Orbit kSeven[] = {
        {0.225, 1. / 3, 1. / 3, 1. / 3},
        {0.132394152788506181, 0.059715871789769820, 0.470142064105115090, 0.470142064105115090},
        {0.125939180544827153, 0.797426985353087322, 0.101286507323456339, 0.101286507323456339}};
    static constexpr Orbit kSixteen[] = {
        {0.144315607677787168, 1. / 3, 1. / 3, 1. / 3},
        {0.095091634267284625, 0.081414823414553688, 0.459292588292723156, 0.459292588292723156},
        {0.103217370534718250, 0.658861384496479963, 0.170569307751760018, 0.170569307751760018},
        {0.032458497623198080, 0.898905543365937904, 0.050547228317031048, 0.050547228317031048},
        {0.027230314174434994, 0.008394777409957605, 0.728492392955404281, 0.263112829634638113}};
    const Vec2 e1 = w[1] - w[0], e2 = w[2] - w[0];
    const double twice = e1.x() * e2.y() - e1.y() * e2.x();
    if (order > 4) {
      const GaussRule& rule = gauss_rule(order);
      for (int i = 0; i < rule.size; ++i)
        sector(w[0], w[1] + rule.nodes[i] * (e2 - e1), e2 - e1, rule.weights[i], rule, visit);
      return;
    }
    const auto put = [&](double weight, double b1, double b2) {
      at(w[0] + b1 * e1 + b2 * e2, weight * twice / 2, visit);
    };
    const Orbit* orbit = order < 4 ? kSeven : kSixteen;
    const int count = order < 4 ? 3 : 5;
    put(orbit[0].weight, 1. / 3, 1. / 3);
    for (int i = 1; i < count; ++i) {
      const Orbit& o = orbit[i];
      put(o.weight, o.a, o.b), put(o.weight, o.b, o.c), put(o.weight, o.c, o.a);
      if (o.b != o.c) put(o.weight, o.b, o.a), put(o.weight, o.c, o.b), put(o.weight, o.a, o.c);
    }
  }

  template <class Visit>
  void at(const Vec2& w, double weight, Visit& visit) {
    const Vec3 x = patch_.point(w.x(), w.y());
    visit(x, patch_.along_u(w.x(), w.y()).cross(patch_.along_v(w.x(), w.y())), weight);
  }
  // One ray of Green's formula: Gauss's points from the pole to w, with the Jacobian s.
  template <class Visit>
  void sector(const Vec2& pole, const Vec2& w, const Vec2& dw, double weight, const GaussRule& rule,
              Visit& visit) {
    const Vec2 from = w - pole;
    weight *= from.x() * dw.y() - from.y() * dw.x();
    if (weight == 0) return;
    for (int i = 0; i < rule.size; ++i)
      at(pole + rule.nodes[i] * from, weight * rule.nodes[i] * rule.weights[i], visit);
  }

  // Of the region's value over the parameters: half its gradient in right-angled axes, and itself.
  Vec2 gradient(const Vec2& w, double* value = nullptr) const {
    const Vec3 x = patch_.point(w.x(), w.y());
    const Vec3& half = region_.half_gradient(x);
    double gu = half.dot(patch_.along_u(w.x(), w.y())), gv = half.dot(patch_.along_v(w.x(), w.y()));
    axes_.first(gu, gv);
    if (value) *value = region_.value(x);
    return {gu, gv};
  }
  // From parameters to meters in the facet's plane (an upper triangular matrix), and back.
  Vec2 to_plane(const Vec2& d) const {
    return {axes_.a * d.x() + axes_.b * d.y(), axes_.c * d.y()};
  }
  Vec2 to_parameters(const Vec2& d) const {
    const double v = d.y() / axes_.c;
    return {(d.x() - axes_.b * v) / axes_.a, v};
  }

  // Each is false where it fails: the part is then divided.

  // The arc from a to b, counterclockwise round the region, in pieces that are nearly straight.
  bool add_arc(const Vec2& a, const Vec2& b, const Corners& w, int depth) {
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
  bool add_loop(const Corners& w, bool& found) {
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
  bool root_towards(const Vec2& from, const Vec2& direction, const Corners& w, Vec2& out) const {
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

  struct ArcPoint {
    Vec2 w, dw;
  };
  // An arc of the region's border as a graph over its chord.
  class Arc {
   public:
    Arc(const CellQuadrature& cell, const Vec2& a, const Vec2& b)
        : cell_(cell), a_(a), chord_(b - a) {
      const Vec2 chord = cell.to_plane(chord_);
      length_ = chord.norm();
      if (!(length_ > 0)) return;
      chord_plane_ = chord;
      out_ = Vec2(chord.y(), -chord.x()) / length_;
      out_parameters_ = cell.to_parameters(out_);
      const Vec2 ga = cell.gradient(a), gb = cell.gradient(b);
      // The gradient points out of the region; where it leans far from the chord's normal the
      // arc is no graph over the chord.
      lean_ = std::min(ga.dot(out_) / ga.norm(), gb.dot(out_) / gb.norm());
      rise_a_ = -ga.dot(chord) / ga.dot(out_), rise_b_ = -gb.dot(chord) / gb.dot(out_);
    }

    // Cosine of the larger angle between the chord's normal and the gradient at an end.
    double lean() const { return length_ > 0 ? lean_ : -1; }
    const Vec2& out() const { return out_parameters_; }

    // Newton's method across the chord.
    ArcPoint at(double t) const {
      // The cubic that has the arc's slopes at both ends: Newton's start.
      double s = t * (1 - t) * ((1 - t) * rise_a_ - t * rise_b_);
      Vec2 w, g;
      for (int i = 0; i < 12; ++i) {
        w = a_ + t * chord_ + s * out_parameters_;
        double value;
        g = cell_.gradient(w, &value);
        const double step = value / (2 * g.dot(out_));
        if (!(std::abs(step) < length_)) break;
        s -= step;
        if (std::abs(step) < 1e-7 * length_) break;
      }
      w = a_ + t * chord_ + s * out_parameters_;
      // By implicit differentiation.
      const double slope = -g.dot(chord_plane_) / g.dot(out_);
      return {w, chord_ + slope * out_parameters_};
    }

   private:
    const CellQuadrature& cell_;
    Vec2 a_, chord_, chord_plane_, out_, out_parameters_;
    double length_ = 0, lean_ = -1, rise_a_ = 0, rise_b_ = 0;
  };

  CubicPatch patch_;
  const FacetAxes& axes_;
  Region region_;
  int least_order_;
  Piece pieces_[kMostPieces];
  int count_ = 0;
};

}  // namespace sphshell
