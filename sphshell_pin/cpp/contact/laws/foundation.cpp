#include "contact/laws/foundation.hpp"

#include "contact/laws/cell_quadrature.hpp"
#include "contact/query/tolerances.hpp"

namespace sphshell {

// What one quadrature point adds: x relative to the center, `area` its area vector.
// p = (R^2 - rho^2) / (2 rho) over kappa; the energy by the divergence theorem is an integral over
// the surface as well, see FoundationSum.
static void add_point(const Vec3& x, const Vec3& area, double radius2, bool slopes,
                      FoundationSum& sum) {
  const double rho2 = x.squaredNorm(), over = 1 / std::sqrt(rho2), inside = radius2 - rho2;
  const double p = inside * over / 2, size = area.norm();
  sum.force += p * area;
  sum.energy -= inside * inside / 8 * over * over * over * x.dot(area);
  sum.pressure += p * size;
  sum.first += p * size * x;
  if (!slopes) return;
  // -p' u, with p' = -(R^2 / rho^2 + 1) / 2.
  sum.slope += area * ((radius2 * over * over + 1) / 2 * over * x).transpose();
}

// A triangle as a cubic patch, so that one quadrature serves both.
static CubicPatch flat_patch(const Vec3 (&corner)[3]) {
  CubicPatch out;
  for (Vec3* c : {&out.c20, &out.c11, &out.c02, &out.c30, &out.c21, &out.c12, &out.c03})
    c->setZero();
  out.c00 = corner[0], out.c10 = corner[1] - corner[0], out.c01 = corner[2] - corner[0];
  return out;
}

Vec3 FoundationRow::normal() const {
  const double length = sum.force.norm();
  return length > 0 ? Vec3(sum.force / length) : Vec3::UnitZ();
}

// A ball moves little from call to call: the broad phase follows it.
Foundation::Foundation() : broad_(true) {
  rows_.reserve(16);
  points_.reserve(4096);
  counted_.reserve(256);
}

// One row a patch; few are in reach at once, so a search in order is enough.
FoundationRow& Foundation::row_of(int patch, int sheet, int element) {
  for (FoundationRow& row : rows_)
    if (row.patch == patch) return row;
  rows_.push_back({patch, sheet, element, 0, Vec3::Zero(), {}});
  return rows_.back();
}

// Where a sheet ends the potential has, by Stokes' theorem, the line integral of q dl x u as well,
// q = -(R^2 - rho^2)^2 / (8 rho^2).
void Foundation::add_rim(const CubicCurve& side, double radius, FoundationRow& row, bool points) {
  const double radius2 = radius * radius;
  const int number = static_cast<int>(&row - rows_.data());
  const Vec3 b0 = side.c0, b1 = b0 + side.c1 / 3, b3 = side.point(1), b2 = b3 - side.tangent(1) / 3;
  const Sextic along(b0, b1, b2, b3, radius2);
  double t[8];
  int count = 0;
  along.roots(0, 1, 0, t, count);
  t[count] = 1;
  const GaussRule& rule = gauss_rule(8);
  // Between the roots of rho^2 = R^2 the side is inside and outside in turn.
  bool inside = along.f[0] < 0;
  double from = 0;
  for (int i = 0; i <= count; ++i, inside = !inside) {
    const double to = t[i];
    if (inside) {
      const double length = (side.point(to) - side.point(from)).norm();
      const double near = std::min(
          {side.point(from).norm(), side.point((from + to) / 2).norm(), side.point(to).norm()});
      // q is steep near the center: panels are no longer than half the distance from it.
      const int panels = std::clamp(static_cast<int>(std::ceil(2 * length / near)), 1, 24);
      for (int panel = 0; panel < panels; ++panel)
        for (int j = 0; j < rule.size; ++j) {
          const double s = from + (panel + rule.nodes[j]) / panels * (to - from);
          const Vec3 x = side.point(s),
                     d = side.tangent(s) * (rule.weights[j] * (to - from) / panels);
          const double rho2 = x.squaredNorm(), rho = std::sqrt(rho2), left = radius2 - rho2;
          // g = q / rho, and g' / rho.
          const double g = -left * left / (8 * rho2 * rho);
          const double slope = left / (2 * rho2 * rho) + 3 * left * left / (8 * rho2 * rho2 * rho);
          const Vec3 line = d.cross(x);
          row.sum.force += g * line;
          row.sum.slope -= slope * line * x.transpose() + g * cross_matrix(d);
          if (points) points_.push_back({x, Vec3::Zero(), 0, 0, g * line, number});
        }
    }
    from = to;
  }
}

void Foundation::find(const Shell& shell, Method method, const Vec3& center, double radius,
                      bool slopes, bool points) {
  rows_.clear();
  points_.clear();
  counted_.clear();
  const CurvedShell* curved = method == Method::Smooth ? shell.curved() : nullptr;
  const double bulge = curved ? curved->bulge() : 0, radius2 = radius * radius;
  const LargeArray<NormalCone>& cones = curved ? curved->cones() : shell.cones();
  // No tolerance: the border of the overlap bears no pressure.
  const Sphere sphere{center, radius, 0};
  broad_.find(shell, cones, bulge, sphere);
  const Sheets& sheets = shell.sheets();
  const Vec3 local = center - shell.origin();
  // Friction is less smooth than pressure.
  const int least_order = points ? 6 : 3;
  for (int f : broad_.overlapping) {
    const NormalCone& cone = cones[f];
    const Vec3 middle(cone.middle[0], cone.middle[1], cone.middle[2]);
    // By the ball around the facet, in single precision: see BroadPhase.
    const double most = radius + 1.00001 * cone.reach + 1e-6 * (shell.size() + radius);
    if ((local - middle).squaredNorm() > most * most) continue;
    const Facet& facet = shell.facets()[f];
    const int triangle = shell.triangle_of_facet(f);
    const Vec3 corner[3] = {facet.corner[0] - center, facet.corner[1] - center,
                            facet.corner[2] - center};
    const bool flat = !curved || curved->facets()[f].flat;
    const int patch = shell.topology().patch[facet.element];
    FoundationSum sum;
    const std::size_t first_point = points_.size();
    const auto visit = [&](const Vec3& x, const Vec3& area, double weight) {
      const Vec3 part = weight * area;
      if (!flat) add_point(x, part, radius2, slopes, sum);
      if (!points) return;
      const double size = area.norm(), rho = x.norm();
      const double p = (radius2 - rho * rho) / (2 * rho);
      points_.push_back({x, area / size, weight * size, p, p * part, 0});
    };
    if (flat) {
      if (!add_flat_facet(corner, facet.normal, radius, sum)) continue;
      if (points) {
        CellQuadrature(flat_patch(corner), FacetAxes(facet), BallRegion(radius), least_order)
            .run(visit);
        // The closed form is exact, its points are not: factors of their areas that are linear in
        // the place, from the middle, give them its force and its center.
        double found = 0;
        Vec3 first = Vec3::Zero();
        Mat3 second = Mat3::Zero();
        const Vec3 middle = sum.first / std::max(sum.pressure, 1e-300);
        for (std::size_t i = first_point; i < points_.size(); ++i) {
          const Vec3 from = points_[i].point - middle;
          const double push = points_[i].area * points_[i].pressure;
          found += push, first += push * from, second += push * from * from.transpose();
        }
        const double size = second.trace(), sum_pressure = sum.pressure;
        Vec3 tilt = Vec3::Zero();
        double share = 0;
        if (found > 0 && size > 0) {
          // Across the plane, and a needle, the moments are next to zero: the matrix is made
          // regular.
          const Mat3 spread =
              second - first * first.transpose() / found + 1e-9 * size * Mat3::Identity();
          tilt = -sum_pressure / found * spread.inverse() * first;
          share = (sum_pressure - tilt.dot(first)) / found;
        }
        for (std::size_t i = first_point; i < points_.size(); ++i) {
          points_[i].area *= share + tilt.dot(points_[i].point - middle);
          points_[i].normal = facet.normal;
          points_[i].force = points_[i].area * points_[i].pressure * facet.normal;
        }
      }
    } else {
      CubicPatch relative = curved->facets()[f].patch(facet);
      relative.c00 -= center;
      const FacetAxes axes(facet);
      CellQuadrature(relative, axes, BallRegion(radius), least_order).run(visit);
    }
    // Less is round-off.
    if (!(sum.pressure > kRoundOff * radius * radius2)) {
      points_.erase(points_.begin() + first_point, points_.end());
      continue;
    }
    FoundationRow& row = row_of(patch, sheets.sheet[triangle], facet.element);
    const int number = static_cast<int>(&row - rows_.data());
    for (std::size_t i = first_point; i < points_.size(); ++i) points_[i].row = number;
    row.sum.add(sum);
    // A curved facet may be nearer than its flat one by the bulge: its depth is found later, if it
    // can matter.
    const Vec3 nearest = closest_on_triangle(Vec3::Zero(), corner, facet.normal).point;
    if (!flat)
      counted_.push_back({f, number, nearest.norm() - curved->cells()[f].bulge});
    else if (radius - nearest.norm() > row.depth)
      row.depth = radius - nearest.norm(), row.element = facet.element,
      row.away = -nearest.normalized();
    for (int k = 0; k < 3; ++k) {
      // Bit k: side k is a border of its sheet.
      if (!(sheets.rim[triangle] >> k & 1)) continue;
      CubicCurve side{corner[k], corner[next_corner(k)] - corner[k], Vec3::Zero(), Vec3::Zero()};
      if (!flat) {
        side = curved->facets()[f].side(facet, k);
        side.c0 -= center;
      }
      add_rim(side, radius, row, points);
    }
  }
  if (!counted_.empty()) find_depths(shell, center, radius);
  finish(shell, center, radius);
}

// The depth of a row is that of its closest point: first in the facet where it is most likely, then
// wherever it may be deeper.
void Foundation::find_depths(const Shell& shell, const Vec3& center, double radius) {
  const CurvedShell& curved = *shell.curved();
  const auto look = [&](const Counted& at) {
    FoundationRow& row = rows_[at.row];
    // No closer than what the row has already.
    if (at.nearest >= radius - row.depth) return;
    const Facet& facet = shell.facets()[at.facet];
    const CurvedFacet& bent = curved.facets()[at.facet];
    Nearest found{Feature::Face, 0, 0.0, {}};
    const auto start = closest_on_facet(facet, center);
    if (!find_minimum(bent.patch(facet), Sphere{center, 0, 0}, start, found.at) &&
        !find_nearest(facet, bent, curved.cells()[at.facet], center, radius - row.depth, found))
      return;
    const double depth = radius - (found.at.point - center).norm();
    if (depth <= row.depth) return;
    row.depth = depth, row.element = facet.element;
    row.away = (center - found.at.point).normalized();
  };
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const Counted* best = nullptr;
    for (const Counted& at : counted_)
      if (at.row == static_cast<int>(k) && (!best || at.nearest < best->nearest)) best = &at;
    if (best) look(*best);
  }
  for (const Counted& at : counted_) look(at);
}

