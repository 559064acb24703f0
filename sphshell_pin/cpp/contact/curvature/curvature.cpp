#include "contact/curvature/curvature.hpp"

#include <Eigen/Dense>

#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"
#include "contact/curvature/element_corners.hpp"
#include "contact/query/query.hpp"

namespace sphshell {
namespace {

// Of the radius: a step of the center for derivatives, a distance without direction, and what a
// place may move by such steps. Of the depth: the largest step that changes it.
constexpr double kMove = 1e-5, kNoDistance = 1e-6, kAside = 1e-2, kDeeper = 1e-3;
// Of the size: how near a cone's axis its tip is. Of the distance from the axis: the largest step.
constexpr double kAtTip = 1e-9, kBesideTip = 1e-3;

// Tangents along one line (the sine of their angle), as at the common corner of two curved sides
// that go on into each other, are one.
constexpr double kOneLine = 1e-8;

// What changes a point of an element by `move`: the least change of its parameters that comes
// nearest to it.
Eigen::Matrix<double, 2, 3> parameters_by(const CubicPatch& patch, double u, double v) {
  const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v);
  // The pseudo-inverse of the 3 by 2 matrix [x_u x_v]. Where the tangents are along one line the
  // normal matrix has rank one, and is its own pseudo-inverse over the square of its trace.
  const double a = xu.dot(xu), b = xu.dot(xv), c = xv.dot(xv), trace = a + c;
  const double det = xu.cross(xv).squaredNorm();
  Eigen::Matrix2d inverse;
  inverse << c, -b, -b, a;
  inverse /= det;
  if (!(det > kOneLine * kOneLine * trace * trace)) {
    inverse << a, b, b, c;
    inverse /= std::max(trace * trace, 1e-300);
  }
  Eigen::Matrix<double, 2, 3> tangents;
  tangents << xu.transpose(), xv.transpose();
  return inverse * tangents;
}

// x - (1 - exp(-x)), from x = 0 on without cancellation.
double beyond_linear(double x) {
  return x < 1e-3 ? x * x * (0.5 - x * (1.0 / 6 - x / 24)) : x + std::expm1(-x);
}

// The point of an element nearest to one that is on it but for round-off.
Eigen::Vector2d parameters_of(const CubicPatch& patch, const Facet& facet, const Vec3& point) {
  auto [u, v] = closest_on_facet(facet, point);
  // Gauss-Newton: the residual vanishes at the solution, so it converges quadratically.
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector2d step = parameters_by(patch, u, v) * (point - patch.point(u, v));
    u += step[0], v += step[1];
    if (step.cwiseAbs().sum() < 1e-13) break;
  }
  return {u, v};
}

// At the tip of a cone, whose normals are within `most` (the sine) of its axis: from what its side
// has there, 1 / a around the axis, to as much in all directions where the sphere stands on the
// tip.
CurvatureField::Local at_tip(const Primitive& cone, const Vec3& normal, double length2) {
  CurvatureField::Local out = CurvatureField::Local::Zero();
  if (!(length2 > 0)) return out;
  const Vec3 around = normal.cross(cone.axis);
  const double most = std::cos(cone.second), sine2 = around.squaredNorm();
  const double x = std::min(sine2 / (most * most), 1.0), share = x * (2 - x);
  Mat3 bend = (1 - share) / 2 * (Mat3::Identity() - normal * normal.transpose());
  if (sine2 > 0) bend += share / sine2 * around * around.transpose();
  out.head<6>() = CurvatureField::tensor(bend / std::sqrt(length2));
  return out;
}

}  // namespace

Vec3 Curvature::Place::point() const {
  if (feature != Feature::Edge) return patch.point(at[0], at[1]);
  const auto [u, v] = on_side(index, at[0]);
  return patch.point(u, v);
}

const Primitive* Curvature::face_at(const Place& place) const {
  return place.feature == Feature::Face ? field_.shell().curved()->face_of(place.facet) : nullptr;
}

// Of a face of known shape the gradient of its distance, which is defined on the surface too.
Vec3 Curvature::direction_of(const Place& place, const Vec3& center) const {
  Vec3 out;
  if (const Primitive* face = face_at(place)) {
    face->distance(center, out);
    return out;
  }
  return (center - place.point()).normalized();
}

