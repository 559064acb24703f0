// Derivatives of the contact forces, and of the equations of motion.
#pragma once

#include <vector>

#include "dynamics/chain.hpp"
#include "dynamics/scene_data.hpp"

namespace sphshell {

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
  int rings_of(const ActiveContact& active) const;  // 0 without a bristle
  ContactSite site_of(const ActiveContact& active, const Vector6& twist) const;

  SceneData& scene_;
  std::vector<Chain> chains_;  // one per pair
  VectorX force_;              // generalized
  MatrixX by_q_, by_v_, inverse_mass_;
  std::vector<int> loaded_;  // velocities that these forces act on
  std::vector<char> is_loaded_;
  ContactSlopes slopes_;
  std::vector<JointForces::Slope> joint_slopes_;
  VectorX column_;
};

}  // namespace sphshell
