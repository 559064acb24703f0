// The contacts of a multibody model at one state, and their forces.
#pragma once

#include "contact/curvature/curvature.hpp"
#include "dynamics/scene/bristles.hpp"
#include "dynamics/scene/clusters.hpp"
#include "dynamics/scene/joints.hpp"
#include "dynamics/scene/pair_forces.hpp"

namespace sphshell {

// One pair at one state.
struct PairState : TouchState {
  // Of the shapes of gaps that were asked for: the largest conformity, and half axis over radius.
  double conformity = -1, half_axis = 0;
  bool pushed_through = false;
  SE3 world_from_j = SE3::Identity();
  Vec3 center = Vec3::Zero();  // of the sphere, in the shell's frame [m]

  void clear_sums() {
    count = pieces = clamped = 0, depth = normal_force = 0, conformity = -1, half_axis = 0;
  }
};

// One contact at one state, with what acts at it.
struct ActiveContact {
  int pair, slot, contact_id;  // slot: of its bristle in z, or -1
  Contact contact;             // in the frame of the shell, or of a source, that of body j
  Vec3 point;                  // in the world
  ContactKinematics<double> kinematics;  // in the world
  ContactForce<double> force;
  int index = 0;                    // among the contacts of its pair
  Vec3 moment = Vec3::Zero();       // of a pressure, beyond that of its force at the point
  double damping = 0, sliding = 0;  // power that it loses [W]
  double elastic = 0;               // energy that it stores [J]
  // What it adds to PairState::pieces, as an event where it comes or goes. The patches of a
  // foundation count once, all together: beside others one comes and goes smoothly.
  int pieces = 0;
  bool clamped = false;
  int shape = -1;             // its number in those of the pair
  Vec3 climb = Vec3::Zero();  // at the sphere's center, as its stiffness changes with the place [N]
};

// On body i, in the world; body j takes the opposite.
struct ContactWrench {
  Vec3 point, force, moment;
};

// How far a sphere came from where a step began, in all evaluations since, and whether it touched.
struct Excursion {
  Vec3 from = Vec3::Zero();  // center in the shell's frame
  double moved = 0;          // [m]
  bool touched = false;
};

// A scene at one state: kinematics, contacts and forces, as pinocchio::Data is a model at one
// state. Model and pairs are its own copies. One per thread.
class SceneData {
 public:
  SceneData(const pinocchio::Model& model, std::vector<Pair> pairs, JointForces::Effects joints);

  // The same pairs with other laws, friction of the same kind, radii and relaxation; the same stops
  // and dry friction of joints with other values.
  void change(std::vector<Pair> pairs, JointForces::Effects joints);
  // Puts another in the place of pair k, with the same bodies; returns that.
  Pair exchange(std::size_t k, const Pair& other) { return std::exchange(pairs_[k], other); }
  // Hands the pairs over; nothing can be evaluated any more.
  std::vector<Pair> give_back() { return std::move(pairs_); }

  // Forces of contacts and joints at (q, v), with the bristles z: those of contacts (3 per slot, in
  // the shells' frames), then those of joints. With `identify` contacts get their ids even where no
  // force depends on them.
  void evaluate(const VectorX& q, const VectorX& v, const VectorX& z, bool identify = false);
  // The same from the accepted state on.
  void evaluate_anew(const VectorX& q, const VectorX& v, const VectorX& z, bool identify = false) {
    restart();
    evaluate(q, v, z, identify);
  }
  // The same as evaluate() with another velocity, at the placements of the last one.
  void revisit(const VectorX& q, const VectorX& v, const VectorX& z);
  // Makes the state of the last evaluate() the one from which contacts and bristles go on. Slots
  // are assigned anew: z is put in their order.
  void accept(VectorX& z);
  // What accept() makes of z, without accepting anything.
  void reorder_bristles(VectorX& z);
  // All that the forces depend on besides q, v and the scene itself, and what accept() needs: see
  // scene_rows.cpp. load() puts it in the place of what is remembered, stretches in z; false where
  // the numbers are not of such a scene: nothing is changed then.
  std::vector<double> save(const VectorX& z);
  bool load(const double* from, std::size_t count, VectorX& z);
  // Returns to the accepted state: forgets the contacts found since.
  void restart();
  // Rows of the contacts at (q, v), where the forces were last evaluated; with `patches` those of
  // their patches, too.
  void log(const VectorX& q, const VectorX& v, std::vector<ContactRow>& rows,
           std::vector<PatchRow>* patches = nullptr);
  // The row of each active contact among those of log(), and how many there are.
  int rows_of_contacts(std::vector<int>& rows) const;

