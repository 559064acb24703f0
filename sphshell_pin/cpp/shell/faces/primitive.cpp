#include "shell/faces/recognizer.hpp"

#include <Eigen/Dense>

namespace sphshell {
namespace {

// Rounds of Gauss-Newton: it converges quadratically where the points lie on a primitive.
constexpr int kMostSteps = 12, kFewSteps = 3;
// Cones that are flatter than this half-angle [rad] are planes to all ends.
constexpr double kFlattestCone = 1.5;

double radius_or_zero(double square) { return square > 0 ? std::sqrt(square) : 0; }

// Rank-revealing: what the points do not determine stays as it is (a basic solution).
template <class Matrix, class Vector>
Eigen::VectorXd least_squares(const Matrix& a, const Vector& b) {
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> solver(a);
  solver.setThreshold(1e-10);
  return solver.solve(b);
}

// The mean of points, and the largest coordinate from there: fits are made about the one and in
// units of the other, against cancellation.
std::pair<Vec3, double> middle_and_size(const std::vector<Vec3>& points) {
  Vec3 middle = Vec3::Zero();
  for (const Vec3& x : points) middle += x / double(points.size());
  double size = 0;
  for (const Vec3& x : points) size = std::max(size, (x - middle).cwiseAbs().maxCoeff());
  return {middle, size};
}

// A place by its height along the axis, and what is across that: `e` is unit, away from the axis,
// on which there is no direction, and the result is finite.
struct AboutAxis {
  Vec3 y, across, e;
  double h, off;
  AboutAxis(const Primitive& p, const Vec3& x) : y(x - p.point), h(y.dot(p.axis)) {
    across = y - h * p.axis;
    off = across.norm();
    e = across / std::max(off, 1e-300);
  }
};

// One row of the Jacobian: how the distance of a point changes with shifts of `point` along two
// directions across the axis (and along it), with turns of the axis towards both, and the radii.
struct Frame {
  Vec3 u, v;
  explicit Frame(const Vec3& axis) : u(axis.unitOrthogonal()), v(axis.cross(u)) {}
};

// The derivative of a distance by a motion of the surface is minus the normal's component of that
// motion.
template <class Row>
double distance_and_row(const Primitive& p, const Frame& frame, const Vec3& x, Row&& row) {
  Vec3 n;
  const double distance = p.distance(x, n);
  if (p.kind == FaceKind::Sphere) {
    row << -n.x(), -n.y(), -n.z(), -1;
    return distance;
  }
  // A turn of the axis moves a point at height h by h.
  const AboutAxis at(p, x);
  const double h = at.h, off = at.off, eu = at.e.dot(frame.u), ev = at.e.dot(frame.v);
  if (p.kind == FaceKind::Cylinder) {
    row << -n.dot(frame.u), -n.dot(frame.v), -h * eu, -h * ev, -1;
  } else if (p.kind == FaceKind::Cone) {
    const double c = std::cos(p.second), s = std::sin(p.second), turn = h * c + off * s;
    row << -n.dot(frame.u), -n.dot(frame.v), -turn * eu, -turn * ev, -c,
        -(off - p.radius) * s - h * c;
  } else {
    const double q = std::max(std::hypot(off - p.radius, h), 1e-300), turn = h * p.radius / q;
    row << -n.dot(frame.u), -n.dot(frame.v), -n.dot(p.axis), turn * eu, turn * ev,
        -(off - p.radius) / q, -1;
  }
  return distance;
}

// One step of Gauss-Newton; the axis is normalized after it.
void move(Primitive& p, const Frame& frame, const Eigen::VectorXd& x) {
  if (p.kind == FaceKind::Sphere) {
    p.point += x.head<3>();
    p.radius += x[3];
    return;
  }
  const bool torus = p.kind == FaceKind::Torus;
  p.point += x[0] * frame.u + x[1] * frame.v;
  if (torus) p.point += x[2] * p.axis;
  const int turn = torus ? 3 : 2;
  p.axis = (p.axis + x[turn] * frame.u + x[turn + 1] * frame.v).normalized();
  p.radius += x[turn + 2];
  if (x.size() > turn + 3) p.second += x[turn + 3];
  if (torus) return;
  // Its place along the axis does not matter: beside the points, which are near the origin.
  const double along = p.point.dot(p.axis);
  p.point -= along * p.axis;
  if (p.kind == FaceKind::Cone) p.radius -= along * std::tan(p.second);
}

// Positive radii, finite numbers, and no cone so flat that it is a plane.
bool is_sound(const Primitive& p) {
  // What is nearly a sphere may be any torus of a small radius until more of it is known.
  return std::isfinite(p.radius) && p.point.allFinite() &&
         (p.kind == FaceKind::Torus ? p.second > 0 : p.radius > 0) &&
         (p.kind != FaceKind::Cone || std::abs(p.second) < kFlattestCone);
}

}  // namespace

Mat3 eigenvectors(const Mat3& symmetric) {
  return Eigen::SelfAdjointEigenSolver<Mat3>(symmetric).eigenvectors();
}

// In closed form, positive outside; the normal is its gradient. 1e-300: on the axis or at the
// center there is no direction, and the result is finite.
double Primitive::distance_of_curved(const Vec3& x, Vec3& normal) const {
  if (kind == FaceKind::Sphere) {
    const Vec3 y = x - point;
    const double length = y.norm();
    normal = y / std::max(length, 1e-300);
    return length - radius;
  }
  const AboutAxis at(*this, x);
  const double h = at.h, off = at.off;
  const Vec3& e = at.e;
  if (kind == FaceKind::Cylinder) {
    normal = e;
    return off - radius;
  }
  if (kind == FaceKind::Cone) {
    const double c = std::cos(second), s = std::sin(second);
    // In the half-plane through x, perpendicular to the ruling.
    normal = c * e - s * axis;
    return (off - radius) * c - h * s;
  }
  const double q = std::hypot(off - radius, h);
  normal = ((off - radius) * e + h * axis) / std::max(q, 1e-300);
  return q - second;
}

// The principal directions are those around the axis and of the meridian.
Mat3 Primitive::hessian(const Vec3& x) const {
  const Vec3 y = x - point;
  if (kind == FaceKind::Plane) return Mat3::Zero();
  Vec3 n;
  distance(x, n);
  if (kind == FaceKind::Sphere)
    return (Mat3::Identity() - n * n.transpose()) / std::max(y.norm(), 1e-300);
  const AboutAxis at(*this, x);
  const double off = std::max(at.off, 1e-300);
  const Vec3 &e = at.e, around = axis.cross(e);
  // Around the axis the normal turns with the angle: curvature (n . e) / off. Cylinder and cone are
  // straight along the meridian; a torus has 1 / q.
  Mat3 out = n.dot(e) / off * around * around.transpose();
  if (kind == FaceKind::Torus) {
    const Vec3 meridian = n.cross(around);
    const double q = std::hypot(off - radius, at.h);
    out += meridian * meridian.transpose() / std::max(q, 1e-300);
  }
  return out;
}

Eigen::Vector2d Primitive::parameters(const Vec3& x, double size) const {
  const AboutAxis at(*this, x);
  const Vec3 east = axis.unitOrthogonal();
  // The tip of a cone is a vertex of the file, off the axis by the rounding of its coordinates.
  const double u = at.off > (kind == FaceKind::Cone ? 2e-7 : 1e-9) * size
                       ? std::atan2(at.across.dot(axis.cross(east)), at.across.dot(east))
                       : std::numeric_limits<double>::quiet_NaN();
  return {u, kind == FaceKind::Torus ? std::atan2(at.h, at.off - radius) : at.h / size};
}

Vec3 Primitive::at(const Eigen::Vector2d& place, double size, Vec3* along) const {
  const Vec3 east = axis.unitOrthogonal(), north = axis.cross(east);
  const double c = std::cos(place[0]), s = std::sin(place[0]);
  const double slope = kind == FaceKind::Cone ? std::tan(second) : 0;
  // The radius and the height, and how they change.
  double off = radius + slope * place[1] * size, widens = slope * size;
  double height = place[1] * size, rises = size;
  if (kind == FaceKind::Torus) {
    rises = second * std::cos(place[1]), height = second * std::sin(place[1]);
    off = radius + rises, widens = -height;
  }
  const Vec3 out = c * east + s * north;
  if (along != nullptr)
    along[0] = off * (c * north - s * east), along[1] = widens * out + rises * axis;
  return point + off * out + height * axis;
}

bool Primitive::singular(const Vec3& x, double share) const {
  if (kind == FaceKind::Plane) return false;
  const AboutAxis at(*this, x);
  if (kind == FaceKind::Sphere) return at.y.norm() < share * radius;
  const double size = std::max(std::abs(radius), std::abs(at.h));
  return at.off < share * size ||
         (kind == FaceKind::Torus && std::hypot(at.off - radius, at.h) < share * second);
}

// The intersection of two level sets: tangent n x m; curvature and offset v are in the plane of n
// and m, from n . v and m . v by a 2 by 2 system.
Intersection intersection_at(const Primitive& one, const Primitive& other, const Vec3& x) {
  Vec3 n, m;
  const double a = one.distance(x, n), b = other.distance(x, m), c = n.dot(m);
  const double square = std::max(1 - c * c, 1e-12);
  const auto solve = [&](double p, double q) -> Vec3 {  // the vector v in their plane: n.v, m.v
    return ((p - c * q) * n + (q - c * p) * m) / square;
  };
  const Vec3 across = n.cross(m), along = across.normalized();
  return {along, solve(-along.dot(one.hessian(x) * along), -along.dot(other.hessian(x) * along)),
          solve(-a, -b), across.norm()};
}

// Plane, cylinder, cone, sphere, torus.
int num_parameters(FaceKind kind) {
  static constexpr int kCount[] = {3, 5, 6, 4, 7};
  return kCount[static_cast<int>(kind)];
}

std::vector<Primitive> guess_primitives(FaceKind kind, const FacetSample& facets) {
  std::vector<Primitive> out;
  const std::vector<Vec3>& points = facets.vertices;
  const auto [middle, size] = middle_and_size(points);
  if (!(size > 0)) return out;
  if (kind == FaceKind::Sphere) {
    // |x|^2 = 2 c.x + (r^2 - c^2) is linear in the center c.
    const auto n = static_cast<Eigen::Index>(points.size());
    Eigen::MatrixXd a(n, 4);
    Eigen::VectorXd b(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const Vec3 y = (points[i] - middle) / size;
      a.row(i) << 2 * y.transpose(), 1;
      b[i] = y.squaredNorm();
    }
    const Eigen::Vector4d x = least_squares(a, b);
    const double radius = radius_or_zero(x[3] + x.head<3>().squaredNorm());
    if (radius > 0)
      out.push_back({kind, middle + size * x.head<3>(), Vec3::UnitZ(), size * radius, 0});
    return out;
  }
  double area = 0;
  Vec3 mean = Vec3::Zero();
  for (std::size_t i = 0; i < facets.areas.size(); ++i)
    area += facets.areas[i], mean += facets.areas[i] * facets.normals[i];
  mean /= area;
  // The normals of a cylinder, a cone or a strip of a torus lie on a circle about the axis; those
  // of any surface of revolution meet the axis: they are in a linear complex (Pottmann and Wallner,
  // Computational Line Geometry, 2001).
  Mat3 spread = Mat3::Zero(), nn = 1e-12 * Mat3::Identity(), nm = Mat3::Zero(), mm = Mat3::Zero();
  for (std::size_t i = 0; i < facets.areas.size(); ++i) {
    const double weight = facets.areas[i] / area;
    const Vec3 &n = facets.normals[i], moment = ((facets.centroids[i] - middle) / size).cross(n);
    spread += weight * (n - mean) * (n - mean).transpose();
    nn += weight * n * n.transpose();
    nm += weight * n * moment.transpose();
    mm += weight * moment * moment.transpose();
  }
  // The direction in which the normals vary least.
  const Vec3 axis = eigenvectors(spread).col(0);
  // The point nearest to the normals' lines, seen along the axis.
  Mat3 square = 1e-9 * Mat3::Identity();
  Vec3 right = Vec3::Zero();
  for (std::size_t i = 0; i < facets.areas.size(); ++i) {
    const Vec3 beside = axis.cross(facets.normals[i]);
    if (!(beside.norm() > 1e-12)) continue;
    const Vec3 e = beside.normalized();
    const double weight = facets.areas[i] / area;
    square += weight * e * e.transpose();
    right += weight * e * e.dot((facets.centroids[i] - middle) / size);
  }
  const auto add = [&, &middle = middle, &size = size](const Vec3& point, const Vec3& direction) {
    if (point.allFinite() && direction.allFinite())
      out.push_back(with_axis(kind, middle + size * point, direction.normalized(), points));
  };
  add(square.ldlt().solve(right), axis);
  if (kind != FaceKind::Torus) return out;
  // Minimize sum (n . moment of axis + moment of n . a)^2 over unit a: an eigenvalue problem after
  // eliminating the axis' place.
  const Mat3 solved = nn.ldlt().solve(nm);
  const Mat3 directions = eigenvectors(mm - nm.transpose() * solved);
  for (int k = 0; k < 2; ++k) {
    const Vec3 a = directions.col(k);
    add(a.cross(-solved * a), a);
  }
  return out;
}

Primitive with_axis(FaceKind kind, const Vec3& point, const Vec3& axis,
                    const std::vector<Vec3>& points) {
  const auto n = static_cast<Eigen::Index>(points.size());
  Eigen::ArrayXd along(n), off(n);
  Primitive out{kind, point, axis, 0, 0};
  for (Eigen::Index i = 0; i < n; ++i) {
    const AboutAxis at(out, points[i]);
    along[i] = at.h, off[i] = at.off;
  }
  out.radius = off.mean();
  if (kind == FaceKind::Cone) {
    const Eigen::ArrayXd from_mean = along - along.mean();
    const double slope = (from_mean * off).sum() / std::max(from_mean.square().sum(), 1e-300);
    // Linear regression of the distance from the axis over the place along it; radius at `point`,
    // second: half-angle.
    out.radius -= slope * along.mean();
    out.second = std::atan(slope);
  } else if (kind == FaceKind::Torus) {
    // A circle in the half-plane through the axis.
    Eigen::MatrixXd a(n, 3);
    a << 2 * off, 2 * along, Eigen::ArrayXd::Ones(n);
    const Eigen::Vector3d x = least_squares(a, (off.square() + along.square()).matrix());
    out.point += x[1] * axis;
    out.radius = x[0];
    // (off - R)^2 + (h - h0)^2 = r^2 is linear in R, h0 and r^2 - R^2 - h0^2.
    out.second = radius_or_zero(x[2] + x[0] * x[0] + x[1] * x[1]);
  }
  return out;
}

bool fit_primitive(const std::vector<Vec3>& points, double tolerance, Primitive& primitive) {
  const auto n = static_cast<Eigen::Index>(points.size());
  const auto [middle, size] = middle_and_size(points);
  std::vector<Vec3> scaled;
  scaled.reserve(points.size());
  for (const Vec3& x : points) scaled.push_back((x - middle) / size);
  const double length = primitive.kind == FaceKind::Torus ? size : 1;
  Primitive p = primitive;
  p.point = (p.point - middle) / size;
  p.radius /= size, p.second /= length;
  const double enough = tolerance / size;
  Eigen::MatrixXd jacobian(n, num_parameters(p.kind));
  Eigen::VectorXd off(n);
  Primitive best = p;
  double least = std::numeric_limits<double>::infinity(), last = least;
  for (int step = 0; step < kMostSteps; ++step) {
    const Frame frame(p.axis);
    for (Eigen::Index i = 0; i < n; ++i)
      off[i] = distance_and_row(p, frame, scaled[i], jacobian.row(i));
    const double worst = off.cwiseAbs().maxCoeff();
    if (!std::isfinite(worst) || !jacobian.allFinite() || worst > 50) break;
    if (worst < least) {
      // Settled: the rest is rounding.
      const bool settled = worst > 0.5 * least && worst < enough;
      least = worst, best = p;
      if (settled) break;
    } else if (least < enough) {
      break;
    }
    // Convergence is quadratic by now, or there is nothing to converge to.
    if (step >= kFewSteps && worst > 0.6 * last && worst > enough) return false;
    last = worst;
    Eigen::VectorXd x = least_squares(jacobian, -off);
    // No step is longer than the points' size.
    x *= std::min(1.0, 1 / std::max(x.cwiseAbs().maxCoeff(), 1e-300));
    move(p, frame, x);
    if (x.cwiseAbs().maxCoeff() < 1e-13) break;
  }
  if (!(least <= enough) || !is_sound(best)) return false;
  primitive = best;
  primitive.point = best.point * size + middle;
  primitive.radius *= size, primitive.second *= length;
  return true;
}

}  // namespace sphshell
