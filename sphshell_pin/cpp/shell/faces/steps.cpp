// The steps in which a round face was sampled, and the planes between two rulings that are wider.

#include "shell/faces/recognizer.hpp"

namespace sphshell {
namespace {

// Two steps are equal to this share, and to so many times what the vertices may be off.
constexpr double kSameStep = 2e-3, kSameWindows = 8;
// Chords follow each other if they turn by less than this (cosine).
constexpr double kAhead = 0.5;
// Fewer chords that another of the same width follows are an accident of irregular triangles; and
// what is wider than the others among them may be flats side by side.
constexpr double kLeastRegular = 0.33, kMostRegular = 0.9;
// More edges than that meet at poles.
constexpr std::size_t kPole = 32;
// Angles within this share of a region's width are one.
constexpr double kSameRuling = 0.02;
// A smooth neighbor whose normal is that of the shape within this angle (cosine, 0.6 degrees) goes
// on from it.
constexpr double kGoesOn = 0.99995;
// Nearer to the axis than this share of the radius an angle means nothing.
constexpr double kOnAxis = 1e-3;

double angle_from(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)); }

// The step from one vertex to another along a parallel circle of a cylinder or cone, a circle of a
// torus' tube, a great circle of a sphere [rad]; zero on a ruling, negative where it is oblique.
double step_between(const Primitive& s, const Vec3& x, const Vec3& y, double tolerance) {
  if (s.kind == FaceKind::Sphere)
    return 2 * std::asin(std::min((x - y).norm() / (2 * s.radius), 1.0));
  const Place a = place_on(s, x), b = place_on(s, y);
  const double around = angle_from(a.around, b.around);
  if (s.kind == FaceKind::Torus)
    return around * a.off < tolerance ? angle_from(a.across, b.across) : 0;
  if (std::abs(a.across - b.across) < tolerance) return around;
  return around * a.off < tolerance ? 0 : -around;
}

// The angle between the two rulings that a region lies between, on a torus between two circles
// about the axis [rad]; zero where it does not.
double width_between(const Primitive& s, const std::vector<Vec3>& points) {
  std::vector<double> angles;
  double least = 0, most = 0, first = 0;
  for (const Vec3& x : points) {
    const Place p = place_on(s, x);
    if (p.off < kOnAxis * s.radius) continue;
    const double angle = s.kind == FaceKind::Torus ? p.across : p.around;
    if (angles.empty()) first = angle;
    angles.push_back(std::remainder(angle - first, 2 * M_PI));
    least = std::min(least, angles.back()), most = std::max(most, angles.back());
  }
  // A ruling is an edge at least: of two points, not the tip of a triangle.
  const double same = kSameRuling * (most - least);
  std::size_t low = 0, high = 0;
  for (const double angle : angles) low += angle - least < same, high += most - angle < same;
  return low > 1 && high > 1 && low + high >= angles.size() ? most - least : 0;
}

}  // namespace

// A round face is sampled in equal steps: the last one can be shorter, never longer. Steps are
// those that another of the same width follows. The result is infinite where few do.
// An oblique cut is sampled in unequal ones: n of them leave open whether n - 1 would have done,
// and the widest may differ as much again from the wide ones as those from the others.
Recognizer::Steps Recognizer::widest_steps(const Growth& growth) {
  struct Chord {
    int ends[2];
    double step;
    bool regular;
  };
  std::vector<Chord> chords;
  std::vector<std::pair<int, int>> at;          // vertex, chord
  std::vector<std::pair<int, double>> oblique;  // region beyond, step
  for (const int t : growth.triangles)
    for (int k = 0; k < 3; ++k) {
      const int u = shell_.topology().neighbor(3 * t + k);
      if (u >= 0 && (regions_.of(u) == regions_.of(t) || (is_marked(u) && u < t))) continue;
      const int v = corners(t)[k], w = corners(t)[next_corner(k)];
      const double step = step_between(growth.shape, point(v), point(w), 2 * growth.window);
      if (step < 0 && (u < 0 || !is_marked(u)))
        oblique.push_back({u < 0 ? -1 : regions_.of(u), -step});
      if (step <= 0) continue;
      at.push_back({v, static_cast<int>(chords.size())});
      at.push_back({w, static_cast<int>(chords.size())});
      chords.push_back({{v, w}, step, false});
    }
  std::sort(at.begin(), at.end());
  for (std::size_t i = 0, end; i < at.size(); i = end) {
    for (end = i; end < at.size() && at[end].first == at[i].first; ++end) {
    }
    for (std::size_t m = i; m < end && end - i < kPole; ++m)
      for (std::size_t n = i; n < m; ++n) {
        Chord &a = chords[at[m].second], &b = chords[at[n].second];
        const Vec3& here = point(at[i].first);
        const Vec3 in = here - point(a.ends[a.ends[0] == at[i].first]);
        const Vec3 on = point(b.ends[b.ends[0] == at[i].first]) - here;
        if (in.dot(on) > kAhead * in.norm() * on.norm() &&
            std::abs(a.step - b.step) < slack(growth, a.step))
          a.regular = b.regular = true;
      }
  }
  Steps out{std::numeric_limits<double>::infinity(), {}};
  std::vector<double> steps;
  for (const Chord& chord : chords)
    if (chord.regular) steps.push_back(chord.step);
  const double all = double(chords.size() + oblique.size());
  if (!steps.empty() && double(steps.size()) >= kLeastRegular * all) {
    const bool straight = growth.shape.kind <= FaceKind::Cone;
    out.equal = quantile(std::move(steps), straight ? kMostRegular : 1);
    out.equal += slack(growth, out.equal);
  }
  std::sort(oblique.begin(), oblique.end());
  for (std::size_t i = 0, end; i < oblique.size(); i = end) {
    steps.clear();
    for (end = i; end < oblique.size() && oblique[end].first == oblique[i].first; ++end)
      steps.push_back(oblique[end].second);
    const double n = double(steps.size()), wide = quantile(steps, kMostRegular);
    if (n > 1) out.before[oblique[i].first] = wide * n / (n - 1) + wide - median(steps);
  }
  return out;
}

