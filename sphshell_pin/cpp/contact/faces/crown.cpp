#include "contact/faces/crown.hpp"

#include "contact/faces/shares.hpp"

namespace sphshell {

constexpr double kRadius = 1e3;  // R over the size of the shell
constexpr double kRidge = 1e-4;  // e over its square
constexpr double kOn = 1e-7;     // what lies on a face, as a share of the size

const Vec3 kUp = Vec3::UnitZ();

// Of a point that the shell carries, by its displacement.
static Matrix36 carried(const Vec3& point) {
  Matrix36 out;
  out << Mat3::Identity(), -cross_matrix(point);
  return out;
}

double SharedContact::spread() const {
  double sum = 0;
  for (const Place& place : places) sum += place.share * (place.point - point).squaredNorm();
  return sum;
}

// A circle round a face is at most as wide as the shell.
double Crown::height(const Flats& flats) {
  return flats.any() ? flats.size * (1 + kRidge) / (2 * kRadius) : 0;
}

bool Crown::share(const Shell& shell, const Flats& flats, const Mat3& turn, const Vec3& at,
                  const Contact& deepest, SharedContact& out) {
  out.facet = deepest.facet, out.index = deepest.index;
  for (const Flats::Disc& disc : flats.discs)
    if (share_disc(flats, disc, turn, at, deepest, out)) return true;
  const double size = flats.size, near = kOn * size;
  const Vec3 lowest = deepest.point - deepest.depth * kUp;
  for (const Flats::Ruled& ruled : flats.ruled) {
    // The lowest points of both circles, C - r e with e along the part of `up` across the axis.
    const Vec3 axis = turn * ruled.axis, across = kUp - axis.z() * axis;
    const double sine = across.norm();
    if (!(sine > kOn)) continue;
    const Vec3 down = -across / sine;
    // By a turn the axis moves by turn x axis.
    const Mat3 down_by = (Mat3::Identity() - down * down.transpose()) / sine *
                         (axis * kUp.transpose() + axis.z() * Mat3::Identity()) *
                         -cross_matrix(axis);
    candidates_.clear();
    for (int k : {0, 1}) {
      const Vec3 center = turn * ruled.center[k] + at;
      Matrix36 by = carried(center);
      by.rightCols<3>() += ruled.radius[k] * down_by;
      add(-1, center + ruled.radius[k] * down, by);
    }
    const Vec3 line = candidates_[1].point - candidates_[0].point;
    const double along = (lowest - candidates_[0].point).dot(line) / line.squaredNorm();
    const double off = (lowest - candidates_[0].point - std::clamp(along, 0.0, 1.0) * line).norm();
    if (off < near && solve(flats, out)) return true;
  }
  // Of a vertex, or of the side that lies level.
  candidates_.clear();
  const Triangle& triangle = shell.triangles()[shell.triangle_of_facet(deepest.facet)];
  for (const int v : triangle) {
    if (deepest.feature == Feature::Vertex && v != triangle[deepest.index]) continue;
    for (const int number : flats.of_vertex[v])
      for (const int corner : flats.polygons[number]) {
        const Vec3 point = turn * shell.vertices()[corner] + at;
        if (-point.z() < deepest.depth - height(flats)) continue;
        add(corner, point, carried(point));
      }
  }
  return candidates_.size() > 1 && solve(flats, out);
}

void Crown::add(int vertex, const Vec3& point, const Matrix36& point_by) {
  for (const Candidate& one : candidates_)
    if (vertex >= 0 && one.vertex == vertex) return;
  candidates_.push_back({vertex, point, point_by, Vec3::Zero(), 0});
}

// All of a circle has a share, in closed form: of the crowned face the lowest point is R times the
// tilt from its center. Its places are about that, as far as those of the circle in the mean.
bool Crown::share_disc(const Flats& flats, const Flats::Disc& disc, const Mat3& turn,
                       const Vec3& at, const Contact& deepest, SharedContact& out) const {
  const double radius = kRadius * flats.size, near = kOn * flats.size;
  const Vec3 axis = turn * disc.axis, across = kUp - axis.z() * axis;
  const Vec3 lean = -radius * across;
  const double left = disc.radius * disc.radius - lean.squaredNorm();
  if (!(left > 0)) return false;
  const Vec3 center = turn * disc.center + at;
  const Vec3 lowest = deepest.point - deepest.depth * kUp;
  if (std::abs(disc.radius * across.norm() - center.z() - deepest.depth) > near ||
      (lowest - center).norm() > disc.radius + near)
    return false;
  // By a turn the axis moves by turn x axis.
  const Vec3 upright_by = axis.cross(kUp);  // of axis.z()
  const Mat3 lean_by = radius * (axis * upright_by.transpose() - axis.z() * cross_matrix(axis));
  Matrix36 mean_by = carried(center);
  mean_by.rightCols<3>() += lean_by;
  out.depth = -center.z() + (lean.squaredNorm() + disc.radius * disc.radius) / (2 * radius);
  out.depth_by = -carried(center + lean).row(2);
  out.point = center + lean;
  const double arm = std::sqrt(left);
  const Vec3 arm_by = radius * radius * axis.z() / arm * upright_by;
  out.places.clear();
  for (const Vec3& side : {disc.east, disc.north})
    for (const double sign : {1.0, -1.0}) {
      const Vec3 way = sign * (turn * side);
      Matrix36 by = mean_by;
      by.rightCols<3>() += way * arm_by.transpose() - arm * cross_matrix(way);
      out.places.push_back({out.point + arm * way, 0.25, by, Row6::Zero()});
    }
  return true;
}

// The places that touch are those that have a share.
bool Crown::solve(const Flats& flats, SharedContact& out) {
  const double radius = kRadius * flats.size, ridge = kRidge * flats.size * flats.size;
  std::vector<Candidate>& all = candidates_;
  const auto deepest = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.point.z() < b.point.z();
  });
  const Vec3 first = deepest->point;
  for (Candidate& one : all) {
    one.from = one.point - first;
    one.lead = -radius * one.from.z() + one.from.squaredNorm() / 2;
  }
  Shares<Candidate> shares(all, ridge);
  shares.maximize(*deepest);
  const auto is_active = [](const Candidate& one) { return one.active; };
  if (std::count_if(all.begin(), all.end(), is_active) < 2) return false;
  Vec3 mean = Vec3::Zero();
  double rise = 0, squares = 0;
  out.places.clear(), out.depth_by.setZero();
  for (const Candidate& one : all) {
    if (!one.active) continue;
    mean += one.share * one.from;
    rise += one.share * one.lead, squares += one.share * one.share;
    out.depth_by -= one.share * one.point_by.row(2);
    out.places.push_back({one.point, one.share, one.point_by, Row6::Zero()});
  }
  out.point = first + mean;
  out.depth = -first.z() + (rise + (ridge * (1 - squares) - mean.squaredNorm()) / 2) / radius;
  // Distances between the places stay as they are: only the depths change.
  for (int column = 0; column < 6; ++column) {
    shares.follow([&](const Candidate& one) { return -radius * one.point_by(2, column); });
    auto place = out.places.begin();
    for (const Candidate& one : all)
      if (one.active) (place++)->share_by[column] = one.solution;
  }
  return true;
}

}  // namespace sphshell