ContactShape Curvature::shape(const Contact& contact, const Vec3& center, double radius,
                              bool want_second) {
  const Shell& shell = field_.shell();
  const CurvedFacet& curved = shell.curved()->facets()[contact.facet];
  const Facet& facet = shell.facets()[contact.facet];
  Place place{contact.facet, contact.feature, contact.index, {0, 0}, curved.patch(facet)};
  field_.look_about(contact.point,
                    std::sqrt(radius * std::max(contact.depth, 0.0)) + kAside * radius);
  // Within a flat element nothing depends on the place.
  const Primitive* face = face_at(place);
  const bool flat = contact.feature == Feature::Face &&
                    (face ? face->kind == FaceKind::Plane : bool(curved.flat)) &&
                    !field_.near_joint(contact.facet);
  // A ring is touched along a line, where there is no elliptic contact: the sphere's own curvature.
  if (flat || contact.feature == Feature::Ring) {
    const Vec3 normal = flat ? contact.normal : facet.normal;
    ContactShape out = shape_of_gap(Mat3::Identity() / radius, normal, radius);
    out.depth = contact.depth;
    return out;
  }
  if (contact.feature == Feature::Edge)
    place.at[0] = nearest_on_side(curved.side(facet, contact.index), contact.point);
  else
    place.at = parameters_of(place.patch, facet, contact.point);
  Motion motion;
  ContactShape out = shape_at(place, contact.depth, center, contact.normal, radius, motion);
  double step = std::min(kMove * radius, kDeeper * contact.depth);
  if (face && face->kind == FaceKind::Cone)
    step = std::min(step, kBesideTip * std::abs(face->radius_at(contact.point)));
  // Nothing is known of the motion of a center that is on the surface.
  const bool moves = std::abs(radius - contact.depth) > kNoDistance * radius;
  if (!want_second || !moves || !(step > 0)) return out;
  for (int i = 0; i < 3; ++i) {
    out.second.col(i).setZero(), out.tilt_by.col(i).setZero();
    for (int sign : {1, -1}) {
      // Central differences of the exact first derivatives, with parameters and normal moved by
      // their own derivatives.
      const Vec3 moved = sign * step * Vec3::Unit(i);
      Place there = place;
      there.at += motion.parameters * moved;
      Vec3 normal = direction_of(there, center + moved);
      if (normal.dot(contact.normal) < 0) normal = -normal;
      Motion unused;
      const ContactShape other = shape_at(there, contact.depth - contact.normal.dot(moved),
                                          center + moved, normal, radius, unused);
      out.second.col(i) += sign / (2 * step) * other.gradient;
      out.tilt_by.col(i) += sign / (2 * step) * other.tilt;
    }
  }
  // Second derivatives are symmetric; the differences are to their own error only.
  out.second = (0.5 * (out.second + out.second.transpose())).eval();
  return out;
}

