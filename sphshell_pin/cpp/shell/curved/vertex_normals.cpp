#include "shell/curved/vertex_normals.hpp"

#include "shell/curved/creases.hpp"
#include "shell/in_parallel.hpp"
#include "shell/curved/limiter.hpp"

namespace sphshell {
namespace {

// A fit leaves at most this share of the squared heights: what curves more unevenly is noise, or
// the end of a fillet.
constexpr double kMostUneven = 0.1;
// Smallest pivot of the normal equations beside its diagonal element: below, the points do not tell
// the terms apart.
constexpr double kLeastPivot = 1e-6;
// The frame turns with the normal: a few rounds settle both. A tilt that settles it [rad].
constexpr int kNormalFits = 3;
constexpr double kSettledTilt = 1e-7;
// Normals agree within this angle [rad] and share of the spread of the normals around.
constexpr double kSmallTurn = 0.005, kLikely = 0.25;
// Where a facet is much higher than its neighbors the surface may be smooth all the same, if it was
// sampled unevenly: up to this ratio of heights, if two fits leave little and agree within a share
// of the spread.
constexpr double kMostUnevenHeights = 10, kLittle = 0.02, kSurelyAlike = 0.1;
// A tilt is taken if its standard error is below this share of the spread.
constexpr double kMostDoubt = 0.1;
// A fit leaves at least this share of the squared heights, whatever it says: its terms are not all.
constexpr double kLeastLeft = 1e-3;
// A given normal contradicts a face that is off by more than this.
constexpr double kContradiction = 0.01;
// Corners take the normal of a face in their fan within this angle [rad] of their own facet's.
constexpr double kTakesOver = 0.44;

// True where the surface falls away from a fan's vertex along straight lines, as from the tip of a
// cone: seen from the vertices around it does not bend that much. normal_at(corner).
template <class NormalAt>
bool is_cone_apex(const Shell& shell, NormalAt&& normal_at, Span fan) {
  double uneven = 0, bent = 0;
  for (const int c : fan) {
    for (const int far : {corner_after(c), corner_before(c)}) {
      const Vec3 edge = shell.point(far) - shell.point(c);
      const double here = -normal_at(c).dot(edge), there = normal_at(far).dot(edge);
      // On a circular arc a chord leaves both tangent planes by the same angle; on a cone's ruling
      // that of the far end is zero.
      uneven += std::abs(here - there) / edge.norm();
      bent += (std::abs(here) + std::abs(there)) / edge.norm();
    }
  }
  return uneven > 0.5 * bent;
}

// Symmetric equations of a few terms, unrolled: Eigen's solvers of this size take four times as
// long. factor() leaves L and D of a = L D L^T in the lower triangle; false where columns are
// nearly dependent.
template <int Terms>
bool factor(Eigen::Matrix<double, Terms, Terms>& a) {
  const Eigen::Matrix<double, Terms, 1> diagonal = a.diagonal();
#pragma GCC unroll 9
  for (int k = 0; k < Terms; ++k) {
    if (!(a(k, k) > kLeastPivot * diagonal[k])) return false;
    const double inverse = 1 / a(k, k);
#pragma GCC unroll 9
    for (int j = k + 1; j < Terms; ++j) {
      const double share = a(j, k) * inverse;
#pragma GCC unroll 9
      for (int i = j; i < Terms; ++i) a(i, j) -= a(i, k) * share;
    }
#pragma GCC unroll 9
    for (int i = k + 1; i < Terms; ++i) a(i, k) *= inverse;
  }
  return true;
}

template <int Terms>
Eigen::Matrix<double, Terms, 1> solve(const Eigen::Matrix<double, Terms, Terms>& factors,
                                      Eigen::Matrix<double, Terms, 1> x) {
#pragma GCC unroll 9
  for (int j = 0; j < Terms; ++j)
#pragma GCC unroll 9
    for (int i = j + 1; i < Terms; ++i) x[i] -= factors(i, j) * x[j];
#pragma GCC unroll 9
  for (int j = Terms - 1; j >= 0; --j) {
    x[j] /= factors(j, j);
#pragma GCC unroll 9
    for (int i = j + 1; i < Terms; ++i) x[j] -= factors(i, j) * x[i];
  }
  return x;
}

// The normal at `origin` of the surface through it that fits the points around best. Heights over
// the tangent plane are those of circular arcs whose curvature is a quadratic form of the
// direction, z = a x + b y + (A x^2 + 2 B x y + C y^2) (x^2 + y^2 + z^2) / (2 (x^2 + y^2)), so that
// spheres are exact; with 9 terms the cubics too. False where the points do not determine it, or do
// not fit. `doubt`: the standard error of the tilt [rad]: two stations across a strip cannot tell
// tilt from curvature.
template <int Terms>
bool fit_normal(const Vec3& origin, const std::vector<Vec3>& points, Vec3& normal, double& doubt,
                double most_uneven = kMostUneven) {
  using Row = Eigen::Matrix<double, Terms, 1>;
  using Square = Eigen::Matrix<double, Terms, Terms>;
  if (points.size() < Terms + 3) return false;
  double size2 = 0;
  for (const Vec3& p : points) size2 += (p - origin).squaredNorm();
  // Distances of about one, so that one pivot threshold serves all sizes.
  const double scale = std::sqrt(double(points.size()) / size2);
  Vec3 n = normal;
  for (int round = 0; round < kNormalFits; ++round) {
    const Vec3 east = n.unitOrthogonal(), north = n.cross(east);
    Square square = Square::Zero();
    Row along = Row::Zero();
    double heights2 = 0;
    for (const Vec3& p : points) {
      const Vec3 d = scale * (p - origin);
      const double x = d.dot(east), y = d.dot(north), z = d.dot(n);
      const double flat2 = x * x + y * y, full2 = d.squaredNorm();
      // A point almost above the vertex is no neighbor on a graph over the plane.
      if (flat2 < 0.1 * full2) return false;
      // Nearer points count more: residuals are taken relative to the distance.
      const double arc = full2 / flat2, weight = 1 / full2;
      Row row;
      row.template head<5>() << x, y, arc * x * x, arc * x * y, arc * y * y;
      if constexpr (Terms == 9)
        row.template tail<4>() << x * x * x, x * x * y, x * y * y, y * y * y;
      // Normal equations, their lower triangle; unrolled, as what solves them.
      const Row weighted = weight * row;
#pragma GCC unroll 9
      for (int j = 0; j < Terms; ++j)
#pragma GCC unroll 9
        for (int i = j; i < Terms; ++i) square(i, j) += weighted[i] * row[j];
      along += weight * z * row;
      heights2 += weight * z * z;
    }
    if (!factor(square)) return false;
    const Row fit = solve(square, along);
    const double left = std::max(heights2 - fit.dot(along), kLeastLeft * heights2);
    if (round > 0 && left > most_uneven * heights2) return false;
    // The gradient of the height at the origin tilts the normal.
    n = (n - fit[0] * east - fit[1] * north).normalized();
    // What a further round would turn it by is smaller than this by as much as it is small.
    if (round + 1 < kNormalFits &&
        (round == 0 || fit.template head<2>().squaredNorm() >= kSettledTilt * kSettledTilt))
      continue;
    // The variances of the first two coefficients: what is left, over the degrees of freedom, times
    // the diagonal of the inverse.
    double variance = 0;
    for (int k = 0; k < 2; ++k) {
      const double inverse = solve(square, Row(Row::Unit(k)))[k];
      variance = std::max(variance, left / double(points.size() - Terms) * inverse);
    }
    doubt = std::sqrt(variance);
    break;
  }
  normal = n;
  return true;
}

}  // namespace

// |a x b| / (|a|^2 |b|^2).
double max_weight(const Shell& shell, int corner) {
  const Vec3 a = shell.along(corner), b = shell.point(corner_before(corner)) - shell.point(corner);
  return a.cross(b).norm() / (a.squaredNorm() * b.squaredNorm());
}

Vec3 max_normal(const Shell& shell, Span corners) {
  Vec3 sum = Vec3::Zero();
  for (const int c : corners) sum += max_weight(shell, c) * shell.topology().face_normal[c / 3];
  return sum.normalized();
}

EstimatedNormals estimate_normals(const Shell& shell, const CoplanarRegions& regions,
                                  const Faces& faces) {
  const Topology& topology = shell.topology();
  const int corners = 3 * static_cast<int>(shell.triangles().size());
  std::vector<Vec3> out(static_cast<std::size_t>(corners));
  // In order of what is known best: faces, flat or sharp facets, the dominant facets of uneven
  // fans, fits, averages.
  std::vector<Trust> trust(out.size(), Trust::Averaged);
  const auto known = [&](int c) { return faces.of_triangle(c / 3) >= 0; };
  for (int c = 0; c < corners; ++c)
    if (known(c)) out[c] = faces.normal(shell, c), trust[c] = Trust::Own;
  // Faces with normals of their own meet at a crease, whatever the angle.
  const Fans fans(shell, [&](const Edge& edge) {
    if (!edge.inner && edge.kind != EdgeClass::Smooth) return false;
    const auto [h, g] = topology.half_edges(edge);
    return !known(h) || !known(g) ||
           (out[h] - out[corner_after(g)]).norm() + (out[corner_after(h)] - out[g]).norm() <
               kSameNormal;
  });
  const int count = fans.size();
  const auto set = [&](int fan, const Vec3& normal, Trust how) {
    for (const int c : fans[fan])
      if (!known(c)) out[c] = normal, trust[c] = how;
  };
  // Largest angle [rad] from a fan's normal to those of its triangles and of the fans beside it.
  const auto spread = [&](int fan, bool beside) {
    double cosine = 1;
    for (const int c : fans[fan]) {
      cosine = std::min(cosine, out[c].dot(topology.face_normal[c / 3]));
      for (int k = 0; beside && k < 3; ++k)
        cosine = std::min(cosine, out[c].dot(out[c / 3 * 3 + k]));
    }
    return std::acos(std::clamp(cosine, -1.0, 1.0));
  };
  const auto mean = [&](int fan) { return max_normal(shell, fans[fan]); };
  for (int fan = 0; fan < count; ++fan) set(fan, mean(fan), Trust::Averaged);
  const std::vector<char> none(fans.size(), 0);
  const auto points_around = [&](int fan, const std::vector<char>& sharp) -> const auto& {
    thread_local std::vector<int> vertices;
    thread_local std::vector<Vec3> points;
    fans.vertices_around(fan, sharp, vertices);
    points.clear();
    for (int v : vertices) points.push_back(shell.vertices()[v]);
    return points;
  };
  // Whether both fits leave next to nothing and agree: an uneven sampling of a smooth surface.
  const auto fits_surely = [&](int fan) {
    const Vec3& origin = shell.point(*fans[fan].first);
    const std::vector<Vec3>& points = points_around(fan, none);
    Vec3 quadratic = out[*fans[fan].first], cubic = quadratic;
    double doubt;
    return fit_normal<5>(origin, points, quadratic, doubt, kLittle) &&
           fit_normal<9>(origin, points, cubic, doubt, kLittle) &&
           quadratic.cross(cubic).norm() <= kSurelyAlike * spread(fan, false);
  };
  // Takes the normals of the faces in a fan over: the one that a facet has too, else their mean.
  const auto take_over = [&](int fan) {
    Vec3 sum = Vec3::Zero();
    const Span all = fans[fan];
    for (const int c : all)
      if (known(c)) sum += out[c];
    if (sum.isZero(0)) return false;
    sum.normalize();
    for (const int c : all) {
      if (known(c)) continue;
      const Vec3& own = topology.face_normal[c / 3];
      const bool alike = std::any_of(all.first, all.last, [&](int d) {
        return known(d) && (out[d] - own).squaredNorm() < kSameNormal * kSameNormal;
      });
      out[c] = !alike && sum.dot(own) > std::cos(kTakesOver) ? sum : own;
      trust[c] = Trust::Limited;
    }
    return true;
  };
  // What is flat or sharp (its triangles spread more than creases may) keeps its triangles' own. No
  // fit looks past what is sharp, a face, or limited.
  const Dominance dominance(shell, regions);
  std::vector<char> settled(none), sharp(none);
  const auto plain = [&](int c) { return known(c) ? out[c] : mean(fans.of(c)); };
  for (int fan = 0; fan < count; ++fan) {
    const Span all = fans[fan];
    if (take_over(fan)) {
      settled[fan] = sharp[fan] = 1;
      continue;
    }
    const double angle = spread(fan, false), limit = shell.crease_angle();
    // The normal leans over the crease angle from one of its triangles.
    sharp[fan] = angle > limit || (angle > limit / 2 && is_cone_apex(shell, plain, all));
    settled[fan] = sharp[fan] || std::all_of(all.first, all.last, [&](int c) {
                     return topology.planar_face[c / 3] == topology.planar_face[*all.first / 3];
                   });
    Vec3 normal;
    double ratio;
    if (settled[fan]) {
      for (const int c : all) out[c] = topology.face_normal[c / 3], trust[c] = Trust::Facet;
    } else if (dominance.normal(all, normal, ratio) &&
               (ratio > kMostUnevenHeights || !fits_surely(fan))) {
      set(fan, normal, Trust::Limited);
      settled[fan] = sharp[fan] = 1;
    }
  }
  LargeArray<Vec3> fitted(fans.size());  // zero where none is trusted; taken when all are done
  const auto fit = [&](int fan) {
    const Vec3& origin = shell.point(*fans[fan].first);
    const std::vector<Vec3>& at = points_around(fan, sharp);
    const Vec3 own = out[*fans[fan].first];
    Vec3 quadratic = own, cubic = own;
    // Two models of different order: where both fit and agree the points determine the normal.
    double doubt;
    const double wide = spread(fan, true), most = kMostDoubt * wide + kSettledTilt;
    const bool fits = fit_normal<5>(origin, at, quadratic, doubt) && doubt <= most;
    const bool fits_better = fit_normal<9>(origin, at, cubic, doubt) && doubt <= most;
    const auto agree = [](const Vec3& a, const Vec3& b, double angle) {
      return a.cross(b).norm() <= kSmallTurn + angle;
    };
    // Two fits that agree are right. One alone has to stay close to the triangles; seen from one
    // side only, a normal may lie somewhat beyond them.
    const bool open = topology.vertex_sharp[shell.vertex(*fans[fan].first)];
    if (fits && fits_better ? agree(quadratic, cubic, kLikely * wide)
                            : fits_better && agree(cubic, own, kLikely * spread(fan, false)))
      fitted[fan] = cubic;
    else if (fits && !fits_better &&
             agree(quadratic, own, open ? 1.1 * wide : kLikely * spread(fan, false)))
      fitted[fan] = quadratic;
  };
  for_each_in_parallel(static_cast<std::size_t>(count), [&](std::size_t fan) {
    fitted[fan].setZero();
    if (!settled[fan]) fit(static_cast<int>(fan));
  });
  for (int fan = 0; fan < count; ++fan)
    if (!fitted[fan].isZero(0)) set(fan, fitted[fan], Trust::Fitted);
  return {std::move(out), std::move(trust), false};
}

bool estimated_elsewhere(const Shell& shell, const std::vector<Vec3>& given) {
  const Topology& topology = shell.topology();
  const auto alike = [&](int i, int j) { return (given[i] - given[j]).norm() <= kSameNormal; };
  const Fans fans(shell, [&](const Edge& edge) {
    const auto [h, g] = topology.half_edges(edge);
    return alike(h, corner_after(g)) && alike(corner_after(h), g);
  });
  // Means over edges beyond the crease angle, as on a coarse ball, are better than none.
  int within = 0, beyond = 0;
  for (const Edge& edge : topology.edges) {
    const double turn = std::abs(shell.angle(edge));
    within += turn > kSameNormal && edge.kind == EdgeClass::Smooth;
    beyond += turn < kSurelySharp && edge.kind == EdgeClass::Crease;
  }
  return beyond <= within && are_means(shell, fans, given);
}

EstimatedNormals settle_given_normals(const Shell& shell, const std::vector<Vec3>& given,
                                      Faces& faces) {
  std::vector<char> contradicted(faces.shapes.size(), 0);
  const int corners = static_cast<int>(given.size());
  for (int c = 0; c < corners; ++c) {
    const int face = faces.of_triangle(c / 3);
    if (face >= 0 && (faces.normal(shell, c) - given[c]).norm() > kContradiction)
      // One corner is enough: the face is given up as a whole.
      contradicted[face] = 1;
  }
  faces.give_up(contradicted);
  EstimatedNormals out{given, std::vector<Trust>(given.size(), Trust::Own), true};
  for (int c = 0; c < corners; ++c)
    if (faces.of_triangle(c / 3) >= 0) out.normals[c] = faces.normal(shell, c);
  return out;
}

}  // namespace sphshell
