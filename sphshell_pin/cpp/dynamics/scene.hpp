// The contact pairs of a multibody model, and the forces they exert at a state.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "contact/laws.hpp"
#include "contact/query.hpp"
#include "contact/tracker.hpp"
#include "dynamics/multibody.hpp"

namespace sphshell {

using SE3 = pinocchio::SE3;

// A user's own contact points: poses of both frames in, contacts (points and normals in the world,
// normals from j to i) out.
using ContactSource =
    std::function<void(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& contacts)>;

// Body i carries the sphere, body j the shell. With a source, both placements are those of its
// frames; else `placement_i` holds the sphere's centre and `placement_j` the shell.
struct Pair {
  std::string name;
  int joint_i = 0, joint_j = 0;
  SE3 placement_i = SE3::Identity(), placement_j = SE3::Identity();
  double radius = 0;
  std::shared_ptr<const Shell> shell;
  ContactSource source;
  Method method = Method::Facets;
  NormalLaw law;
  CoulombLaw friction;

  bool needs_velocity() const { return law.needs_rate() || friction.active; }
};

// One pair at one state.
struct PairState {
  int count = 0;
  double depth = 0;         // largest [m]
  double normal_force = 0;  // sum [N]
};

// Losses of all pairs at one state, and what is stored in them.
struct Powers {
  double damping = 0, friction = 0;  // [W]
  double elastic = 0;                // [J]
};

// Columns of one logged contact.
struct ContactRow {
  static constexpr int kColumns = 18;
  double pair, point[3], normal[3], depth, normal_force, friction[3], slip[3], element, feature,
      number;
};
static_assert(sizeof(ContactRow) == ContactRow::kColumns * sizeof(double));

class Scene {
 public:
  Scene(const pinocchio::Model& model, std::vector<Pair> pairs);

  // Contact forces at (q, v). Powers, and velocities where no law needs them, only with `audit`.
  // `accepted`: the state is the next one of a run, and contacts go on from those of the last.
  void evaluate(const VectorX& q, const VectorX& v, bool audit, std::vector<ContactRow>* log,
                bool accepted = false);
  // The acceleration at the state of the last evaluate().
  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau);

  // Somebody else reads the placement and velocity of this joint after evaluate().
  void need_velocity_of(int joint);

  bool touching() const { return touching_; }
  // Per joint, in its frame and about its origin; holds old values unless touching().
  const Forces& external() const { return external_; }
  const std::vector<PairState>& states() const { return states_; }
  const Powers& powers() const { return powers_; }
  const std::vector<Pair>& pairs() const { return pairs_; }
  Multibody& body() { return body_; }
  const Multibody& body() const { return body_; }

 private:
  const std::vector<Contact>& find(const Pair& pair, Query& query, const SE3& world_from_j);
  void apply(int joint, const Vec3& point_world, const Vec3& force_world);
  Vec3 velocity_at(int joint, const Vec3& point_world) const;

  Multibody body_;
  std::vector<Pair> pairs_;
  std::vector<Query> queries_;
  std::vector<ContactTracker> trackers_;
  std::vector<PairState> states_;
  Forces external_;
  std::vector<int> pushed_;  // joints whose entry in external_ is not zero
  Powers powers_;
  bool touching_ = false;
  bool needs_velocity_ = false;
};

}  // namespace sphshell
