#include "contact/laws/wrench_derivatives.hpp"

#include "contact/laws/dual.hpp"

namespace sphshell {
namespace {

// Seeds: the place, the velocity at the shell's origin, the depth alone, the stretches of the
// rings, and last, for laws that resist it, the angular velocity. The velocity at the contact has
// that as well: what it does there is known by the velocity.
constexpr int kVelocity = 3, kDepth = 6, kStretch = 7;

// A number or a vector that follows the place.
template <int N>
Dual<N> following(double value, const Eigen::RowVector3d& by_place) {
  Dual<N> out(value);
  out.slope.template head<3>() = by_place.transpose();
  return out;
}

template <int N>
Vector3<Dual<N>> following(const Vec3& value, const Mat3& by_place) {
  Vector3<Dual<N>> out;
  for (int i = 0; i < 3; ++i) out[i] = following<N>(value[i], by_place.row(i));
  return out;
}

// The same of what changes with seeds from the first one on as well.
template <int N>
Vector3<Dual<N>> following(const Vec3& value, const Mat3& by_place, int first, const Mat3& by) {
  Vector3<Dual<N>> out = following<N>(value, by_place);
  for (int i = 0; i < 3; ++i) out[i].slope.template segment<3>(first) = by.row(i).transpose();
  return out;
}

template <int N>
Vector3<Dual<N>> seeds(const Vec3& value, int first) {
  return following<N>(value, Mat3::Zero(), first, Mat3::Identity());
}

// How a contact follows its place.
struct Following {
  Mat3 point = Mat3::Zero(), normal = Mat3::Zero();
  Eigen::RowVector3d depth, weight = Eigen::RowVector3d::Zero();
};

// The wrench of SceneData::add_force on dual numbers: the laws are those of the simulation, as the
// code is the same template. The number of seeds is fixed at compile time, so that the arithmetic
// of Dual has no loop of unknown length.
template <int most, bool spins>
void differentiate(const NormalLaw& law, const FrictionLaw& friction, double relaxation,
                   const ContactSite& site, const Following& by, ContactSlopes& out) {
  // An even number is faster.
  constexpr int used = kStretch + 3 * most + 3 * spins, N = used + used % 2;
  using S = Dual<N>;
  const Contact& contact = site.contact;
  const Vector3<S> n = following<N>(contact.normal, by.normal);
  const Vector3<S> point = following<N>(contact.point, by.point);
  const Vec3 velocity = site.twist.head<3>(), turn = site.twist.tail<3>();
  const S weight = following<N>(contact.weight, by.weight);
  ContactKinematics<S> m;
  m.depth = following<N>(site.shape ? site.shape->depth : contact.depth, by.depth);
  m.depth.slope[kDepth] = 1;
  m.normal = n;
  m.relative = following<N>(velocity + turn.cross(contact.point), cross_matrix(turn) * by.point,
                            kVelocity, Mat3::Identity());
  if constexpr (spins) {
    const Vector3<S> spin = seeds<N>(turn, N - 3);
    m.spin = n.dot(spin);
    if (friction.rolls()) m.rolling = spin - m.spin * n;
  }
  if (site.shape) m.scale = following<N>(site.shape->scale, site.shape->gradient.transpose());
  const int rings = std::min(most, friction.rings());
  Vector3<S> states[most + 1], rates[most + 1];
  for (int k = 0; k < rings; ++k) states[k] = seeds<N>(site.stretch[k], kStretch + 3 * k);
  m.bristle = states[0];
  m.outer = states + 1, m.outer_rate = rates + 1;
  const ContactForce<S> f = contact_force(law, friction, site.disc_radius, relaxation, m);
  rates[0] = f.bristle_rate;

  // The moment is about the shell's origin.
  Vector3<S> force = weight * (f.normal * n + f.friction), moment = point.cross(force);
  if constexpr (spins) moment += weight * (f.torsion * n + f.rolling);
  if (site.shape && law.hertz()) {
    // Of the force at the sphere's center, see SceneData::compute_force. With W = scale w(depth)
    // the force beside the normal is scale w' tilt - w grad(scale), and w' = push.
    const ContactShape& shape = *site.shape;
    const S push = law.hertz()->force(m.depth, S(0), S(1)).elastic;
    const S energy(law.hertz()->energy(m.depth.value, 1), push.value * m.depth.slope);
    const Vector3<S> climb = weight * (m.scale * push * following<N>(shape.tilt, shape.tilt_by) -
                                       energy * following<N>(shape.gradient, shape.second));
    force += climb, moment += seeds<N>(site.place, 0).cross(climb);
  }
  // By the twist, of what depends on the velocity at a point.
  const auto by_twist = [](const S& x, const Vec3& arm) -> Row6 {
    const Vec3 by_velocity = x.slope.template segment<3>(kVelocity);
    Row6 all;
    all << by_velocity.transpose(), arm.cross(by_velocity).transpose();
    if constexpr (spins) all.tail<3>() += x.slope.template tail<3>().matrix().transpose();
    return all;
  };
  for (int i = 0; i < 6; ++i) {
    const S& x = i < 3 ? force[i] : moment[i - 3];
    out.wrench[i] = x.value;
    out.by_place.row(i) = x.slope.template head<3>();
    out.by_twist.row(i) = by_twist(x, contact.point);
    out.by_depth[i] = x.slope[kDepth];
    for (int k = 0; k < rings; ++k)
      out.rings[k].by_stretch.row(i) = x.slope.template segment<3>(kStretch + 3 * k);
  }
  Vector3<S> turning = Vector3<S>::Zero();
  if (site.follows && most > 0) {
    const Mat3 normal_by = contact.dn_dc / contact.weight;
    const Vec3 rate = normal_by * (velocity + turn.cross(site.place));
    turning = n.cross(
        following<N>(rate, normal_by * cross_matrix(turn) - rate * by.weight / contact.weight,
                     kVelocity, normal_by));
  }
  for (int k = 0; k < rings; ++k) {
    ContactSlopes::Ring& ring = out.rings[k];
    // The rate of a stretch's turning with the normal counts in the slopes alone; see
    // SceneData::rate_of_turning.
    const Vector3<S> turned = turning.cross(states[k]);
    for (int i = 0; i < 3; ++i) {
      const typename S::Slope all = rates[k][i].slope + turned[i].slope;
      ring.rate[i] = rates[k][i].value;
      ring.rate_by_place.row(i) = all.template head<3>();
      ring.rate_by_twist.row(i) =
          by_twist(rates[k][i], contact.point) + by_twist(turned[i], site.place);
      ring.rate_by_depth[i] = all[kDepth];
      for (int l = 0; l < rings; ++l)
        ring.rate_by_stretch[l].row(i) = all.template segment<3>(kStretch + 3 * l);
    }
  }
}

}  // namespace

// dn_dc is the derivative of weight * n: its part along n is that of the weight, the rest turns n.
// The depth falls as the center moves along n. The point is c - (R - depth) n.
void contact_slopes(const NormalLaw& law, const FrictionLaw& friction, double relaxation,
                    const ContactSite& site, ContactSlopes& out) {
  const Contact& contact = site.contact;
  const Vec3& n = contact.normal;
  Following by;
  by.depth = -n.transpose();
  if (site.follows) {
    by.weight = n.transpose() * contact.dn_dc;
    by.normal = (contact.dn_dc - n * by.weight) / contact.weight;
    by.depth *= std::abs(contact.weight);
    by.point =
        site.point_by
            ? *site.point_by
            : Mat3(Mat3::Identity() + n * by.depth - (site.radius - contact.depth) * by.normal);
    if (site.shape) by.depth -= site.shape->tilt.transpose();
  }
  out.depth_by_place = by.depth;
  out.normal_by_place = by.normal;
  const int rings = friction.has_state() ? friction.rings() : 0;
  const auto run = rings == 0                                 ? differentiate<0, false>
                   : rings > 4                                ? differentiate<kMostRings, true>
                   : rings > 1                                ? differentiate<4, true>
                   : friction.torsional() || friction.rolls() ? differentiate<1, true>
                                                              : differentiate<1, false>;
  run(law, friction, relaxation, site, by, out);
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
