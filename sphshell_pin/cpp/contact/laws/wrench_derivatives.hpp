// How the wrench of one contact, and the rate of its bristle, change with the relative motion.
#pragma once

#include "sphshell_pin/laws/friction.hpp"
#include "contact/laws/hertz.hpp"
#include "contact/query/query.hpp"

namespace sphshell {

using Vector6 = Eigen::Matrix<double, 6, 1>;  // a twist or a wrench, linear part first
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix63 = Eigen::Matrix<double, 6, 3>;
using Matrix36 = Eigen::Matrix<double, 3, 6>;
using Row6 = Eigen::Matrix<double, 1, 6>;  // of a number, by a displacement

// A contact and the motion of the sphere's body against the shell; all in the shell's frame, twists
// and wrenches about its origin.
struct ContactSite {
  Contact contact;
  // What the contact follows: the sphere's center. Of a contact source, which does not say how its
  // contacts follow, the contact point, and the contact itself stays where it is.
  Vec3 place;
  bool follows;
  double radius;       // of the sphere [m]
  double disc_radius;  // that the laws take: see Pair::disc_radius [m]
  Vector6 twist;
  Vec3 stretch[kMostRings] = {};        // of the bristle's rings [m]
  const ContactShape* shape = nullptr;  // of Hertz's law
  // By its place, of a contact point that is no point of the sphere's normal.
  const Mat3* point_by = nullptr;
  // How the place moves on the body as that turns: zero but of a shell on a plane, whose lowest
  // point it is.
  Mat3 place_by_turn = Mat3::Zero();
};

// Derivatives at a ContactSite. `place`: a displacement of what the contact follows, `twist`: the
// relative twist, `depth`: alone. `turn`: a rotation about the origin, besides what it does to the
// place; zero but beside a plane whose foundation has a shell's area for its contact.
struct ContactSlopes {
  Eigen::RowVector3d depth_by_place, depth_by_turn;
  Mat3 normal_by_place;
  Vector6 wrench;              // on the sphere's body
  Matrix63 by_place, by_turn;  // of the wrench
  Matrix6 by_twist;
  Vector6 by_depth;  // where the contact stays where it is
  // Of each ring of a bristle, whose state is a stretch.
  struct Ring {
    Matrix63 by_stretch;       // of the wrench
    Vec3 rate, rate_by_depth;  // of the stretch; without its turning with the normal
    Mat3 rate_by_place, rate_by_turn;
    Matrix36 rate_by_twist;
    Mat3 rate_by_stretch[kMostRings];  // by that of each ring
  } rings[kMostRings];
};

// Exact, but that the contact's turn is held where the bristle turns with the normal: what that
// leaves out is of the order of the stretch times the square of the curvature.
void contact_slopes(const NormalLaw& law, const FrictionLaw& friction, double relaxation,
                    const ContactSite& site, ContactSlopes& out);

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
