#include "contact/laws/bristle_slopes.hpp"

#include <algorithm>

namespace sphshell {

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
