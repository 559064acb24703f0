// The contact pairs of a multibody model, and the forces they exert at a state.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "contact/friction.hpp"
#include "contact/query.hpp"
#include "contact/tracker.hpp"
#include "dynamics/bristles.hpp"
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
  FrictionLaw friction;
  double relaxation = 2e-5;  // in which bristles give way beyond their limit [s]

  bool needs_velocity() const { return law.needs_rate() || friction.active(); }
};

// One pair at one state.
struct PairState {
  int count = 0;            // of contacts, passes not counted
  int pieces = 0;           // of contacts, less passes: changes where a depth goes through zero
  int clamped = 0;          // of them, how many the law's clamp holds at no force
  double depth = 0;         // largest [m]
  double normal_force = 0;  // sum [N]
  bool pushed_through = false;
  SE3 world_from_j = SE3::Identity();
  Vec3 centre = Vec3::Zero();  // of the sphere, in the shell's frame [m]

  // Forgets what the contacts sum up to.
  void clear() { count = pieces = clamped = 0, depth = normal_force = 0; }
};

// Of all pairs at one state: what their damping and friction take, and what is stored in them.
struct Powers {
  double damping = 0, friction = 0;  // [W]
  double elastic = 0, bristles = 0;  // [J]
};

// A contact at work.
struct ActiveContact {
  int pair, slot, number;   // slot: of its bristle in the state, or -1
  Contact contact;          // in the frame of the shell, or of a source, that of body j
  Vec3 point;               // in the world
  Meeting<double> meeting;  // in the world
  ContactForce<double> force;
};

// Columns of one logged contact.
struct ContactRow {
  static constexpr int kColumns = 18;
  double pair, point[3], normal[3], depth, normal_force, friction[3], slip[3], element, feature,
      number;
};
static_assert(sizeof(ContactRow) == ContactRow::kColumns * sizeof(double));

// How far a sphere came from where a step began, in all evaluations since, and whether it touched.
struct Excursion {
  Vec3 from = Vec3::Zero();  // centre in the shell's frame
  double moved = 0;          // [m]
  bool touched = false;
};

class Scene {
 public:
  Scene(const pinocchio::Model& model, std::vector<Pair> pairs);

  // The same pairs with other laws, friction of the same kind, radii and relaxation.
  void change(std::vector<Pair> pairs);
  // Hands the pairs over; nothing can be evaluated any more.
  std::vector<Pair> give_back() { return std::move(pairs_); }

  // Contact forces at (q, v), with the bristles z (3 per slot, in the shells' frames). `numbered`:
  // contacts are told apart even where no force asks for it.
  void evaluate(const VectorX& q, const VectorX& v, const VectorX& z, bool numbered = false);
  // The same with another velocity, at the placements of the last evaluate().
  void revisit(const VectorX& q, const VectorX& v, const VectorX& z);
  // The state of the last evaluate() is the next of a run, and contacts go on from it. Slots are
  // dealt anew: z is put in their order.
  void accept(VectorX& z);
  // Rows of the contacts at (q, v), where the forces were last evaluated.
  void log(const VectorX& q, const VectorX& v, std::vector<ContactRow>& rows);
  // A step starts anew from the accepted state: forgets the contacts that it has met since.
  void restart();

  // Size of z. Slots of contacts to come are part of it.
  int bristle_size() const { return bristles_.size(); }
  // Of the last evaluate() (bristle_size) [m/s].
  const VectorX& bristle_rates() const { return bristle_rates_; }
  // Bristles give way no faster than this [s]: explicit fixed steps ask for it.
  void relax_in(double time) { relaxation_ = time; }
  double relaxation(const Pair& pair) const { return std::max(relaxation_, pair.relaxation); }
  // Contacts know how their normals turn, from the next evaluate() on.
  void want_turns();

  // The acceleration at the state of the last evaluate().
  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau);

  // Somebody else reads the placement and velocity of this joint after evaluate().
  void need_velocity_of(int joint);

  bool touching() const { return touching_; }
  const std::vector<ActiveContact>& active() const { return active_; }
  // Per joint, in its frame and about its origin; holds old values unless touching().
  const Forces& external() const { return external_; }
  const std::vector<PairState>& states() const { return states_; }
  const std::vector<Excursion>& excursions() const { return excursions_; }
  const Powers& powers() const { return powers_; }
  const std::vector<Pair>& pairs() const { return pairs_; }
  Multibody& body() { return body_; }
  const Multibody& body() const { return body_; }

 private:
  void add(std::size_t k, const Contact& contact, int slot, int number);
  void exert(const VectorX& z);
  std::vector<Contact>& find(std::size_t k);
  void meet(ActiveContact& active, const VectorX& z);
  Vec3 turning(const ActiveContact& active, const Vec3& stretch) const;
  void push(const ActiveContact& active);
  void apply(int joint, const Vec3& point_world, const Vec3& force_world, const Vec3& moment_world);
  Vec3 relative_velocity(const Pair& pair, const Vec3& point_world) const;
  Vec3 velocity_at(int joint, const Vec3& point_world) const;
  Vec3 spin_of(int joint) const;

  Multibody body_;
  std::vector<Pair> pairs_;
  std::vector<Query> queries_;
  std::vector<Contact> merged_;
  std::vector<ContactTracker> trackers_;
  std::vector<PairState> states_;
  std::vector<Excursion> excursions_;
  std::vector<ActiveContact> active_;
  Forces external_;
  std::vector<int> pushed_;  // joints whose entry in external_ is not zero
  Powers powers_;
  Bristles bristles_;
  VectorX bristle_rates_;
  double relaxation_ = 0;
  bool touching_ = false;
  bool needs_velocity_ = false;
};

}  // namespace sphshell
