#include <Eigen/Eigenvalues>

#include "contact/laws/dual.hpp"
#include "dynamics/scene/scene_data.hpp"

namespace sphshell {
namespace {

// What velocity makes of a pressure p along n: p (share n - drag slip), share = 1 - b gap_rate.
struct Pressed {
  double gap_rate, share, drag;
  Vec3 slip;

  // share is clamped at zero: a pressure does not pull. drag [s/m] is the friction coefficient over
  // the slip speed.
  Pressed(const FoundationLaw& law, const CoulombFriction* friction, const Vec3& n, const Vec3& v)
      : gap_rate(n.dot(v)),
        share(std::max(0.0, 1 - law.dissipation * gap_rate)),
        drag(0),
        slip(v - gap_rate * n) {
    if (friction) drag = share * friction->over_speed(slip.squaredNorm());
  }

  // Of share n - drag slip: the normal part -b n n^T, and of the drag the product rule over share
  // and coefficient.
  Mat3 by_velocity(const FoundationLaw& law, const CoulombFriction* friction, const Vec3& n) const {
    Mat3 out = Mat3::Zero();
    if (!(share > 0)) return out;
    out -= law.dissipation * n * n.transpose();
    if (!friction) return out;
    const Dual<1> over = friction->over_speed(Dual<1>::seed(slip.squaredNorm(), 0));
    const Mat3 flat = Mat3::Identity() - n * n.transpose();
    out += law.dissipation * over.value * slip * n.transpose() -
           share * (over.value * flat + 2 * over.slope[0] * slip * slip.transpose());
    return out;
  }
};

const CoulombFriction* sliding_friction(const Pair& pair) {
  return std::get_if<CoulombFriction>(&pair.friction.law);
}

// What the derivative of a force at x by the velocity there adds to that of the wrench by the
// twist: v = linear - [x] angular, moment = [x] force.
void add_by_twist(const Mat3& by_velocity, const Vec3& x, Matrix6& by_twist) {
  const Mat3 arm = cross_matrix(x);
  by_twist.topLeftCorner<3, 3>() += by_velocity;
  by_twist.topRightCorner<3, 3>() -= by_velocity * arm;
  by_twist.bottomLeftCorner<3, 3>() += arm * by_velocity;
  by_twist.bottomRightCorner<3, 3>() -= arm * by_velocity * arm;
}

// Mean square of the distance of the pressure beside a plane from its center [m^2].
double spread_of(const Foundation& foundation) {
  const FoundationRow& row = foundation.rows()[0];
  double sum = 0;
  for (const FoundationPoint& one : foundation.points())
    sum += one.force.z() * (one.point - row.center).squaredNorm();
  return std::max(0.0, sum) / row.sum.pressure;
}

// For the laws, whose disc of contact is Hertz's: a^2 = radius depth. Over a sphere's patch it is
// as wide as that.
double disc_radius(const Pair& pair, const Foundation& foundation, double depth) {
  return pair.on_plane() ? disc_of_spread(spread_of(foundation), depth) : 2 * pair.disc_radius();
}

// The derivative of the pressure at a point this far from the sphere's center by that center.
Vec3 pressure_by_center(const Vec3& from, double radius) {
  // p = (R^2 - rho^2) / (2 rho): dp/drho = -(R^2 / rho^2 + 1) / 2, and rho falls along `from`.
  const double rho = from.norm();
  return (radius * radius / (rho * rho) + 1) / (2 * rho) * from;
}

}  // namespace

void FoundationForces::find(const Pair& pair, const Vec3& center, bool slopes,
                            std::vector<Contact>& contacts) {
  contacts.clear();
  center_ = center;
  const bool points =
      pair.law.needs_rate() || sliding_friction(pair) || (slopes && pair.friction.has_state());
  pair.ask([&](const auto& one) { one.overlap(foundation_, center, pair.radius, slopes, points); });
  for (const FoundationRow& row : foundation_.rows()) {
    const Vec3 n = row.normal();
    Contact& contact =
        contacts.emplace_back(Contact{row.center, n, row.depth, row.element, Feature::Face});
    const double length = row.sum.force.norm();
    if (slopes && length > 0)
      contact.dn_dc = (row.sum.slope - n * (n.transpose() * row.sum.slope)) / length;
    // It has no sides: the foundation knows where it pushes.
    contact.rim = true;
  }
}

void FoundationForces::find_below(const Pair& pair, const PlaneBelow& plane,
                                  std::vector<Contact>& contacts) {
  contacts.clear();
  foundation_.find_below(*plane.shell, plane_from_shell_.rotation(),
                         plane_from_shell_.translation(), sliding_friction(pair) != nullptr);
  if (foundation_.rows().empty()) return;
  center_ = foundation_.rows()[0].center;
  Contact& contact = contacts.emplace_back(lowest_);
  contact.point = center_, contact.dn_dc.setZero();
  contact.weight = 1, contact.feature = Feature::Face, contact.rim = true;
}

FoundationForce FoundationForces::force(const Pair& pair, std::size_t i, const Vec3& velocity,
                                        const Vec3& spin) const {
  const FoundationLaw& law = *pair.law.foundation();
  const double kappa = law.modulus / law.thickness;
  FoundationForce out;
  // The elastic force is the row's sum; damping and friction are sums over its points.
  out.elastic = out.normal = kappa * foundation_.rows()[i].sum.force;
  out.friction.setZero(), out.moment.setZero();
  const CoulombFriction* friction = sliding_friction(pair);
  for (const FoundationPoint& point : foundation_.points()) {
    if (point.row != static_cast<int>(i) || point.area == 0) continue;
    // Rigid-body velocity of the sphere's point at the quadrature point, against the shell.
    const Vec3 arm = point.point - center_, v = velocity + spin.cross(arm);
    const Pressed pressed(law, friction, point.normal, v);
    const double push = kappa * point.pressure * point.area;
    const Vec3 damped = push * (pressed.share - 1) * point.normal;
    const Vec3 drag = -push * pressed.drag * pressed.slip;
    out.normal += damped;
    out.friction += drag;
    out.moment += arm.cross(damped + drag);
    out.damping -= push * (pressed.share - 1) * pressed.gap_rate;
    out.sliding -= drag.dot(pressed.slip);
  }
  return out;
}

// An ellipse has half axes of 2 sqrt(moment / area).
PatchRow FoundationForces::patch(SceneData& scene, const ActiveContact& active,
                                 const ContactRow& shown) const {
  const Pair& pair = scene.pair_of(active);
  // Force, damping included, and number of the row.
  const double force = shown.normal_force;
  const int number = active.index;
  Foundation found;  // with its points, which a scene has only where it needs them
  if (pair.on_plane()) found = foundation_;
  pair.ask([&](const auto& one) { one.overlap(found, center_, pair.radius, false, true); });
  const FoundationRow& row = found.rows()[static_cast<std::size_t>(number)];
  double area = 0, peak = 0;
  Vec3 middle = Vec3::Zero(), push = Vec3::Zero();
  for (const FoundationPoint& one : found.points()) {
    if (one.row != number) continue;
    area += one.area, middle += one.area * one.point, push += one.force;
    peak = std::max(peak, one.pressure);
  }
  if (!(area > 0)) return unknown_patch(shown.depth);
  // Centroid of the area, and the second moments about it in the tangent plane.
  middle /= area;
  const Vec3 normal = row.normal(), east = normal.unitOrthogonal(), north = normal.cross(east);
  Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
  for (const FoundationPoint& one : found.points()) {
    if (one.row != number) continue;
    const Eigen::Vector2d away(east.dot(one.point - middle), north.dot(one.point - middle));
    moments += one.area * away * away.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solved(moments / area);
  const Eigen::Vector2d half = 2 * solved.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::Vector2d longer = solved.eigenvectors().col(1);
  const Vec3 axis =
      scene.state_of(active).world_from_j.rotation() * (longer[0] * east + longer[1] * north);
  // Damping is shared out as the elastic pressure is.
  PatchRow out{{half[1], half[0]}, {}, peak * force / push.norm(), force / area, shown.depth};
  std::copy_n(axis.data(), 3, out.axis);
  return out;
}

// The quadrature points stay where they are on the shell: there the pressure follows the center,
// and the border of the overlap adds nothing, as it bears no pressure.
void FoundationForces::slopes(const Pair& pair, std::size_t i, double relaxation,
                              const ContactSite& site, double normal_force,
                              ContactSlopes& out) const {
  if (pair.on_plane()) return slopes_below(pair, relaxation, site, normal_force, out);
  const FoundationLaw& law = *pair.law.foundation();
  const double kappa = law.modulus / law.thickness;
  const FoundationRow& row = foundation_.rows()[i];
  const Vec3 force = kappa * row.sum.force;
  const Mat3 slope = kappa * row.sum.slope;
  // The elastic force acts at the center; its moment about the shell's origin is c x f.
  out.wrench << force, center_.cross(force);
  out.by_place << slope, cross_matrix(center_) * slope - cross_matrix(force);
  out.by_twist.setZero();
  // Beside a border the closest point is not where the force points.
  out.depth_by_place = -row.away.transpose();
  out.normal_by_place = site.contact.dn_dc;
  const CoulombFriction* friction = sliding_friction(pair);
  for (const FoundationPoint& point : foundation_.points()) {
    if (point.row != static_cast<int>(i) || point.area == 0) continue;
    const Vec3 &x = point.point, &n = point.normal;
    const Vec3 v = site.twist.head<3>() + site.twist.tail<3>().cross(x);
    const Pressed pressed(law, friction, n, v);
    const double area = kappa * point.area;
    const Vec3 unit = area * ((pressed.share - 1) * n - pressed.drag * pressed.slip);
    const Mat3 by_velocity = area * point.pressure * pressed.by_velocity(law, friction, n);
    const Vec3 pressure_by = pressure_by_center(x - center_, pair.radius);
    const Mat3 by_place = unit * pressure_by.transpose();
    out.wrench.head<3>() += point.pressure * unit;
    out.wrench.tail<3>() += point.pressure * x.cross(unit);
    out.by_place.topRows<3>() += by_place;
    out.by_place.bottomRows<3>() += cross_matrix(x) * by_place;
    add_by_twist(by_velocity, x, out.by_twist);
  }
  if (pair.friction.has_state()) add_bristle(pair, i, relaxation, site, normal_force, out);
}

// Of the center of pressure, by the sphere's center.
Mat3 FoundationForces::center_slopes(std::size_t i, double radius) const {
  double all = 0;
  Vec3 first = Vec3::Zero(), all_by = Vec3::Zero();
  // Quotient rule for sum(p A x) / sum(p A); only p depends on the center.
  Mat3 first_by = Mat3::Zero();
  for (const FoundationPoint& point : foundation_.points()) {
    if (point.row != static_cast<int>(i)) continue;
    const Vec3 from = point.point - center_, by = point.area * pressure_by_center(from, radius);
    const double share = point.area * point.pressure;
    all += share, first += share * from;
    all_by += by, first_by += from * by.transpose();
  }
  // Without pressure the center of pressure moves with the sphere.
  if (!(all > 0)) return Mat3::Identity();
  return (first_by - first / all * all_by.transpose()) / all;
}

// The bristle's part of the wrench, and its rates. It follows from a contact whose normal force
// depends on nothing, less what that does without friction; the normal force's own derivatives,
// which are those of the pressure, pass through that of the friction by it.
void FoundationForces::add_bristle(const Pair& pair, std::size_t i, double relaxation,
                                   const ContactSite& site, double normal_force,
                                   ContactSlopes& out) const {
  const Vec3& n = site.contact.normal;
  // Of the pressure's force along the normal.
  const Vec3 push = out.wrench.head<3>();
  const Eigen::RowVector3d by_place =
      n.transpose() * out.by_place.topRows<3>() + push.transpose() * site.contact.dn_dc;
  const Eigen::Matrix<double, 1, 6> by_twist = n.transpose() * out.by_twist.topRows<3>();
  ContactSite at = site;
  at.disc_radius = 2 * pair.disc_radius();
  const Mat3 point_by = center_slopes(i, pair.radius);
  at.point_by = &point_by;
  const BristleSlopes bristle(pair.friction, relaxation, at, normal_force);
  out.wrench += bristle.all.wrench - bristle.without.wrench;
  // The disc follows the depth.
  const Eigen::RowVector3d depth_by = out.depth_by_place + n.transpose();
  out.by_place += bristle.all.by_place - bristle.without.by_place + bristle.by_force * by_place +
                  (bristle.all.by_depth - bristle.without.by_depth) * depth_by;
  out.by_twist += bristle.all.by_twist - bristle.without.by_twist + bristle.by_force * by_twist;
  for (int k = 0; k < pair.friction.rings(); ++k) {
    ContactSlopes::Ring& ring = out.rings[k] = bristle.all.rings[k];
    ring.rate_by_turn.setZero();
    ring.rate_by_place += bristle.rate_by_force(k) * by_place + ring.rate_by_depth * depth_by;
    ring.rate_by_twist += bristle.rate_by_force(k) * by_twist;
  }
}

// Beside a plane the points are the shell's and move with it; that the border of the area moves as
// well adds nothing. All in the frame of the plane, z = 0.
void FoundationForces::slopes_below(const Pair& pair, double relaxation, const ContactSite& site,
                                    double normal_force, ContactSlopes& out) const {
  const FoundationLaw& law = *pair.law.foundation();
  const double kappa = law.modulus / law.thickness;
  const Vec3 n = Vec3::UnitZ();
  const CoulombFriction* friction = sliding_friction(pair);
  Matrix6 by = Matrix6::Zero();  // of the wrench, by a displacement of the shell
  // First moment of the push, and its derivative.
  Vec3 first = Vec3::Zero();
  Matrix36 first_by = Matrix36::Zero();
  Row6 sum_by = Row6::Zero(), spread_by = Row6::Zero();
  double sum = 0;
  Vec3 off_center = Vec3::Zero();
  out.wrench.setZero(), out.by_twist.setZero();
  const std::vector<FoundationPoint>& points = foundation_.points();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3 &x = points[i].point, area = kappa * foundation_.areas()[i];
    const double depth = points[i].pressure, push = -area.z() * depth, half = depth * depth / 2;
    const Vec3 turned = area.cross(n), level(area.x(), area.y(), 0);
    Row6 depth_by, push_by;
    depth_by << -n.transpose(), -x.cross(n).transpose();
    push_by = -area.z() * depth_by;
    push_by.tail<3>() -= depth * turned.transpose();
    Matrix36 x_by;  // in the plane
    x_by << Mat3::Identity(), -cross_matrix(x - depth * n);
    x_by.row(2).setZero();
    // The first moment holds what the turn of the area adds where the surface has a border.
    first += push * x + half * level;
    first_by += x * push_by + push * x_by + depth * level * depth_by;
    Mat3 level_by = -half * cross_matrix(area);
    level_by.row(2).setZero();
    first_by.rightCols<3>() += level_by;
    sum += push, sum_by += push_by;
    const Vec3 from = x - center_;
    off_center += push * from;
    spread_by += from.squaredNorm() * push_by + 2 * push * from.transpose() * x_by;
    // Of friction and damping; the rest follows from the sums.
    const Vec3 v = site.twist.head<3>() + site.twist.tail<3>().cross(x);
    const Pressed pressed(law, friction, n, v);
    const Vec3 unit = (pressed.share - 1) * n - pressed.drag * pressed.slip;
    const Mat3 by_velocity = push * pressed.by_velocity(law, friction, n);
    const Matrix36 force_by =
        unit * push_by + by_velocity * cross_matrix(site.twist.tail<3>()) * x_by;
    out.wrench.head<3>() += push * unit;
    out.wrench.tail<3>() += push * x.cross(unit);
    by.topRows<3>() += force_by;
    by.bottomRows<3>() += cross_matrix(x) * force_by - push * cross_matrix(unit) * x_by;
    add_by_twist(by_velocity, x, out.by_twist);
  }
  out.wrench[2] += sum, out.wrench.tail<3>() += first.cross(n);
  by.row(2) += sum_by, by.bottomRows<3>() -= cross_matrix(n) * first_by;
  if (pair.friction.has_state()) {
    const double spread = spread_of(foundation_);
    const Matrix36 point_by = (first_by - first / sum * sum_by) / sum;
    spread_by -= 2 * off_center.transpose() * point_by + spread * sum_by;
    sphshell::add_bristle(pair.friction, relaxation, site, normal_force,
                          {spread, point_by, spread_by / sum}, by, out);
  }
  out.by_place = by.leftCols<3>(), out.by_turn = by.rightCols<3>();
  out.depth_by_place = -n.transpose(), out.depth_by_turn = -lowest_.point.cross(n).transpose();
  out.normal_by_place.setZero();
}

// The force of a row of a foundation, in place of that of its depth.
void FoundationForces::complete(const SceneData& scene, ActiveContact& active) const {
  const Pair& pair = scene.pair_of(active);
  const PairState& state = scene.state_of(active);
  const ContactKinematics<double>& m = active.kinematics;
  const auto& turn = state.world_from_j.rotation();
  const Vec3 center = state.world_from_j.act(center_);
  Vec3 velocity = Vec3::Zero(), spin = Vec3::Zero();
  if (pair.needs_velocity()) {
    velocity = turn.transpose() * scene.relative_velocity(pair, center);
    spin = turn.transpose() * scene.relative_spin(pair);
  }
  const std::size_t i = static_cast<std::size_t>(active.index);
  const FoundationForce found = force(pair, i, velocity, spin);
  const FoundationLaw& law = *pair.law.foundation();
  ContactForce<double>& f = active.force;
  f.elastic = found.elastic.norm();
  f.normal = std::max(0.0, active.contact.normal.dot(found.normal));
  const Vec3 whole = turn * (found.normal + found.friction);
  f.friction = whole - f.normal * m.normal;
  active.moment = turn * found.moment + (center - active.point).cross(whole);
  active.damping = found.damping, active.sliding = found.sliding;
  active.elastic = law.modulus / law.thickness * foundation_.rows()[i].sum.energy;
  active.pieces = i == 0 ? 1 : 0;
  if (!pair.friction.has_state()) return;
  // One bristle at the center of pressure.
  const double disc = disc_radius(pair, foundation_, m.depth);
  ContactForce<double> bristle;
  bristle.normal = f.normal, bristle.slip = f.slip;
  std::visit([&](const auto& one) { one.add(bristle, m, disc, scene.relaxation(pair)); },
             pair.friction.law);
  active.sliding = friction_power(bristle, m);
  bristle.elastic = f.elastic;
  bristle.friction += f.friction;
  f = bristle;
}

void FoundationForces::slopes(const SceneData& scene, const ActiveContact& active,
                              const ContactSite& site, ContactSlopes& out) const {
  const Pair& pair = scene.pair_of(active);
  slopes(pair, static_cast<std::size_t>(active.index), scene.relaxation(pair), site,
         active.force.normal, out);
}

bool FoundationForces::changed(SceneData& scene, const Pair& pair, const ActiveContact& active,
                               const ContactSite& site, ContactSlopes& out) const {
  // With scratch of its own, as this one holds the state of the scene.
  FoundationForces foundation;
  std::vector<Contact> contacts;
  if (const PlaneBelow* plane = std::get_if<PlaneBelow>(&pair.geometry)) {
    foundation.plane_from_shell_ = plane_from_shell_, foundation.lowest_ = lowest_;
    foundation.find_below(pair, *plane, contacts);
  } else {
    foundation.find(pair, site.place, true, contacts);
  }
  const std::size_t i = static_cast<std::size_t>(active.index);
  if (i >= contacts.size()) return false;
  ContactSite other = site;
  other.contact = contacts[i];
  other.radius = pair.radius;
  other.disc_radius = pair.disc_radius();
  const Vec3 spin = site.twist.tail<3>(),
             velocity = site.twist.head<3>() + spin.cross(foundation.center_);
  const Vec3 normal = foundation.force(pair, i, velocity, spin).normal;
  foundation.slopes(pair, i, scene.relaxation(pair), other,
                    std::max(0.0, other.contact.normal.dot(normal)), out);
  return true;
}

}  // namespace sphshell
