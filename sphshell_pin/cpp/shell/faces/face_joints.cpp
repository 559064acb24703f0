#include "shell/faces/face_joints.hpp"

namespace sphshell {
namespace {

using Planar = Eigen::Vector2d;

constexpr int kMostRepeats = 12;
// Faces whose normals differ by less are tangent: the depth beside their border is then exact to
// half the square of it.
constexpr double kTangent = 1e-5;
// Directions that differ by less are one.
constexpr double kParallel = 1e-6;

// The coordinates of a plane in which both shapes are lines or circles: across their common
// direction, or a half-plane through their common axis.
struct Section {
  Vec3 origin, axis;  // the direction, or the axis of revolution
  Vec3 east, north;   // of a half-plane only `north`, which is the axis
  bool turned;
  Planar of(const Vec3& x) const {
    const Vec3 y = x - origin;
    const double h = y.dot(turned ? axis : north);
    return {turned ? (y - h * axis).norm() : y.dot(east), h};
  }
};

// A line of points with normal . x = `level`, or a circle.
struct Trace {
  bool circle = false;
  Planar normal = Planar::UnitX(), center = Planar::Zero();
  double level = 0, radius = 0;
  Planar normal_at(const Planar& x) const {
    return circle ? Planar((x - center).normalized()) : normal;
  }
  Planar onto(const Planar& x) const {
    return circle ? Planar(center + radius * normal_at(x))
                  : Planar(x - (normal.dot(x) - level) * normal);
  }
};

// What a shape is in a section; false if it is neither a line nor a circle there.
bool trace_of(const Primitive& shape, const Section& in, double gap, Trace& out) {
  const Vec3 y = shape.point - in.origin;
  const bool along = shape.axis.cross(in.axis).norm() <= kParallel;
  const bool coaxial = (y - y.dot(in.axis) * in.axis).norm() <= gap;
  const Planar at(0, y.dot(in.axis));
  if (!in.turned) {
    if (shape.kind == FaceKind::Plane && std::abs(shape.axis.dot(in.axis)) <= kParallel) {
      out.normal = Planar(shape.axis.dot(in.east), shape.axis.dot(in.north)).normalized();
      out.level = out.normal.dot(in.of(shape.point));
      return true;
    }
    out.circle = true, out.center = in.of(shape.point), out.radius = shape.radius;
    return shape.kind == FaceKind::Cylinder && along;
  }
  if (shape.kind == FaceKind::Sphere) {
    out = {true, Planar::UnitX(), at, 0, shape.radius};
    return coaxial;
  }
  if (shape.kind == FaceKind::Plane) {
    out.normal = Planar::UnitY(), out.level = at.y();
    return along;
  }
  if (!along || !coaxial) return false;
  if (shape.kind == FaceKind::Torus) {
    out = {true, Planar::UnitX(), Planar(shape.radius, at.y()), 0, shape.second};
  } else if (shape.kind == FaceKind::Cylinder) {
    out.normal = Planar::UnitX(), out.level = shape.radius;
  } else {
    const double turn = shape.axis.dot(in.axis) < 0 ? -1 : 1;
    out.normal = Planar(std::cos(shape.second), -turn * std::sin(shape.second));
    out.level = out.normal.dot(Planar(shape.radius, at.y()));
  }
  return true;
}

// Where two traces meet next to x, or touch: then midway between their nearest points. Of traces
// that cross twice where they should touch, as borders of files are off, `gap` tells: where the
// midway is as near to both, the place that is nearer to x.
bool meet(const Trace& one, const Trace& two, double gap, Planar& x, bool& tangent) {
  if (!one.circle && two.circle) return meet(two, one, gap, x, tangent);
  tangent = false;
  if (!one.circle) {
    const double sine = one.normal.x() * two.normal.y() - one.normal.y() * two.normal.x();
    if (!(std::abs(sine) > kTangent)) return false;
    x = Planar(one.level * two.normal.y() - two.level * one.normal.y(),
               two.level * one.normal.x() - one.level * two.normal.x()) /
        sine;
    return true;
  }
  // Of two circles the points of both are on a line, across that of their centers.
  Planar normal = two.normal;
  double along = two.level - normal.dot(one.center);
  if (two.circle) {
    const double apart = (two.center - one.center).norm();
    if (!(apart > 0)) return false;
    normal = (two.center - one.center) / apart;
    along = (apart * apart + one.radius * one.radius - two.radius * two.radius) / (2 * apart);
  }
  const double square = one.radius * one.radius - along * along;
  const Planar aside(-normal.y(), normal.x());
  const double half = square > 0 ? std::sqrt(square) : 0;
  const Planar crossing =
      one.center + along * normal + (aside.dot(x - one.center) < 0 ? -half : half) * aside;
  const Planar n = one.normal_at(crossing), m = two.normal_at(crossing);
  const Planar touching = one.center + (along < 0 ? -one.radius : one.radius) * normal;
  const Planar beyond = two.onto(touching), midway = (touching + beyond) / 2;
  tangent = !(std::abs(n.x() * m.y() - n.y() * m.x()) > kTangent) ||
            ((beyond - touching).norm() <= gap && (x - midway).norm() < (x - crossing).norm());
  x = tangent ? midway : crossing;
  return x.allFinite();
}

// The line or circle of a section's point.
FaceJoint joint_at(const Section& in, const Planar& x, const Planar& n, const Planar& m) {
  FaceJoint out;
  out.axis = in.axis;
  if (!in.turned) {
    out.kind = FaceJoint::Kind::Line;
    out.point = in.origin + x.x() * in.east + x.y() * in.north;
    for (int i = 0; i < 2; ++i) {
      const Planar up = i == 0 ? n : m;
      const Vec3 normal = up.x() * in.east + up.y() * in.north;
      out.across[i] = {FaceKind::Plane, out.point, in.axis.cross(normal), 0, 0};
    }
    return out;
  }
  out.kind = FaceJoint::Kind::Circle;
  out.point = in.origin + x.y() * in.axis, out.radius = x.x();
  // The normals span a plane, a cylinder or a cone.
  for (int i = 0; i < 2; ++i) {
    const Planar up = i == 0 ? n : m;
    const FaceKind kind = std::abs(up.x()) < kParallel * kParallel   ? FaceKind::Cylinder
                          : std::abs(up.y()) < kParallel * kParallel ? FaceKind::Plane
                                                                     : FaceKind::Cone;
    out.across[i] = {kind, out.point, in.axis, out.radius, std::atan2(up.x(), up.y())};
    if (kind != FaceKind::Cone) out.across[i].second = 0;
  }
  return out;
}

// Sections in which both shapes may be lines or circles.
std::vector<Section> sections(const Primitive& one, const Primitive& two, const Vec3& p,
                              const Vec3& q) {
  std::vector<Section> out;
  const auto add = [&](const Vec3& origin, const Vec3& axis, bool turned) {
    if (!(axis.norm() > 0)) return;
    const Vec3 unit = axis.normalized(), east = unit.unitOrthogonal();
    out.push_back({origin, unit, east, turned ? unit : unit.cross(east), turned});
  };
  const auto is = [](const Primitive& shape, FaceKind kind) { return shape.kind == kind; };
  const bool flat = is(one, FaceKind::Plane), flat2 = is(two, FaceKind::Plane);
  if (flat && flat2) {
    const Vec3 along = one.axis.cross(two.axis);
    add(p, along.norm() > kTangent ? along : Vec3(q - p), false);
  }
  // The axis of revolution: of a sphere that through the other's center, or upright on it.
  for (const auto& [a, b] : {std::pair(&one, &two), std::pair(&two, &one)}) {
    if (is(*a, FaceKind::Plane)) continue;
    if (!is(*a, FaceKind::Sphere))
      add(a->point, a->axis, true);
    else if (is(*b, FaceKind::Plane) || is(*b, FaceKind::Sphere))
      add(a->point, is(*b, FaceKind::Plane) ? b->axis : Vec3(b->point - a->point), true);
    if (is(*a, FaceKind::Cylinder)) add(a->point, a->axis, false);
  }
  return out;
}

// Where a tube ends: the circle across it, on a torus and on what goes on from there: along the
// tube or, a plane, a cylinder and a torus at its equator, `around` the axis of the circle.
std::optional<FaceJoint> end_of_tube(const Primitive& torus, const Primitive& next, const Vec3& p,
                                     double gap, bool swapped, bool around) {
  const Vec3 between = next.point - torus.point;
  Vec3 out = between - between.dot(torus.axis) * torus.axis;  // towards the end of the tube
  if (around)
    out = next.axis.cross(torus.axis);
  else if (next.kind == FaceKind::Torus && next.axis.cross(torus.axis).norm() > kParallel)
    out = torus.axis.cross(next.axis).cross(torus.axis);
  if (next.kind == FaceKind::Cone || !(out.norm() > 0)) return std::nullopt;
  out.normalize();
  if (out.dot(p - torus.point) < 0) out = -out;
  FaceJoint joint;
  joint.kind = FaceJoint::Kind::Circle;
  joint.tangent = next.kind != FaceKind::Plane;
  joint.point = torus.point + torus.radius * out;
  joint.axis = torus.axis.cross(out), joint.radius = torus.second;
  if (around && next.kind == FaceKind::Torus && !((next.point - joint.point).norm() <= gap))
    return std::nullopt;
  const Primitive level{FaceKind::Plane, joint.point, joint.axis, 0, 0};
  joint.across[0] = joint.across[1] = level;
  if (!joint.tangent)
    joint.across[swapped ? 0 : 1] = {FaceKind::Cylinder, joint.point, joint.axis, joint.radius, 0};
  return joint;
}

// The ruling of a cone along which another shape may touch it.
std::optional<FaceJoint> ruling(const Primitive& cone, const Primitive& next, const Vec3& middle) {
  const Vec3 toward = next.kind == FaceKind::Plane ? next.axis : Vec3(middle - cone.point);
  Vec3 out = toward - toward.dot(cone.axis) * cone.axis;
  if (!(out.norm() > 0) || next.kind == FaceKind::Sphere || next.kind == FaceKind::Torus)
    return std::nullopt;
  out.normalize();
  if (out.dot(middle - cone.point) < 0) out = -out;
  FaceJoint joint;
  joint.kind = FaceJoint::Kind::Line, joint.tangent = true;
  joint.point = cone.point + cone.radius * out;
  joint.axis = std::sin(cone.second) * out + std::cos(cone.second) * cone.axis;
  joint.across[0] = {FaceKind::Plane, joint.point, cone.axis.cross(out), 0, 0};
  joint.across[1] = joint.across[0];
  return joint;
}

// The mitre of two cylinders of one radius: in one of the two planes between their axes, which cuts
// both at an angle where they are tangent to each other, too.
std::optional<FaceJoint> mitre(const Primitive& one, const Primitive& two, const Vec3& middle,
                               double gap) {
  const Vec3 &a = one.axis, &b = two.axis, up = a.cross(b);
  const double square = up.squaredNorm();
  const Vec3 between = two.point - one.point;
  if (one.kind != FaceKind::Cylinder || two.kind != FaceKind::Cylinder ||
      !(std::abs(one.radius - two.radius) <= gap) || !(square > kLeastAngle * kLeastAngle) ||
      !(std::abs(between.dot(up)) <= gap * std::sqrt(square)))
    return std::nullopt;
  const Vec3 center = one.point + between.cross(b).dot(up) / square * a;
  FaceJoint joint;
  const Vec3 sum = (a + b).normalized(), rest = (a - b).normalized(), x = middle - center;
  joint.point = center, joint.axis = std::abs(sum.dot(x)) < std::abs(rest.dot(x)) ? sum : rest;
  joint.across[0] = joint.across[1] = {FaceKind::Plane, center, joint.axis, 0, 0};
  return joint;
}

}  // namespace

Intersection FaceJoint::at(const std::vector<Primitive>& shapes, const Vec3& x) const {
  if (kind == Kind::Crossing) {
    for (int i = 0; i < num_ends; ++i)
      if (const End& end = ends[i]; (x - end.at).norm() < end.least)
        return {end.along, end.curvature, end.at - x, 0};
    return intersection_at(shapes[face[0]], across[0], x);
  }
  const Vec3 on = nearest(x);
  if (kind == Kind::Line) return {axis, Vec3::Zero(), on - x, 1};
  const Vec3 inward = (point - on) / radius;
  return {inward.cross(axis), inward / radius, on - x, 1};
}

// Newton's method on both distances; quadratic where the faces cross at an angle.
bool onto_both(const Primitive& one, const Primitive& other, Vec3& x) {
  for (int i = 0; i < kMostRepeats; ++i) {
    const Intersection here = intersection_at(one, other, x);
    if (!(here.sine > kLeastAngle)) return false;
    x += here.offset;
    if (here.offset.squaredNorm() < 1e-30 * x.squaredNorm()) break;
  }
  return x.allFinite();
}

std::optional<FaceJoint> find_joint(const std::vector<Primitive>& shapes, int a, int b,
                                    const Vec3& p, const Vec3& q, double gap) {
  const Primitive &one = shapes[a], &two = shapes[b];
  const double length = (q - p).norm();
  const auto is_border = [&](const FaceJoint& joint) {
    if (joint.kind == FaceJoint::Kind::Circle && !(joint.radius > gap)) return false;
    for (const double s : {0.0, 0.25, 0.5, 0.75, 1.0}) {
      const Vec3 chord = p + s * (q - p);
      Vec3 x = chord;
      if (joint.kind != FaceJoint::Kind::Crossing)
        x = joint.nearest(chord);
      else if (!onto_both(one, joint.across[0], x))
        return false;
      if (!((x - chord).norm() < length) || !(std::abs(one.distance(x)) <= gap) ||
          !(std::abs(two.distance(x)) <= gap))
        return false;
    }
    return true;
  };
  std::vector<FaceJoint> found;
  for (const Section& in : sections(one, two, p, q)) {
    Trace first, second;
    Planar x = in.of((p + q) / 2);
    if (in.turned) x = (in.of(p) + in.of(q)) / 2;
    bool tangent = false;
    if (!trace_of(one, in, gap, first) || !trace_of(two, in, gap, second)) continue;
    if (!meet(first, second, gap, x, tangent)) {
      // Planes that are nearly one meet along their border's own line.
      if (first.circle || second.circle || in.turned) continue;
      x = in.of(p), tangent = true;
    }
    found.push_back(joint_at(in, x, first.normal_at(x), second.normal_at(x)));
    found.back().tangent = tangent;
  }
  const auto add = [&](const std::optional<FaceJoint>& joint) {
    if (joint) found.push_back(*joint);
  };
  for (const bool around : {false, true}) {
    if (one.kind == FaceKind::Torus) add(end_of_tube(one, two, p, gap, false, around));
    if (two.kind == FaceKind::Torus) add(end_of_tube(two, one, p, gap, true, around));
  }
  if (one.kind == FaceKind::Cone) add(ruling(one, two, (p + q) / 2));
  if (two.kind == FaceKind::Cone) add(ruling(two, one, (p + q) / 2));
  add(mitre(one, two, (p + q) / 2, gap));
  for (FaceJoint& joint : found)
    if (is_border(joint)) {
      joint.face[0] = a, joint.face[1] = b;
      return joint;
    }
  return std::nullopt;
}

}  // namespace sphshell
