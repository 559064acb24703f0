// How the contacts of a pair become forces. Both kinds answer the same questions.
#pragma once

#include "contact/faces/crown.hpp"
#include "dynamics/scene/contact_row.hpp"
#include "dynamics/scene/pair.hpp"

namespace sphshell {

class SceneData;
struct ActiveContact;

// Where nothing is known of the bodies that touch.
inline PatchRow unknown_patch(double depth) {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  return {{nan, nan}, {nan, nan, nan}, nan, nan, depth};
}

// Each kind has
// - kDepthHeld: whether the forces of a changed pair are found where the contacts are, so that what
//   follows from their depths is added; else they are found anew, with all that follows;
// - find: the contacts of the pair at a center, with dn_dc where `slopes` and where it is known;
// - complete: what the law at a point, which has been evaluated, leaves out; power and energy of
//   the contact;
// - is_wide: whether it has a shell's area, or several of its corners, for its contact: derivatives
//   by turns are then given besides those by the place;
// - patch: where the bodies touch, under the force of the row;
// - slopes: the wrench and the rates of bristles by the motion;
// - changed: the same of a pair with another parameter; false where it has no such contact.

// Each contact is a point where the laws of the pair act on a depth. Beside a plane those of flat
// faces and lines are shared: damping and friction act at each place with its share.
class PointForces {
 public:
  static constexpr bool kDepthHeld = true;

  template <class Pose>
  void find(const Pair& pair, const Pose& pose_i, const SE3& pose_j, const Vec3& center, bool,
            Query& query) {
    num_shared_ = 0;
    const PlaneBelow* plane = std::get_if<PlaneBelow>(&pair.geometry);
    if (plane && plane->flats().any()) return find_shared(*plane, pose_j.actInv(pose_i()), query);
    pair.ask([&](const auto& one) { one.find(pose_i, pose_j, center, pair.radius, query); });
  }
  bool is_wide(const Pair&, const Contact& contact) const { return shared(contact) != nullptr; }
  void complete(const SceneData& scene, ActiveContact& active) const;
  PatchRow patch(SceneData& scene, const ActiveContact& active, const ContactRow& row) const;
  void slopes(const SceneData& scene, const ActiveContact& active, const ContactSite& site,
              ContactSlopes& out) const;
  bool changed(SceneData& scene, const Pair& pair, const ActiveContact& active,
               const ContactSite& site, ContactSlopes& out) const;

 private:
  void find_shared(const PlaneBelow& plane, const SE3& plane_from_shell, Query& query);
  // Of a contact, or null.
  const SharedContact* shared(const Contact& contact) const;
  void slopes(const Pair& pair, double relaxation, const SharedContact& shared,
              const ContactSite& site, ContactSlopes& out) const;

  Crown crown_;
  std::vector<SharedContact> shared_;
  std::size_t num_shared_ = 0;  // of them; the rest is kept for its memory
};

// What acts on the sphere at one row, in the shell's frame.
struct FoundationForce {
  Vec3 elastic, normal;             // elastic: through the center; normal: with damping [N]
  Vec3 friction;                    // of what friction every point has by itself [N]
  Vec3 moment;                      // of the normal force and that friction, about the center [N m]
  double damping = 0, sliding = 0;  // power lost [W]
};

// Each contact is a patch of the body that the sphere overlaps, a row: a FoundationLaw's pressure
// acts on all of it. Its point is the center of pressure, its normal the direction of the force.
class FoundationForces {
 public:
  static constexpr bool kDepthHeld = false;

  template <class Pose>
  void find(const Pair& pair, const Pose& pose_i, const SE3& pose_j, const Vec3& center,
            bool slopes, Query& query) {
    const PlaneBelow* plane = std::get_if<PlaneBelow>(&pair.geometry);
    if (!plane) return find(pair, center, slopes || pair.friction.has_state(), query.contacts);
    // Its lowest point first: most often there is none.
    plane_from_shell_ = pose_j.actInv(pose_i());
    plane->find(plane_from_shell_, 0, query);
    if (query.contacts.empty()) return;
    lowest_ = query.contacts.front();
    find_below(pair, *plane, query.contacts);
  }
  void find(const Pair& pair, const Vec3& center, bool slopes, std::vector<Contact>& contacts);
  bool is_wide(const Pair& pair, const Contact&) const { return pair.on_plane(); }
  // Of a shell whose lowest point is known.
  void find_below(const Pair& pair, const PlaneBelow& plane, std::vector<Contact>& contacts);
  void complete(const SceneData& scene, ActiveContact& active) const;
  // The ellipse with the area's second moments, and the pressures.
  PatchRow patch(SceneData& scene, const ActiveContact& active, const ContactRow& row) const;
  void slopes(const SceneData& scene, const ActiveContact& active, const ContactSite& site,
              ContactSlopes& out) const;
  bool changed(SceneData& scene, const Pair& pair, const ActiveContact& active,
               const ContactSite& site, ContactSlopes& out) const;

 private:
  // Of row i, where the sphere's body moves with `velocity` at the center and turns with `spin`
  // against the shell.
  FoundationForce force(const Pair& pair, std::size_t i, const Vec3& velocity,
                        const Vec3& spin) const;
  void slopes(const Pair& pair, std::size_t i, double relaxation, const ContactSite& site,
              double normal_force, ContactSlopes& out) const;
  void slopes_below(const Pair& pair, double relaxation, const ContactSite& site,
                    double normal_force, ContactSlopes& out) const;
  // See the definitions: the derivative of the center of pressure, and what a bristle adds.
  Mat3 center_slopes(std::size_t i, double radius) const;
  void add_bristle(const Pair& pair, std::size_t i, double relaxation, const ContactSite& site,
                   double normal_force, ContactSlopes& out) const;

  Vec3 center_ = Vec3::Zero();  // of the sphere; beside a plane, of the pressure
  Foundation foundation_;
  SE3 plane_from_shell_ = SE3::Identity();
  Contact lowest_;  // beside a plane
};

using PairForces = std::variant<PointForces, FoundationForces>;

}  // namespace sphshell
