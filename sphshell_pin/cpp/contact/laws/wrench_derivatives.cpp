#include "contact/laws/wrench_derivatives.hpp"

#include "contact/laws/dual.hpp"

namespace sphshell {
namespace {

// The law's outputs and their derivatives in axes that turn with the normal.
// By: the derivative with respect to each input of the law, a column of three for scalars, a 3 by 3
// matrix for vectors.
struct LawSlopes {
  struct By {
    Vec3 depth, spin, scale;
    Mat3 relative, rolling, stretch[kMostRings];
  };
  Vec3 force, moment, rate[kMostRings];  // force and moment on the sphere but for the weight
  By force_by, moment_by, rate_by[kMostRings];
};

// Seeds: depth, relative velocity and, of 8, spin and stretch, of 9, the scale as well, last; of
// 12, rolling, and of more the rings behind the first. The normal needs none, as a law does not
// change with the axes it is written in.
// The number of seeds is fixed at compile time, so that the arithmetic of Dual has no loop of
// unknown length; of the six combinations the smallest that has all inputs is taken.
constexpr int kSpin = 4, kStretch = 5, kRolling = 8, kOuter = 11;
constexpr int rings_of(int seeds) { return seeds > kOuter ? (seeds - kOuter) / 3 + 1 : 1; }
constexpr bool has_scale(int seeds) { return seeds > kRolling; }

// Sorts the derivatives of a vector by the seeds they belong to.
template <int N>
void read(const Vector3<Dual<N>>& x, Vec3& value, LawSlopes::By& by) {
  for (int i = 0; i < 3; ++i) {
    value[i] = x[i].value;
    by.depth[i] = x[i].slope[0];
    by.relative.row(i) = x[i].slope.template segment<3>(1);
    if constexpr (N > kSpin) {
      by.spin[i] = x[i].slope[kSpin];
      by.stretch[0].row(i) = x[i].slope.template segment<3>(kStretch);
    }
    if constexpr (N > kOuter) {
      by.rolling.row(i) = x[i].slope.template segment<3>(kRolling);
      for (int k = 1; k < rings_of(N); ++k)
        by.stretch[k].row(i) = x[i].slope.template segment<3>(kOuter + 3 * (k - 1));
    }
    by.scale[i] = has_scale(N) ? x[i].slope[N - 1] : 0;
  }
  if constexpr (N <= kSpin) by.spin.setZero(), by.stretch[0].setZero();
}

// One evaluation of the laws on dual numbers: the values are those of the simulation, as the code
// is the same template.
template <int N>
void differentiate(const NormalLaw& law, const FrictionLaw& friction, const ContactSite& site,
                   double relaxation, const ContactKinematics<double>& at, LawSlopes& out) {
  // Depth, velocity and, where the law has them, spin, stretches, rolling and scale become
  // variables; the normal is constant.
  using S = Dual<N>;
  ContactKinematics<S> m;
  m.depth = S::seed(at.depth, 0);
  for (int i = 0; i < 3; ++i) {
    m.normal[i] = at.normal[i];
    m.relative[i] = S::seed(at.relative[i], 1 + i);
    if constexpr (N > kSpin) m.bristle[i] = S::seed(at.bristle[i], kStretch + i);
    if constexpr (N > kOuter) m.rolling[i] = S::seed(at.rolling[i], kRolling + i);
  }
  if constexpr (has_scale(N)) m.scale = S::seed(at.scale, N - 1);
  if constexpr (N > kSpin) m.spin = S::seed(at.spin, kSpin);
  constexpr int most = rings_of(N) - 1;
  const int outer = std::min(most, friction.rings() - 1);
  Vector3<S> states[most + 1], rates[most + 1];
  if constexpr (most > 0) {
    for (int k = 0; k < outer; ++k)
      for (int i = 0; i < 3; ++i)
        states[k][i] = S::seed(site.stretch[k + 1][i], kOuter + 3 * k + i);
    m.outer = states;
    m.outer_rate = rates;
  }
  const ContactForce<S> f = contact_force(law, friction, site.disc_radius, relaxation, m);
  read<N>(f.normal * m.normal + f.friction, out.force, out.force_by);
  Vector3<S> moment = f.torsion * m.normal;
  if constexpr (N > kOuter) moment += f.rolling;
  read<N>(moment, out.moment, out.moment_by);
  read<N>(f.bristle_rate, out.rate[0], out.rate_by[0]);
  for (int k = 0; k < outer; ++k) read<N>(rates[k], out.rate[k + 1], out.rate_by[k + 1]);
}

// The rate of a stretch's turning with the normal, added to its slopes; see
// SceneData::rate_of_turning.
void add_turning(const ContactSite& site, int k, const Mat3& normal_by_place,
                 const Eigen::RowVector3d& weight_by_place, ContactSlopes::Ring& ring) {
  const Contact& contact = site.contact;
  const Vec3 spin = site.twist.tail<3>();
  const Mat3 normal_rate_by_velocity = contact.dn_dc / contact.weight;
  const Vec3 normal_rate =
      normal_rate_by_velocity * (site.twist.head<3>() + spin.cross(site.place));
  const Mat3 n = cross_matrix(contact.normal), by_velocity = n * normal_rate_by_velocity;
  const Vec3 turning = contact.normal.cross(normal_rate);
  const Mat3 by_place = by_velocity * cross_matrix(spin) -
                        cross_matrix(normal_rate) * normal_by_place -
                        turning * weight_by_place / contact.weight;
  // The rate is turning x stretch = -stretch x turning, in the shell's frame, with turning = n x
  // n'.
  const Mat3 against_stretch = -cross_matrix(site.stretch[k]);
  ring.rate_by_place += against_stretch * by_place;
  ring.rate_by_twist.leftCols<3>() += against_stretch * by_velocity;
  ring.rate_by_twist.rightCols<3>() -= against_stretch * by_velocity * cross_matrix(site.place);
  ring.rate_by_stretch[k] += cross_matrix(turning);
}

}  // namespace

void contact_slopes(const NormalLaw& law, const FrictionLaw& friction, double relaxation,
                    const ContactSite& site, ContactSlopes& out) {
  const Contact& contact = site.contact;
  const Vec3 &n = contact.normal, &point = contact.point, spin = site.twist.tail<3>();
  const double weight = contact.weight;

  // How the contact follows its place.
  // dn_dc is the derivative of weight * n: its part along n is that of the weight, the rest turns
  // n. The depth falls as the center moves along n. The point is c - (R - depth) n.
  Mat3 normal_by = Mat3::Zero(), point_by = Mat3::Zero();
  Eigen::RowVector3d depth_by = -n.transpose(), weight_by = Eigen::RowVector3d::Zero();
  if (site.follows) {
    weight_by = n.transpose() * contact.dn_dc;
    normal_by = (contact.dn_dc - n * weight_by) / weight;
    depth_by *= std::abs(weight);
    point_by = Mat3::Identity() + n * depth_by - (site.radius - contact.depth) * normal_by;
    if (site.point_by) point_by = *site.point_by;
    if (site.shape) depth_by -= site.shape->tilt.transpose();
  }
  out.depth_by_place = depth_by;
  out.normal_by_place = normal_by;

  ContactKinematics<double> m;
  m.depth = site.shape ? site.shape->depth : contact.depth;
  m.normal = n;
  m.relative = site.twist.head<3>() + spin.cross(point);
  m.spin = n.dot(spin);
  m.bristle = site.stretch[0];
  // Relative velocity at the contact point, from the twist about the shell's origin: v + w x p.
  LawSlopes at;
  const bool rolls = friction.rolls();
  const Mat3 across = Mat3::Identity() - n * n.transpose();
  const int outer = friction.rings() - 1;
  if (rolls) m.rolling = across * spin;
  Eigen::RowVector3d scale_by = Eigen::RowVector3d::Zero();
  if (site.shape) {
    m.scale = site.shape->scale;
    scale_by = site.shape->gradient.transpose();
  }
  if (outer > 3)
    differentiate<kOuter + 3 * (kMostRings - 1) + 1>(law, friction, site, relaxation, m, at);
  else if (outer > 0)
    differentiate<kOuter + 9 + 1>(law, friction, site, relaxation, m, at);
  else if (rolls)
    differentiate<kOuter + 1>(law, friction, site, relaxation, m, at);
  else if (site.shape)
    differentiate<kRolling + 1>(law, friction, site, relaxation, m, at);
  else if (friction.has_state())
    differentiate<kRolling>(law, friction, site, relaxation, m, at);
  else
    differentiate<kSpin>(law, friction, site, relaxation, m, at);

  // The turning of the normal is a rotation of all vectors of the law, and what is left of their
  // change goes through its slopes.
  // The rotation vector of the normal's turning by a displacement of the place: n x dn.
  const Mat3 turned_by = cross_matrix(n) * normal_by;
  const Mat3 relative_by = cross_matrix(spin) * point_by + cross_matrix(m.relative) * turned_by;
  const Mat3 stretch_by = cross_matrix(m.bristle) * turned_by;
  const Eigen::RowVector3d spin_by = spin.transpose() * normal_by;
  // Change at a fixed twist: the law's inputs change in the axes that turn, and the result turns
  // with them; -[value]x is that turning.
  const auto by_place = [&](const Vec3& value, const LawSlopes::By& by) -> Mat3 {
    Mat3 all = by.depth * depth_by + by.relative * relative_by + by.spin * spin_by +
               by.stretch[0] * stretch_by + by.scale * scale_by - cross_matrix(value) * turned_by;
    if (rolls) all += by.rolling * across * cross_matrix(spin) * turned_by;
    for (int k = 1; k <= outer; ++k)
      all += by.stretch[k] * cross_matrix(site.stretch[k]) * turned_by;
    return all;
  };
  const Mat3 arm = cross_matrix(point);
  // At a fixed place: relative velocity is v - p x w, spin is n . w, rolling the rest of w.
  const auto by_twist = [&](const LawSlopes::By& by) -> Matrix36 {
    Matrix36 all;
    all << by.relative, by.spin * n.transpose() - by.relative * arm;
    if (rolls) all.rightCols<3>() += by.rolling * across;
    return all;
  };

  // Product rule in the weight; the moment about the shell's origin is p x f + m.
  const Vec3 force = weight * at.force;
  const Mat3 force_by_place = at.force * weight_by + weight * by_place(at.force, at.force_by);
  const Matrix36 force_by_twist = weight * by_twist(at.force_by);
  out.wrench << force, point.cross(force) + weight * at.moment;
  out.by_place.topRows<3>() = force_by_place;
  out.by_place.bottomRows<3>() = arm * force_by_place - cross_matrix(force) * point_by +
                                 at.moment * weight_by + weight * by_place(at.moment, at.moment_by);
  out.by_depth.head<3>() = weight * at.force_by.depth;
  out.by_depth.tail<3>() = weight * (arm * at.force_by.depth + at.moment_by.depth);
  out.by_twist.topRows<3>() = force_by_twist;
  out.by_twist.bottomRows<3>() = arm * force_by_twist + weight * by_twist(at.moment_by);
  if (site.shape && law.hertz()) {
    // Of the force at the sphere's center, see SceneData::compute_force.
    const HertzLaw& hertz = *law.hertz();
    const ContactShape& shape = *site.shape;
    // With W = scale w(depth): the force beside the normal is scale w' tilt - w grad(scale), and w'
    // = push.
    const double energy = hertz.energy(m.depth, 1);
    const NormalForce<Dual<1>> unit =
        hertz.force(Dual<1>::seed(m.depth, 0), Dual<1>(0), Dual<1>(1));
    const double push = unit.elastic.value, push_by = unit.elastic.slope[0];
    const Vec3 climb = weight * (shape.scale * push * shape.tilt - energy * shape.gradient);
    const Mat3 by =
        weight * (push * shape.tilt * scale_by + shape.scale * push_by * shape.tilt * depth_by +
                  shape.scale * push * shape.tilt_by - push * shape.gradient * depth_by -
                  energy * shape.second);
    out.wrench.head<3>() += climb;
    out.wrench.tail<3>() += site.place.cross(climb);
    out.by_place.topRows<3>() += by;
    out.by_place.bottomRows<3>() += cross_matrix(site.place) * by - cross_matrix(climb);
    const Vec3 by_depth = weight * (shape.scale * push_by * shape.tilt - push * shape.gradient);
    out.by_depth.head<3>() += by_depth;
    out.by_depth.tail<3>() += site.place.cross(by_depth);
  }
  if (!friction.has_state()) return;
  // The stretch z acts through the law alone; z is in the shell's frame like everything else.
  const auto by_stretch = [&](const Mat3& force, const Mat3& moment) -> Matrix63 {
    Matrix63 all;
    all.topRows<3>() = weight * force;
    all.bottomRows<3>() = weight * (arm * force + moment);
    return all;
  };
  for (int k = 0; k <= outer; ++k) {
    ContactSlopes::Ring& ring = out.rings[k];
    const LawSlopes::By& by = at.rate_by[k];
    ring.by_stretch = by_stretch(at.force_by.stretch[k], at.moment_by.stretch[k]);
    ring.rate = at.rate[k];
    ring.rate_by_depth = by.depth;
    ring.rate_by_place = by_place(at.rate[k], by);
    ring.rate_by_twist = by_twist(by);
    std::copy_n(by.stretch, outer + 1, ring.rate_by_stretch);
    if (site.follows) add_turning(site, k, normal_by, weight_by, ring);
  }
}

BristleSlopes::BristleSlopes(const FrictionLaw& friction, double relaxation, const ContactSite& at,
                             double normal_force) {
  const double size = std::max(normal_force, 1e-300);
  share = at.contact.depth / size;
  NormalLaw held, steep;
  held.law = ImpactLaw({size, 0});
  steep.law = ImpactLaw({size / at.contact.depth, 1});
  contact_slopes(held, friction, relaxation, at, all);
  contact_slopes(held, FrictionLaw(), relaxation, at, without);
  contact_slopes(steep, friction, relaxation, at, more);
  Vector6 normal_by_depth;
  normal_by_depth << at.contact.normal, at.contact.point.cross(at.contact.normal);
  by_force = (more.by_depth - all.by_depth) * share - normal_by_depth;
}

void add_bristle(const FrictionLaw& friction, double relaxation, const ContactSite& site,
                 double normal_force, const SpreadSlopes& slopes, Matrix6& by, ContactSlopes& out) {
  const Row6 normal_by = by.row(2), normal_by_twist = out.by_twist.row(2);
  static const Mat3 kCarried = Mat3::Identity();
  ContactSite at = site;
  at.place = at.contact.point, at.point_by = &kCarried,
  at.disc_radius = disc_of_spread(slopes.spread, at.contact.depth);
  const BristleSlopes bristle(friction, relaxation, at, normal_force);
  // The disc's radius goes with the root of the depth, and really with that of the spread.
  const Row6 depth_by =
      slopes.spread > 0 ? Row6(at.contact.depth / slopes.spread * slopes.spread_by) : Row6::Zero();
  out.wrench += bristle.all.wrench - bristle.without.wrench;
  by += (bristle.all.by_place - bristle.without.by_place) * slopes.point_by +
        (bristle.all.by_depth - bristle.without.by_depth) * depth_by + bristle.by_force * normal_by;
  out.by_twist +=
      bristle.all.by_twist - bristle.without.by_twist + bristle.by_force * normal_by_twist;
  for (int k = 0; k < friction.rings(); ++k) {
    ContactSlopes::Ring& ring = out.rings[k] = bristle.all.rings[k];
    const Matrix36 rate_by = ring.rate_by_place * slopes.point_by + ring.rate_by_depth * depth_by +
                             bristle.rate_by_force(k) * normal_by;
    ring.rate_by_place = rate_by.leftCols<3>(), ring.rate_by_turn = rate_by.rightCols<3>();
    ring.rate_by_twist += bristle.rate_by_force(k) * normal_by_twist;
  }
}

}  // namespace sphshell
