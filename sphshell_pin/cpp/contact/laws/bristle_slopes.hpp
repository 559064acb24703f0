// How a bristle answers the motion where its normal force is that of an area, or of several places.
#pragma once

#include "contact/laws/wrench_derivatives.hpp"

namespace sphshell {

// A contact of a constant normal force with and without friction, and how the wrench and the rates
// of bristles answer that force. The force passes for one in proportion to the depth.
struct BristleSlopes {
  ContactSlopes all, without, more;
  Vector6 by_force;
  double share;  // depth over force

  BristleSlopes(const FrictionLaw& friction, double relaxation, const ContactSite& at,
                double normal_force);
  Vec3 rate_by_force(int ring) const {
    return (more.rings[ring].rate_by_depth - all.rings[ring].rate_by_depth) * share;
  }
};

// A contact beside a plane whose disc has the second moment of places that are `spread` about its
// point: the mean square of their distance [m^2]. Here for the laws, whose disc is Hertz's, a^2 =
// radius depth.
inline double disc_of_spread(double spread, double depth) { return 2.5 * spread / depth; }

// What a displacement of the shell does to it.
struct SpreadSlopes {
  double spread;
  Matrix36 point_by;
  Row6 spread_by;
};

// Adds the bristle's part to the wrench and its derivatives by twists, in `out`, and displacements,
// `by`, which hold those of the normal force and other friction; sets those of its rates.
void add_bristle(const FrictionLaw& friction, double relaxation, const ContactSite& site,
                 double normal_force, const SpreadSlopes& slopes, Matrix6& by, ContactSlopes& out);

}  // namespace sphshell