// Turns the sheets, and brings the rows into their order.
void Foundation::finish(const Shell& shell, const Vec3& center, double radius) {
  const Sheets& sheets = shell.sheets();
  for (FoundationRow& row : rows_)
    // Center of pressure; the quadrature is about the ball's center.
    row.center = center + row.sum.first / std::max(row.sum.pressure, 1e-300);
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    const int sheet = rows_[i].sheet;
    const bool first = std::none_of(rows_.begin(), rows_.begin() + i,
                                    [&](const FoundationRow& r) { return r.sheet == sheet; });
    if (!first) continue;
    double energy = 0;
    for (const FoundationRow& row : rows_)
      if (row.sheet == sheet) energy += row.sum.energy;
    // Without a stated side the orientation is the one in which the energy is positive.
    const bool turned = shell.side() == Side::Both ? energy < 0 : shell.side() == Side::Inside;
    // From behind a closed shell the solid angle is less by a full one.
    const bool behind = sheets.closed[sheet] && (turned ? energy > 0 : energy < 0);
    if (behind) rows_[i].sum.energy += (turned ? -1 : 1) * M_PI / 2 * std::pow(radius, 4);
    if (!turned) continue;
    for (std::size_t k = 0; k < rows_.size(); ++k) {
      if (rows_[k].sheet != sheet) continue;
      rows_[k].sum.force *= -1, rows_[k].sum.energy *= -1, rows_[k].sum.slope *= -1;
      for (FoundationPoint& point : points_)
        if (point.row == static_cast<int>(k)) point.normal *= -1, point.force *= -1;
    }
  }
  for (FoundationPoint& point : points_) point.point += center;
}