// How far two angles [rad] may be apart that are meant to be equal.
double Recognizer::slack(const Growth& growth, double step) const {
  const Primitive& s = growth.shape;
  return kSameStep * step +
         kSameWindows * growth.window / (s.kind == FaceKind::Torus ? s.second : s.radius);
}

// Flats are inscribed in a shaft or a ring as well, and belts in a ball: they are wider than the
// steps of the face around them. Where the face ends with a band, in what is tangent to it there,
// the band is part of the face. So it is where the face goes on at an end of the band: a plane
// meets a cylinder in rulings, as it meets a cone through its tip, or a torus in circles about the
// axis.
void Recognizer::leave_wide_bands_out(Growth& growth) {
  std::vector<int>& all = growth.triangles;
  mark(all);
  const Primitive& s = growth.shape;
  const Steps steps = widest_steps(growth);
  const double most = steps.equal;
  if (!(most < M_PI) && steps.before.empty()) return;
  std::vector<int> some = all;
  some.insert(some.end(), growth.left_out.begin(), growth.left_out.end());
  std::sort(some.begin(), some.end(), [&](int a, int b) {
    return std::pair(regions_.of(a), a) < std::pair(regions_.of(b), b);
  });
  // By the ends of a band, from one of its rulings to the other; a whole ring has none.
  const auto is_wide = [&](const std::vector<int>& members, double width) {
    bool wide = false, ends = false;
    for (const int t : members)
      for (int k = 0; k < 3; ++k) {
        const int u = shell_.topology().neighbor(3 * t + k);
        const int beyond = u < 0 ? -1 : regions_.of(u);
        if (beyond == regions_.of(t)) continue;
        const Vec3 &x = shell_.point(3 * t + k), &y = shell_.point(corner_after(3 * t + k));
        const double step = step_between(s, x, y, 2 * growth.window);
        if (u >= 0 && is_marked(u)) {
          if (step != 0) return false;
          continue;
        }
        if (beside_[3 * t + k] >= 0) {
          Vec3 n;
          s.distance((x + y) / 2, n);
          if (std::abs(n.dot(facet_normal(u))) > kGoesOn) return false;
        }
        ends = ends || step != 0;
        const auto before = step < 0 ? steps.before.find(beyond) : steps.before.end();
        wide = wide || step > most || (before != steps.before.end() && -step > before->second);
      }
    return wide || (!ends && width > most);
  };
  struct Band {
    int region;
    std::vector<int> members;
  };
  std::vector<Band> bands;
  for (const int t : some) {
    if (bands.empty() || bands.back().region != regions_.of(t))
      bands.push_back({regions_.of(t), {}});
    bands.back().members.push_back(t);
  }
  std::vector<char> wide(static_cast<std::size_t>(regions_.size()), 0);
  for (const auto& [region, members] : bands) {
    if (members.size() < 2) continue;
    std::vector<Vec3> points;
    for (const int v : vertices_of(members)) points.push_back(point(v));
    // One row of a torus may be wider than the others: only a ring that is plane is none of it.
    const std::size_t least = s.kind == FaceKind::Torus ? 5 : 4;
    const double width = points.size() < least ? 0 : width_between(s, points);
    wide[region] = s.kind == FaceKind::Sphere || (width > 0 && is_wide(members, width));
  }
  // In a ball a belt goes on beyond its rulings, which are its wide sides.
  const auto is_in_belt = [&](const Band& band) {
    int sides = 0, beside = 0;
    for (const int t : band.members)
      for (int k = 0; k < 3; ++k) {
        const int u = shell_.topology().neighbor(3 * t + k), other = u < 0 ? -1 : regions_.of(u);
        const Vec3 &x = point(corners(t)[k]), &y = point(corners(t)[next_corner(k)]);
        if (other == band.region || step_between(s, x, y, 0) <= most) continue;
        ++sides, beside += other < 0 || !is_marked(u) || wide[other];
      }
    return sides > 1 && beside == sides;
  };
  all.clear();
  growth.deviation = 0;
  for (const Band& band : bands) {
    if (wide[band.region] && (s.kind != FaceKind::Sphere || is_in_belt(band))) {
      growth.wide.push_back(band.region);
      continue;
    }
    for (const int t : band.members) {
      if (!is_marked(t)) continue;
      all.push_back(t);
      growth.deviation = std::max(growth.deviation, explain(t, s, growth.window).deviation);
    }
  }
}

}  // namespace sphshell
