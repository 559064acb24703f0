// Crossings: the curves of two faces that are neither lines nor circles.

#include "shell/faces/face_joints.hpp"

namespace sphshell {
namespace {

constexpr int kMostSettling = 12;
// Branches of a crossing whose tangents differ by less do not tell which of them it is.
constexpr double kOneBranch = 1e-6;

bool is_ruled(const Primitive& shape) {
  return shape.kind == FaceKind::Cylinder || shape.kind == FaceKind::Cone;
}

// The unit direction of the straight line through a point of a cylinder or cone.
Vec3 ruling_at(const Primitive& shape, const Vec3& x) {
  if (shape.kind == FaceKind::Cylinder) return shape.axis;
  const Vec3 y = x - shape.point, out = y - y.dot(shape.axis) * shape.axis;
  return std::sin(shape.second) * out.normalized() + std::cos(shape.second) * shape.axis;
}

// How far from x a line meets a cylinder, cone or sphere: by the quadratic equation
// a s^2 + 2 b s + c = 0. Where the line passes it, its point nearest to it.
double meet_quadric(const Primitive& shape, const Vec3& x, const Vec3& line, int branch) {
  const Vec3 y = x - shape.point, axis = is_ruled(shape) ? shape.axis : Vec3(Vec3::Zero());
  const double widens = shape.kind == FaceKind::Cone ? std::tan(shape.second) : 0;
  const double h = y.dot(axis), dh = line.dot(axis), radius = shape.radius + widens * h;
  const Vec3 u = y - h * axis, v = line - dh * axis;
  const double a = v.squaredNorm() - widens * dh * widens * dh;
  const double b = u.dot(v) - widens * dh * radius, c = u.squaredNorm() - radius * radius;
  const double square = b * b - a * c;
  if (!(square > 0)) return -b / a;
  // Without cancellation: one root by the sum, the other by the product of both.
  const double sum = b > 0 ? -b - std::sqrt(square) : -b + std::sqrt(square);
  return (b > 0) == (branch < 0) ? sum / a : c / sum;
}

// The tangents of both branches at an end where two faces are tangent: there the difference of
// their second fundamental forms is zero.
bool find_end(const Primitive& one, const Primitive& two, const Vec3& at, const Vec3& next,
              double size, FaceJoint::End& out) {
  Vec3 n, m;
  one.distance(at, n), two.distance(at, m);
  const Mat3 bend = one.hessian(at), differ = bend - (n.dot(m) < 0 ? -1 : 1) * two.hessian(at);
  const Vec3 east = n.unitOrthogonal(), north = n.cross(east);
  const double a = east.dot(differ * east), b = east.dot(differ * north);
  const double c = north.dot(differ * north), mean = (a + c) / 2;
  const double half = std::hypot((a - c) / 2, b), turn = std::atan2(b, (a - c) / 2) / 2;
  if (!(std::abs(mean) < (1 - kOneBranch) * half)) return false;
  // cos(2 w) = -mean / half, from the axis of the larger curvature.
  const double w = std::acos(-mean / half) / 2;
  const auto way = [&](double angle) -> Vec3 {
    return std::cos(angle) * east + std::sin(angle) * north;
  };
  out.at = at, out.along = way(turn + w), out.other = way(turn - w);
  const Vec3 ahead = next - at;
  if (std::abs(out.other.dot(ahead)) > std::abs(out.along.dot(ahead)))
    std::swap(out.along, out.other);
  if (out.along.dot(ahead) < 0) out.along = -out.along;
  out.curvature = -out.along.dot(bend * out.along) * n;
  // Half the difference is the distance of `one` on `two`, and that of `two` on `one` where their
  // normals are opposite.
  out.grows[1] = out.along.dot(differ * out.other) < 0 ? -1 : 1;
  out.grows[0] = n.dot(m) < 0 ? out.grows[1] : -out.grows[1];
  out.reach = ahead.norm(), out.least = kBesideEnd * size;
  return true;
}

}  // namespace

const FaceJoint::End* FaceJoint::end_near(const Vec3& x, double most) const {
  for (int i = 0; i < num_ends; ++i)
    if ((x - ends[i].at).squaredNorm() < most * most) return &ends[i];
  return nullptr;
}

bool FaceJoint::branches_as(const FaceJoint& other, double gap) const {
  return std::equal(branch, branch + 2, other.branch) &&
         std::equal(ends, ends + num_ends, other.ends, other.ends + other.num_ends,
                    [&](const End& a, const End& b) {
                      return (a.at - b.at).norm() <= gap && a.along.dot(b.along) > 0.5;
                    });
}

// Next to a tangent end the distance of the other face is a product: zero on both branches.
double FaceJoint::divide(int of_face, const Vec3& x, Vec3& away) const {
  const double off = across_of(of_face).distance(x, away);
  for (int i = 0; i < num_ends; ++i) {
    const End& end = ends[i];
    const Vec3 d = x - end.at;
    if (!(d.squaredNorm() < end.reach * end.reach)) continue;
    // In the tangents of both branches: where this one's is the nearer, the distance tells.
    const double c = end.along.dot(end.other), square = 1 - c * c;
    const double a = d.dot(end.along), b = d.dot(end.other);
    const double on_this = (a - c * b) / square, on_other = (b - c * a) / square;
    if (on_this > std::abs(on_other) && on_this > end.least) continue;
    // The distance grows across the curve ahead as it does here across its tangent.
    away = end.grows[which(of_face)] * (end.other - c * end.along) / std::sqrt(square);
    return d.dot(away);
  }
  return off;
}

// On the rulings of one face, or by Newton's method in the plane across the chord.
Vec3 FaceJoint::tangent_at(const std::vector<Primitive>& shapes, const Vec3& p, const Vec3& q,
                           double share, Vec3& x) const {
  const Vec3 chord = q - p;
  x = p + share * chord;
  if (const int i = branch[0] != 0 ? 0 : 1; branch[i] != 0) {
    const Primitive& shape = shapes[face[i]];
    x = shape.onto(x);
    const Vec3 line = ruling_at(shape, x);
    x += meet_quadric(across[i], x, line, branch[i]) * line;
    Vec3 n;
    across[i].distance(x, n);
    const Vec3 around = shape.axis.cross(x - shape.point);
    const double turn = shape.axis.cross(p - shape.point).dot(chord) < 0 ? -1 : 1;
    return turn * (around - n.dot(around) / n.dot(line) * line).normalized();
  }
  // From the parabola that leaves a tangent end as the curve does.
  for (const bool ahead : {true, false})
    if (const End* end = end_near(ahead ? p : q, 1e-3 * chord.norm())) {
      const Vec3 way = ahead ? chord : Vec3(-chord);
      const double s = ahead ? share : 1 - share, along = way.dot(end->along);
      if (along > 0) x += s * (1 - s) * (1 - s) * (way.squaredNorm() / along * end->along - way);
    }
  const Vec3 start = x, unit = chord.normalized();
  Vec3 n, m;
  for (int i = 0; i < kMostSettling; ++i) {
    const double a = shapes[face[0]].distance(x, n), b = across[0].distance(x, m);
    // The point of three planes.
    const Vec3 nm = n.cross(m);
    const double volume = nm.dot(unit);
    if (volume == 0) break;
    const Vec3 step = -(a * m.cross(unit) + b * unit.cross(n) + unit.dot(x - start) * nm) / volume;
    x += step;
    if (!(step.squaredNorm() > 1e-20 * chord.squaredNorm())) break;  // it converges quadratically
  }
  const Vec3 along = n.cross(m).normalized();
  return along.dot(chord) < 0 ? Vec3(-along) : along;
}

void find_branches(const std::vector<Primitive>& shapes, const std::vector<Vec3>& points,
                   double size, FaceJoint& joint) {
  for (int i = 0; i < 2; ++i) {
    const Primitive &shape = shapes[joint.face[i]], &next = joint.across[i];
    const bool ruled = is_ruled(shape) && (is_ruled(next) || next.kind == FaceKind::Sphere);
    int branch = 0;
    for (std::size_t j = 0; j < points.size(); ++j) {
      const Vec3& x = points[j];
      Vec3 n, m;
      shape.distance(x, n), next.distance(x, m);
      const double sine = n.cross(m).norm();
      if (j == 0 || j + 1 == points.size()) {
        if (i == 0 && sine < kLeastAngle &&
            find_end(shape, next, x, points[j == 0 ? 1 : j - 1], size, joint.ends[joint.num_ends]))
          ++joint.num_ends;
        continue;
      }
      if (!ruled) continue;
      // The curve must lead across the rulings, always on the same side of the other face.
      const double along = m.dot(ruling_at(shape, x));
      const int here = std::abs(along) < 0.2 * sine ? 0 : along < 0 ? -1 : 1;
      branch = j == 1 || branch == here ? here : 0;
    }
    joint.branch[i] = static_cast<std::int8_t>(branch);
  }
}

}  // namespace sphshell