void Foundation::find_on_ball(double ball, const Vec3& center, double radius, bool points) {
  rows_.clear();
  points_.clear();
  // e: distance of the centers; rho from near to far: points of the ball inside the sphere. Of
  // equal centers there is no direction.
  const double e = center.norm(), R2 = radius * radius, E = e * e + ball * ball;
  const double near = std::abs(e - ball), far = std::min(radius, e + ball);
  if (!(near < far) || e == 0) return;
  const Vec3 axis = center / e;
  // Rings at a distance rho: dA = 2 pi ball rho d(rho) / e, and polynomials of degree 4.
  const GaussRule& rule = gauss_rule(points ? 8 : 3);
  double pushed = 0, turned = 0, energy = 0;
  FoundationSum sum;
  Vec3 across = axis.unitOrthogonal(), third = axis.cross(across);
  constexpr int kRound = 16;
  for (int i = 0; i < rule.size; ++i) {
    const double rho = near + rule.nodes[i] * (far - near), w = rule.weights[i] * (far - near);
    const double left = R2 - rho * rho, area = 2 * M_PI * ball * rho / e * w;
    const double p = left / (2 * rho), cosine = (E - rho * rho) / (2 * e * ball);
    pushed += w * left * (E - rho * rho);
    turned += w * left;
    const double lens = ball * ball - (e - rho) * (e - rho);
    energy += w * left / 2 * M_PI * lens / e;
    sum.pressure += p * area;
    sum.first += p * area * (ball * cosine - e) * axis;
    for (int k = 0; points && k < kRound; ++k) {
      const double turn = 2 * M_PI * (k + 0.5) / kRound,
                   sine = std::sqrt(std::max(0.0, 1 - cosine * cosine));
      const Vec3 n = cosine * axis + sine * (std::cos(turn) * across + std::sin(turn) * third);
      points_.push_back({ball * n, n, area / kRound, p, p * area / kRound * n, 0});
    }
  }
  // By symmetry the force is along the line of centers, a polynomial in rho.
  const double force = M_PI / (2 * e * e) * pushed;
  // Leibniz: the bounds near and far move with e.
  const double ends = (R2 - far * far) * (E - far * far) -
                      (e < ball ? -1 : 1) * (R2 - near * near) * (E - near * near);
  const double slope = -2 * force / e + M_PI / (2 * e * e) * (2 * e * turned + ends);
  if (e < ball) {
    // The center inside the ball: a full ball of radius r overlaps as well.
    const double r = std::min(radius, ball - e);
    energy += M_PI * (R2 * r * r - r * r * r * r / 2);
  }
  sum.force = force * axis;
  sum.energy = energy;
  // Along the axis the slope of the force, across it force / distance, as the axis turns.
  sum.slope =
      slope * axis * axis.transpose() + force / e * (Mat3::Identity() - axis * axis.transpose());
  rows_.push_back({0, 0, 0, radius - (e - ball), center + sum.first / sum.pressure, sum, axis});
}