// The shape at a place, with first derivatives by the center. The gap's second derivative is I / R
// + curvature of the shell, both in the tangent plane. `motion` returns how place and normal follow
// the center; it is zero where the center is on the surface, as nothing is known there.
ContactShape Curvature::shape_at(const Place& place, double depth, const Vec3& center,
                                 const Vec3& normal, double radius, Motion& motion) {
  const CubicPatch& patch = place.patch;
  const double distance = (center - place.point()).dot(normal);  // negative if pushed back out
  motion.parameters.setZero(), motion.normal.setZero();
  // On the surface itself the direction to the center is undefined.
  const bool moves = std::abs(distance) > kNoDistance * radius;
  depth = std::max(depth, 0.0);  // where a difference reaches beyond it
  const Primitive* face = face_at(place);
  // Seen from the other side a surface curves the other way.
  const int along = face && direction_of(place, center).dot(normal) < 0 ? -1 : 1;
  int sign = along;
  if (face)
    sign *= field_.shell().curved()->face_cells()[place.facet].sign;
  else if (place.feature == Feature::Face)
    sign = normal_of(patch, place.at[0], place.at[1]).dot(normal) < 0 ? -1 : 1;
  if (moves && face) {
    motion.normal = along * face->hessian(center);
  } else if (moves) {
    Mat3 dx_dc = Mat3::Zero();
    if (place.feature == Feature::Face) {
      dx_dc = dx_dc_of(patch, place.at[0], place.at[1], Sphere{center, 0, 0});
      motion.parameters = parameters_by(patch, place.at[0], place.at[1]) * dx_dc;
    } else if (place.feature == Feature::Edge) {
      const Shell& shell = field_.shell();
      const CubicCurve side =
          shell.curved()->facets()[place.facet].side(shell.facets()[place.facet], place.index);
      const Vec3 tangent = side.tangent(place.at[0]);
      dx_dc = dx_dc_of(side, place.at[0], Sphere{center, 0, 0});
      motion.parameters.row(0) = tangent.transpose() * dx_dc / tangent.squaredNorm();
    }
    motion.normal = (Mat3::Identity() - normal * normal.transpose() - dx_dc) / distance;
  }
  // Where the center moves, so do the place and the normal.
  const auto local_at = [&](const Vec3& moved, double length2) -> CurvatureField::Local {
    Place there = place;
    there.at += motion.parameters * moved;
    if (place.feature != Feature::Face)
      return between_walls(there, (normal + motion.normal * moved).normalized(), length2);
    const Vec3 point = face ? face->onto(center + moved) : there.point();
    return sign * field_.at({place.facet, there.at, point}, length2);
  };
  // The square of the radius of contact on a plane, over which joints are blended.
  const double length2 = radius * depth;
  double step = kMove * radius;
  if (face && face->kind == FaceKind::Cone)
    step = std::min(step, kBesideTip * std::abs(face->radius_at(face->onto(center))));
  const CurvatureField::Local local = local_at(Vec3::Zero(), length2);
  Eigen::Matrix<double, 7, 3> local_by;
  local_by.setZero();
  // Along the normal neither place nor normal move.
  const Vec3 east = normal.unitOrthogonal();
  for (const Vec3& along : {east, Vec3(normal.cross(east))})
    for (int way : {1, -1})
      if (moves)
        local_by += way / (2 * step) * local_at(way * step * along, length2) * along.transpose();
  // It grows with the depth, which falls along the normal.
  for (int way : {1, -1})
    if (depth > 0 && moves)
      local_by -= way / (2 * kDeeper * depth) *
                  local_at(Vec3::Zero(), (1 + way * kDeeper) * length2) * normal.transpose();
  const Mat3 curvature = CurvatureField::matrix(local.head<6>());
  Mat3 slope;
  ContactShape out = shape_of_gap(curvature + Mat3::Identity() / radius, normal, radius, &slope);
  // The slope lies in the tangent plane, which turns with the normal.
  // d scale = slope : d(curvature) for what stays in the plane; for the plane's turning by dn it is
  // -2 (slope curvature n) . dn.
  const Vec3 turn = 2 * slope * (curvature * normal);
  for (int i = 0; i < 3; ++i)
    out.gradient[i] =
        (slope.array() * CurvatureField::matrix(local_by.col(i).head<6>()).array()).sum() -
        turn.dot(motion.normal.col(i));
  // The rise comes on with the depth, so that a touch begins where it is found: with size = |rise|
  // and x = depth / size the corrected depth is depth + rise (1 - e^-x), zero at zero depth, with
  // the full rise a few sizes deeper. Its derivative gives the tilt.
  const double rise = local[6];
  const double size = std::abs(rise), x = rise == 0 ? 0 : depth / size;
  const double share = rise == 0 ? 0 : std::exp(-x);
  out.depth = rise == 0  ? depth
              : rise < 0 ? size * beyond_linear(x)
                         : depth - rise * std::expm1(-x);
  out.tilt =
      (rise < 0 ? -share : share) * normal - (1 - share * (1 + x)) * local_by.row(6).transpose();
  return out;
}

// Shepard's interpolation between the arcs from wall to wall, each weighted by the inverse square
// of what the way over the normal is longer than the arc; along an arc by the angle.
CurvatureField::Local Curvature::between_walls(const Place& place, const Vec3& normal,
                                               double length2) {
  walls_.clear();
  const Shell& shell = field_.shell();
  const Primitive* face = shell.curved()->face_of(place.facet);
  if (place.feature == Feature::Vertex && face && face->kind == FaceKind::Cone &&
      std::abs(face->radius_at(place.point())) < kAtTip * shell.size())
    return at_tip(*face, normal, length2);
  if (place.feature == Feature::Edge)
    find_walls_of_side(place.facet, place.index, place.at[0], length2);
  else
    find_walls_of_vertex(place.facet, place.index, length2);
  // One wall on both sides means that the walls do not differ.
  if (walls_.size() == 1 && walls_[0].first.normal == walls_[0].second.normal) {
    // A border: from one side of the only wall to its other side.
    const Wall& only = walls_[0].first;
    return only.normal.dot(normal) * only.local;
  }
  Vec3 outward = Vec3::Zero();
  for (const auto& [a, b] : walls_) outward += a.normal + b.normal;
  const double sign = outward.dot(normal) < 0 ? -1 : 1;
  CurvatureField::Local sum = CurvatureField::Local::Zero();
  double weights = 0;
  for (const auto& [a, b] : walls_) {
    const double from_a = angle_between(sign * normal, a.normal);
    const double from_b = angle_between(sign * normal, b.normal);
    const double apart = from_a + from_b;
    // The detour is zero where the normal is on the arc between both walls: that arc has all the
    // weight there, and 1e-12 keeps it finite.
    const double detour = std::max(apart - angle_between(a.normal, b.normal), 1e-12);
    const double share = apart > 0 ? from_a / apart : 0.5;
    const double weight = 1 / (detour * detour);
    sum += weight * ((1 - share) * a.local + share * b.local);
    weights += weight;
  }
  return sign / weights * sum;
}

