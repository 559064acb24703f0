// Derivatives of the contact forces, and of the equations of motion.
#pragma once

#include "dynamics/scene/chain.hpp"
#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

// Derivatives of what acts at contacts, as they are recorded, with respect to (u, v, z, parameters)
// as of Linearization.
struct ContactForceSlopes {
  MatrixX force_world;   // three rows a contact: on the sphere [N]
  MatrixX normal_force;  // one row a contact [N]
  MatrixX depth;         // [m]
  // The same but for the rise of a curved shell, which comes on with the square of the depth where
  // it is negative: what passes through zero with a rate where a contact begins [m].
  MatrixX plain_depth;
};

// At the state of the scene's last evaluate(), or accept(). Derivatives with respect to q are in
// its tangent space. What is approximated:
// - of a contact source the contacts stay where they are in frame j, and are only pressed deeper;
// - with the method "elements" normals keep their direction in the shell;
// - the rate of a bristle's turning with its normal changes only with velocity and direction, not
//   with the shell's curvature.
class Linearization {
 public:
  explicit Linearization(SceneData& scene);

  // Derivatives (nv, nv) of the generalized contact forces (sum of J^T F).
  void forces(const VectorX& q, const VectorX& v, MatrixX& by_q, MatrixX& by_v);

  // Jacobian (nv + nz, 2 nv + nz) of (v', z') with respect to (u, v, z) at q exp(u), u = 0, where
  // the torques tau are held; z are the bristles, nz their size.
  void rates(const VectorX& q, const VectorX& v, const VectorX& z, const VectorX& tau,
             MatrixX& jacobian);
  // Of the joint space (nv, nv), where rates() was last called.
  const MatrixX& inverse_mass() const { return inverse_mass_; }

  // From now on rates() also finds the derivatives by these.
  void set_parameters(std::vector<Parameter> parameters) { parameters_ = std::move(parameters); }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  // Of (v', z'), (nv + nz, parameters), where rates() was last called.
  const MatrixX& by_parameters() const { return by_parameters_; }

  // Of the contacts of the scene's log(), in its order.
  void contact_forces(const VectorX& q, const VectorX& v, ContactForceSlopes& out);

 private:
  // Of all contacts of a pair.
  struct Sum {
    Vector6 wrench;
    Matrix6 by_displacement, by_twist;
  };
  void add_contacts(const VectorX& q, const VectorX& v, MatrixX* jacobian);
  void add_joints(const VectorX& q, const VectorX& v, const VectorX& z, MatrixX& jacobian);
  void add_bristle(const ActiveContact& active, const ContactSite& site, const Chain& chain,
                   MatrixX& jacobian);
  // Fills slopes_, as the pair's kind of forces has them.
  void find_slopes(const ActiveContact& active, const ContactSite& site);
  // How the slopes found last, and the depth, answer a parameter of their pair.
  struct Answer {
    Vector6 wrench = Vector6::Zero();  // in the shell's frame
    Vec3 rates[kMostRings];            // of the rings of a bristle
    double depth = 0, plain_depth = 0;
    Vec3 normal = Vec3::Zero();
    Vector6 moved = Vector6::Zero();  // the twist by which the shell's frame moves
  };
  // A displacement of the sphere's body against the shell, of a contact with this many rings.
  Answer displaced(const Vector6& by, const ContactSite& site, int rings) const;
  Answer answer_of(const Parameter& parameter, const ActiveContact& active,
                   const ContactSite& site);
  void add_differences(const Parameter& parameter, const ActiveContact& active,
                       const ContactSite& site, Answer& answer);
  void add_parameters(const ActiveContact& active, const ContactSite& site, const Chain& chain);
  int rings_of(const ActiveContact& active) const;  // 0 without a bristle
  // The contact in the shell's frame, where bodies i and j move with this relative twist.
  ContactSite site_of(const ActiveContact& active, const Vector6& twist) const;

  SceneData& scene_;
  std::vector<Chain> chains_;  // one per pair
  VectorX force_;              // generalized
  MatrixX by_q_, by_v_, inverse_mass_;
  std::vector<int> loaded_;  // velocities that these forces act on
  std::vector<char> is_loaded_;
  ContactSlopes slopes_, other_slopes_;
  std::vector<Parameter> parameters_;
  MatrixX by_parameters_;
  std::vector<JointForces::Slope> joint_slopes_;
  VectorX column_;
};

}  // namespace sphshell