void Foundation::find_below(const Shell& shell, const Mat3& turn, const Vec3& shift,
                            bool friction) {
  rows_.clear(), points_.clear(), areas_.clear(), below_.clear();
  const CurvedShell* curved = shell.curved();
  const Sheets& sheets = shell.sheets();
  // About the foot of the shell's origin on the plane, in the shell's frame.
  const Vec3 normal = turn.row(2), foot = -shift.z() * normal, across(shift.x(), shift.y(), 0);
  const HalfSpace below{normal, shell.size()};
  shell.bvh().find_below(normal, -shift.z() + (curved ? curved->bulge() : 0), below_, [](int) {});
  // The points of a sheet have its number for a row until it is known where its body is.
  for (const int f : below_) {
    const Facet& facet = shell.facets()[f];
    const bool flat = !curved || curved->facets()[f].flat;
    const Vec3 corner[3] = {facet.corner[0] - foot, facet.corner[1] - foot, facet.corner[2] - foot};
    CubicPatch patch = flat ? flat_patch(corner) : curved->facets()[f].patch(facet);
    if (!flat) patch.c00 -= foot;
    const int sheet = sheets.sheet[shell.triangle_of_facet(f)];
    const auto visit = [&](const Vec3& x, const Vec3& area, double weight) {
      const Vec3 at = turn * x + across, part = weight * (turn * area);
      areas_.push_back(part);
      points_.push_back({Vec3(at.x(), at.y(), 0), Vec3::UnitZ(), -part.z(), -at.z(),
                         Vec3(0, 0, part.z() * at.z()), sheet});
    };
    // Exact on flat elements. Friction is less smooth than pressure, on large ones.
    const double longest = std::max({(corner[1] - corner[0]).norm(), (corner[2] - corner[1]).norm(),
                                     (corner[0] - corner[2]).norm()});
    const int order = flat && !(friction && longest > shell.size() / 4) ? 3 : 4;
    CellQuadrature(patch, FacetAxes(facet), below, order).run(visit);
  }
  FoundationSum sum;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const int sheet = points_[i].row;
    if (sheet < 0) continue;
    double energy = 0;
    for (std::size_t k = i; k < points_.size(); ++k)
      if (points_[k].row == sheet) energy += points_[k].pressure * points_[k].force.z() / 2;
    const bool turned = shell.side() == Side::Both ? energy < 0 : shell.side() == Side::Inside;
    sum.energy += turned ? -energy : energy;
    for (std::size_t k = i; k < points_.size(); ++k) {
      FoundationPoint& point = points_[k];
      if (point.row != sheet) continue;
      point.row = -1;
      if (turned) point.area *= -1, point.force *= -1, areas_[k] *= -1;
      sum.force += point.force;
      // As the shell turns so does its area, whose depth^2 / 2 adds nothing where the surface is
      // closed.
      const double half = point.pressure * point.pressure / 2;
      sum.first += point.force.z() * point.point + half * Vec3(areas_[k].x(), areas_[k].y(), 0);
    }
  }
  for (FoundationPoint& point : points_) point.row = 0;
  sum.pressure = sum.force.z();
  if (sum.pressure > 0)
    rows_.push_back({0, 0, 0, 0, sum.first / sum.pressure, sum});
  else
    points_.clear(), areas_.clear();
}

}  // namespace sphshell
