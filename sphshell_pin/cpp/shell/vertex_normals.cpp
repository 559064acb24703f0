#include "shell/vertex_normals.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "shell/fans.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {
namespace {

// A fit leaves at most this share of the squared heights: what curves more unevenly is noise, or
// the end of a fillet.
constexpr double kMostUneven = 0.1;
// Smallest pivot of the scaled normal equations: below, the points do not tell the terms apart.
constexpr double kLeastPivot = 1e-6;
// A tilt of the frame that settles it [rad].
constexpr double kSettledTilt = 1e-7;
// Normals agree within this angle [rad] and share of the spread of the normals around.
constexpr double kSmallTurn = 0.005, kLikely = 0.25;
// Edges are long beyond this many times those that lead on from them: surely, and where no fit says
// otherwise.
constexpr double kFarLonger = 4, kLonger = 2.5;

// Where a long edge of a fan bends that goes on in short ones only, the normal is turned upright on
// it. Max's would make a wall bulge that ends in a fillet; but a tessellation has long edges where
// its surface is flat along them. False where there is none.
bool straighten_wall(const Shell& shell, const int* begin, const int* end, double longer,
                     Vec3& normal) {
  std::vector<Vec3> edges;
  for (const int* c = begin; c != end; ++c) {
    const Triangle& t = shell.triangles()[*c / 3];
    const Vec3& origin = shell.vertices()[t[*c % 3]];
    for (int k : {next_corner(*c % 3), previous_corner(*c % 3)})
      edges.push_back(shell.vertices()[t[k]] - origin);
  }
  const auto slope = [&](const Vec3& edge) { return std::abs(edge.dot(normal)) / edge.norm(); };
  double steepest = 0;
  for (const Vec3& edge : edges) steepest = std::max(steepest, slope(edge));
  Vec3 along = Vec3::Zero();
  for (const Vec3& edge : edges) {
    double onward = 0;
    for (const Vec3& other : edges)
      if (other.dot(edge) < -0.5 * other.norm() * edge.norm())
        onward = std::max(onward, other.norm());
    if (slope(edge) > 0.5 * steepest && onward > 0 && longer * onward < edge.norm() &&
        along.dot(edge) >= 0)
      along += edge;
  }
  if (along.isZero(0)) return false;
  along.normalize();
  normal = (normal - normal.dot(along) * along).normalized();
  return true;
}

// True where the surface falls away from a fan's vertex along straight lines, as from the tip of a
// cone: seen from the vertices around it does not bend that much.
bool is_cone_apex(const Shell& shell, const std::vector<Vec3>& normals, const int* begin,
                  const int* end) {
  double uneven = 0, bent = 0;
  for (const int* c = begin; c != end; ++c) {
    const int t = *c / 3, k = *c % 3;
    const Triangle& triangle = shell.triangles()[t];
    for (int far : {next_corner(k), previous_corner(k)}) {
      const Vec3 edge = shell.vertices()[triangle[far]] - shell.vertices()[triangle[k]];
      const double here = -normals[*c].dot(edge), there = normals[3 * t + far].dot(edge);
      uneven += std::abs(here - there) / edge.norm();
      bent += (std::abs(here) + std::abs(there)) / edge.norm();
    }
  }
  return uneven > 0.5 * bent;
}

// The normal at `origin` of the surface through it that fits the points around best. Heights over
// the tangent plane are those of circular arcs whose curvature is a quadratic form of the
// direction, z = a x + b y + (A x^2 + 2 B x y + C y^2) (x^2 + y^2 + z^2) / (2 (x^2 + y^2)), so that
// spheres are exact; with 9 terms the cubics too. False where the points do not determine it, or do
// not fit.
template <int Terms>
bool fit_normal(const Vec3& origin, const std::vector<Vec3>& points, Vec3& normal) {
  using Row = Eigen::Matrix<double, Terms, 1>;
  using Square = Eigen::Matrix<double, Terms, Terms>;
  if (points.size() < Terms + 3) return false;
  double size2 = 0;
  for (const Vec3& p : points) size2 += (p - origin).squaredNorm();
  const double scale = std::sqrt(double(points.size()) / size2);
  Vec3 n = normal;
  // The frame turns with the normal: a few rounds settle both.
  for (int round = 0; round < 3; ++round) {
    const Vec3 east = n.unitOrthogonal(), north = n.cross(east);
    Square square = Square::Zero();
    Row along = Row::Zero();
    double heights2 = 0;
    for (const Vec3& p : points) {
      const Vec3 d = scale * (p - origin);
      const double x = d.dot(east), y = d.dot(north), z = d.dot(n);
      const double flat2 = x * x + y * y, full2 = d.squaredNorm();
      if (flat2 < 0.1 * full2) return false;
      const double arc = full2 / flat2, weight = 1 / full2;
      Row row;
      row.template head<5>() << x, y, arc * x * x, arc * x * y, arc * y * y;
      if constexpr (Terms == 9)
        row.template tail<4>() << x * x * x, x * x * y, x * y * y, y * y * y;
      square.noalias() += weight * row * row.transpose();
      along += weight * z * row;
      heights2 += weight * z * z;
    }
    // Columns scaled alike, so that the pivots tell how nearly dependent they are.
    const Row size = square.diagonal().cwiseSqrt();
    if (!(size.minCoeff() > 0)) return false;
    const Eigen::LDLT<Square> solver(size.cwiseInverse().asDiagonal() * square *
                                     size.cwiseInverse().asDiagonal());
    if (!(solver.vectorD().cwiseAbs().minCoeff() > kLeastPivot)) return false;
    const Row fit = solver.solve(along.cwiseQuotient(size)).cwiseQuotient(size);
    if (round > 0 && heights2 - fit.dot(along) > kMostUneven * heights2) return false;
    n = (n - fit[0] * east - fit[1] * north).normalized();
    // What a further round would turn it by is smaller than this by as much as it is small.
    if (round > 0 && fit.template head<2>().squaredNorm() < kSettledTilt * kSettledTilt) break;
  }
  normal = n;
  return true;
}

}  // namespace