Curvature::Wall Curvature::wall(int facet, double u, double v, double length2) {
  const Shell& shell = field_.shell();
  const CubicPatch patch = shell.curved()->facets()[facet].patch(shell.facets()[facet]);
  return {field_.at({facet, {u, v}, patch.point(u, v)}, length2), normal_of(patch, u, v)};
}

// The elements at an edge in their order; neighbors are a pair of walls. Of the other triangle the
// half-edge may run the other way: then t counts from its other end.
void Curvature::find_walls_of_side(int facet, int side, double t, double length2) {
  const Shell& shell = field_.shell();
  const Topology& topology = shell.topology();
  const Edge& edge = edge_at(shell, facet, side);
  const int first = shell.triangles()[shell.triangle_of_facet(facet)][side];
  Wall last;
  for (int i = 0; i < edge.count; ++i) {
    const int h = shell.facet_half_edge(topology.incidence[edge.begin + i]);
    const int other = triangle_of(h), k = side_of(h);
    const bool along = shell.triangles()[shell.triangle_of_facet(other)][k] == first;
    const auto [u, v] = on_side(k, along ? t : 1 - t);
    const Wall here = wall(other, u, v, length2);
    if (i > 0 || edge.count == 1) walls_.emplace_back(i > 0 ? last : here, here);
    last = here;
  }
}

void Curvature::find_walls_of_vertex(int facet, int corner, double length2) {
  const Shell& shell = field_.shell();
  const auto wall_at = [&](int c) {
    const auto [u, v] = corner_parameters(c % 3);
    return wall(c / 3, u, v, length2);
  };
  connected_corners(shell, 3 * facet + corner, corners_,
                    [](int, int, const Edge&) { return true; });
  // The creases that leave the vertex, each once; without one, the only wall.
  for (int c : corners_) {
    const Wall here = wall_at(c);
    for_each_beside(shell, c, [&](int other, const Edge&) {
      if (other <= c) return;
      const Wall there = wall_at(other);
      if (!is_one_normal(here.normal, there.normal)) walls_.emplace_back(here, there);
    });
  }
  if (walls_.empty()) walls_.emplace_back(wall_at(corners_[0]), wall_at(corners_[0]));
}

// Depths, scales and their derivatives are sums over a group with the weights, like the energies
// that they belong to; the half axes shown are those of the first.
void merge_shapes(const std::vector<Contact>& contacts, const std::vector<ContactShape>& shapes,
                  std::vector<ContactShape>& shown) {
  shown.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i) {
    if (!leads(contacts, i)) continue;
    shown.push_back(shapes[i]);
    // Alone: its own shape.
    if (contacts[i].group < 0) continue;
    ContactShape& whole = shown.back();
    whole.scale = whole.depth = 0;
    whole.gradient.setZero(), whole.second.setZero(), whole.tilt_by.setZero();
    Vec3 falls = Vec3::Zero(), normal = Vec3::Zero();
    for (std::size_t k = 0; k < contacts.size(); ++k) {
      if (contacts[k].group != contacts[i].group) continue;
      whole.scale += contacts[k].weight * shapes[k].scale;
      whole.gradient += contacts[k].weight * shapes[k].gradient;
      whole.second += contacts[k].weight * shapes[k].second;
      whole.tilt_by += contacts[k].weight * shapes[k].tilt_by;
      whole.depth += contacts[k].weight * shapes[k].depth;
      normal += contacts[k].weight * contacts[k].normal;
      falls += contacts[k].weight * (contacts[k].normal + shapes[k].tilt);
    }
    whole.tilt = falls - normal.normalized();
  }
}

}  // namespace sphshell
