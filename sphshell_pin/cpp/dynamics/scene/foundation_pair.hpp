// The contacts of a pair with a FoundationLaw: one for each patch of the shell that the ball
// overlaps.
#pragma once

#include <vector>

#include "contact/laws/foundation.hpp"
#include "contact/laws/wrench_derivatives.hpp"
#include "dynamics/scene/contact_row.hpp"
#include "dynamics/scene/pair.hpp"

namespace sphshell {

// What acts on the sphere at one row, in the shell's frame.
struct FoundationForce {
  Vec3 elastic, normal;             // elastic: through the center; normal: with damping [N]
  Vec3 friction;                    // of what friction every point has by itself [N]
  Vec3 moment;                      // of the normal force and that friction, about the center [N m]
  double damping = 0, sliding = 0;  // power lost [W]
};

class FoundationPair {
 public:
  // The rows as contacts, with dn_dc where `slopes`. Rows point where they push.
  void find(const Pair& pair, const Vec3& center, bool slopes, std::vector<Contact>& contacts);

  // Of row i, where the sphere's body moves with `velocity` at the center and turns with `spin`
  // against the shell.
  FoundationForce force(const Pair& pair, std::size_t i, const Vec3& velocity,
                        const Vec3& spin) const;
  double energy(const Pair& pair, std::size_t i) const;  // [J]

  // Of row i: the ellipse with the area's second moments, and the pressures under `force` [N];
  // `rotation` is that of the shell in the world.
  PatchRow patch(const Pair& pair, std::size_t i, const Mat3& rotation, double force) const;

  // As contact_slopes(), for row i.
  void slopes(const Pair& pair, std::size_t i, double relaxation, const ContactSite& site,
              double normal_force, ContactSlopes& out) const;

 private:
  Mat3 center_slopes(std::size_t i, double radius) const;
  void add_bristle(const Pair& pair, std::size_t i, double relaxation, const ContactSite& site,
                   double normal_force, ContactSlopes& out) const;

  Vec3 center_ = Vec3::Zero();
  Foundation foundation_;
};

}  // namespace sphshell