  // Size of z, spare slots for new contacts included; where those of joints begin.
  int bristle_size() const { return bristles_.size() + joints_.size(); }
  int joint_bristles() const { return bristles_.size(); }
  // Of the last evaluate() (bristle_size) [m/s].
  const VectorX& bristle_rates() const { return bristle_rates_; }
  // Where there are bristles of several rings, z of the last evaluate().
  const VectorX& stretches() const { return stretches_; }
  // Bristles give way no faster than this [s]: explicit fixed steps ask for it.
  void relax_in(double time) { relaxation_ = time; }
  double relaxation(const Pair& pair) const { return std::max(relaxation_, pair.relaxation); }
  double least_relaxation() const { return relaxation_; }
  // The shape of the gap, in the shell's frame, or null.
  const ContactShape* shape(const ActiveContact& active) const {
    return active.shape < 0 ? nullptr : &shapes_[active.pair][active.shape];
  }
  // See Pair::disc_radius.
  double disc_radius(const ActiveContact& active) const {
    return active.shape < 0 ? pairs_[active.pair].disc_radius() : shape(active)->disc_radius();
  }
  // What shape() would be of a pair that differs from pair k by its radii.
  ContactShape shape_of(std::size_t k, const Pair& pair, const Contact& contact);
  // Contacts have dn_dc, where it is known, from the next evaluate() on.
  void want_dn_dc();

  // The acceleration at the state of the last evaluate().
  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau);

  // evaluate() computes the placement and velocity of this joint, too.
  void need_velocity_of(int joint);

  bool touching() const { return touching_; }
  const std::vector<ActiveContact>& active() const { return active_; }
  // All that the contact exerts, weights included.
  ContactWrench wrench(const ActiveContact& active) const;
  // Whether a contact with a bristle has begun since the last accepted state.
  bool is_new(const ActiveContact& active) const {
    return bristles_.is_spare(active.pair, active.slot);
  }
  // Per joint, in its frame and about its origin; holds old values unless touching().
  const Forces& external() const { return external_; }
  const std::vector<PairState>& states() const { return states_; }
  // Of pair k or, behind the pairs, of a joint's stop.
  const TouchState& touch(std::size_t k) const {
    return k < pairs_.size() ? states_[k] : joints_.stops()[k - pairs_.size()];
  }
  std::size_t num_touches() const { return pairs_.size() + joints_.stops().size(); }
  const std::vector<Excursion>& excursions() const { return excursions_; }
  const Powers& powers() const { return powers_; }
  // How the contact's pair makes forces of contacts.
  const PairForces& forces_of(const ActiveContact& active) const { return forces_[active.pair]; }
  const Pair& pair_of(const ActiveContact& active) const { return pairs_[active.pair]; }
  // See PairForces.
  bool is_wide(const ActiveContact& active) const {
    return std::visit(
        [&](const auto& one) { return one.is_wide(pairs_[active.pair], active.contact); },
        forces_[active.pair]);
  }
  const PairState& state_of(const ActiveContact& active) const { return states_[active.pair]; }
  // Of body i against body j, in the world.
  Vec3 relative_velocity(const Pair& pair, const Vec3& point_world) const;
  Vec3 relative_spin(const Pair& pair) const;
  const std::vector<Pair>& pairs() const { return pairs_; }
  const std::vector<Cluster>& clusters() const { return clusters_; }
  const JointForces& joints() const { return joints_; }
  JointForces& joints() { return joints_; }
  Multibody& body() { return body_; }
  const Multibody& body() const { return body_; }

 private:
  // Contacts of pair k in the frame of body j, merged where friction acts; none where it is `far`.
  std::vector<Contact>& find_contacts(std::size_t k, bool far);
  void find_shapes(std::size_t k);
  // Slots for the contacts of pair k, which are matched with the known ones; then for all.
  void assign_bristles(Bristles& bristles, std::size_t k, const VectorX& z);
  void end_bristles(Bristles& bristles, VectorX& z) const;
  void evaluate_joints(const VectorX& q, const VectorX& v, const VectorX& z);
  // Appends to active_, without forces yet.
  void add_contact(std::size_t k, const Contact& contact, int slot, int contact_id);
  // Forces of all active contacts, one after the other: kinematics in the world, the laws, the
  // wrench on both joints.
  void compute_forces(const VectorX& z);
  void compute_kinematics(ActiveContact& active, const VectorX& z);
  void compute_force(ActiveContact& active, const VectorX& z);
  void add_force(const ActiveContact& active);
  void apply(int joint, const Vec3& point_world, const Vec3& force_world, const Vec3& moment_world);
  // Of a stretch with the normal, in the shell's frame [m/s].
  Vec3 rate_of_turning(const ActiveContact& active, const Vec3& stretch) const;

  Multibody body_;
  JointForces joints_;
  std::vector<Pair> pairs_;
  std::vector<Cluster> clusters_;
  std::vector<Query> queries_;
  std::vector<PairForces> forces_;
  std::vector<Contact> merged_;
  std::vector<Curvature> curvatures_;  // of the shells whose shape counts
  std::vector<std::vector<ContactShape>> shapes_;
  std::vector<ContactShape> merged_shapes_;
  std::vector<ContactTracker> trackers_;
  std::vector<PairState> states_;
  std::vector<Excursion> excursions_;
  std::vector<ActiveContact> active_;
  Forces external_;
  std::vector<int> loaded_;  // joints that contacts act on
  Powers powers_;
  Bristles bristles_;
  VectorX bristle_rates_, stretches_;
  double relaxation_ = 0;
  bool touching_ = false;
  bool needs_velocity_ = false;
  bool wants_second_ = false;  // derivatives of shapes and of foundations
  bool several_rings_ = false;
};

}  // namespace sphshell