Vec3 max_normal(const Shell& shell, const int* begin, const int* end) {
  Vec3 sum = Vec3::Zero();
  for (const int* c = begin; c != end; ++c) {
    const Triangle& t = shell.triangles()[*c / 3];
    const int k = *c % 3;
    const std::vector<Vec3>& p = shell.vertices();
    const Vec3 a = p[t[next_corner(k)]] - p[t[k]], b = p[t[previous_corner(k)]] - p[t[k]];
    const double weight = a.cross(b).norm() / (a.squaredNorm() * b.squaredNorm());
    sum += weight * shell.topology().face_normal[*c / 3];
  }
  return sum.normalized();
}

std::vector<Vec3> estimate_normals(const Shell& shell) {
  const Topology& topology = shell.topology();
  const Fans fans(shell,
                  [](const Edge& edge) { return edge.inner || edge.kind == EdgeClass::Smooth; });
  const int count = fans.size();
  std::vector<Vec3> normals(static_cast<std::size_t>(count));
  const auto set = [&](std::vector<Vec3>& to, int fan, const Vec3& normal) {
    for (const int* c = fans.begin(fan); c != fans.end(fan); ++c) to[*c] = normal;
  };
  for (int fan = 0; fan < count; ++fan)
    if (fans.begin(fan) != fans.end(fan))
      set(normals, fan, max_normal(shell, fans.begin(fan), fans.end(fan)));
  // Largest angle [rad] from a fan's normal to those of its triangles and of the fans beside it.
  const auto spread = [&](int fan, bool beside) {
    double cosine = 1;
    for (const int* c = fans.begin(fan); c != fans.end(fan); ++c) {
      cosine = std::min(cosine, normals[*c].dot(topology.face_normal[*c / 3]));
      for (int k = 0; beside && k < 3; ++k)
        cosine = std::min(cosine, normals[*c].dot(normals[*c / 3 * 3 + k]));
    }
    return std::acos(std::clamp(cosine, -1.0, 1.0));
  };
  // What is flat or sharp (its triangles spread more than creases may) keeps its triangles' own.
  std::vector<Vec3> out = normals;
  std::vector<char> settled(out.size(), 0), sharp(out.size(), 0);
  for (int fan = 0; fan < count; ++fan) {
    const int *begin = fans.begin(fan), *end = fans.end(fan);
    const double angle = spread(fan, false), limit = shell.crease_angle();
    sharp[fan] = angle > limit || (angle > limit / 2 && is_cone_apex(shell, normals, begin, end));
    settled[fan] = sharp[fan] || std::all_of(begin, end, [&](int c) {
                     return topology.planar_face[c / 3] == topology.planar_face[*begin / 3];
                   });
    if (settled[fan])
      for (const int* c = begin; c != end; ++c) out[*c] = topology.face_normal[*c / 3];
    Vec3 normal = normals[fan];
    if (!settled[fan] && straighten_wall(shell, begin, end, kFarLonger, normal)) {
      set(out, fan, normal);
      settled[fan] = 1;
    }
  }
  normals = out;
  const auto fit = [&](int fan, std::vector<int>& around, std::vector<Vec3>& points) {
    fans.vertices_around(fan, sharp, around);
    points.clear();
    for (int v : around) points.push_back(shell.vertices()[v]);
    const Vec3& origin = shell.vertices()[fans.vertex(*fans.begin(fan))];
    const Vec3& plain = normals[fan];
    Vec3 quadratic = plain, cubic = plain;
    const bool fits = fit_normal<5>(origin, points, quadratic);
    const bool fits_better = fit_normal<9>(origin, points, cubic);
    const auto agree = [](const Vec3& a, const Vec3& b, double angle) {
      return a.cross(b).norm() <= kSmallTurn + angle;
    };
    // Two fits that agree are right. One alone has to stay close to the triangles; seen from one
    // side only, a normal may lie somewhat beyond them.
    const bool open = topology.vertex_sharp[fans.vertex(*fans.begin(fan))];
    Vec3 normal = plain;
    if (fits && fits_better ? agree(quadratic, cubic, kLikely * spread(fan, true))
                            : fits_better && agree(cubic, plain, kLikely * spread(fan, false)))
      normal = cubic;
    else if (fits && !fits_better &&
             agree(quadratic, plain, open ? 1.1 * spread(fan, true) : kLikely * spread(fan, false)))
      normal = quadratic;
    else
      straighten_wall(shell, fans.begin(fan), fans.end(fan), kLonger, normal);
    set(out, fan, normal);
  };
  in_parallel(static_cast<std::size_t>(count), kAllCores, kGrain,
              [&](std::size_t begin, std::size_t end) {
                std::vector<int> around;
                std::vector<Vec3> points;
                for (std::size_t fan = begin; fan < end; ++fan)
                  if (!settled[fan]) fit(static_cast<int>(fan), around, points);
              });
  return out;
}

}  // namespace sphshell
