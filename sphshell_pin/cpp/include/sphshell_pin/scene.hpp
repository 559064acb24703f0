// A Pinocchio model with spheres that touch shells: configuration in, wrenches out.
#pragma once

#include <pinocchio/multibody.hpp>
#include <pinocchio/spatial.hpp>

#include "sphshell_pin/laws.hpp"
#include "sphshell_pin/query.hpp"

namespace sphshell_pin {

/// A sphere of `radius` [m] at `offset` [m] from the origin of `frame`, in that frame.
struct Sphere {
  double radius;
  std::string frame;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
};

/// Where a shell is, and how its contacts are found.
struct Mount {
  std::string frame = "universe";                         ///< of the model
  pinocchio::SE3 placement = pinocchio::SE3::Identity();  ///< of the shell, in `frame`
  Method method = Method::Smooth;
};

/// A contact of a scene, in the world.
struct SceneContact {
  int pair;                        ///< as add_contact() numbered it
  Eigen::Vector3d point;           ///< [m]
  Eigen::Vector3d normal;          ///< unit, from the shell to the sphere's center
  double depth;                    ///< [m]
  double normal_force;             ///< on the sphere, along the normal [N]
  Eigen::Vector3d friction_force;  ///< on the sphere [N]
  Eigen::Vector3d slip_velocity;   ///< of the sphere against the shell [m/s]
  int element;                     ///< of the shell, or -1
  Feature feature;
  int contact_id;  ///< the same while a contact goes on, in a SceneState that is advanced
};

/// A copy of a model with the pairs of bodies that may touch. It is a description: SceneState
/// computes.
class SPHSHELL_PIN_API Scene {
 public:
  /// @throws InvalidParameter for a model that Pinocchio's algorithms would not survive: parents
  ///         after their joints, lists of different lengths, numbers that are not finite
  explicit Scene(const pinocchio::Model& model);

  /// Lets `sphere` touch `shell`; returns the number of the pair, from 0.
  /// @throws FrameNotFound on a frame that the model does not have, with a list of those it has
  /// @throws InvalidParameter unless the radius is positive, and offset and placement are finite
  int add_contact(const Sphere& sphere, const Shell& shell, const NormalLaw& law,
                  const FrictionLaw& friction = {}, const Mount& mount = {});
  /// Lets `sphere` touch `other`, a solid ball; throws as the other one does.
  int add_contact(const Sphere& sphere, const Sphere& other, const NormalLaw& law,
                  const FrictionLaw& friction = {});

  /// Bristles give way beyond their limit in this time [s]; Python takes at most the default of
  /// 2e-5 s, and for laws that stop an impact in less than 1e-3 s a fiftieth of that.
  /// @throws InvalidParameter unless the pair exists and the time is positive
  void set_relaxation(int pair, double time);

  /// States made from now on move the robot by the shared object at `path`, in place of Pinocchio:
  /// the one that Python's compile_robot(scene.model) made for this model.
  /// @throws InvalidParameter where it cannot be opened, is of another model, or differs from
  ///         Pinocchio by more than 1e-12
  void use_compiled(const std::string& path);

  const pinocchio::Model& model() const;
  int num_pairs() const;

  struct Impl;
  /// For the library itself.
  const Impl& impl() const { return *impl_; }

 private:
  Owned<Impl> impl_;
};

/// What a scene answers along a motion that your own loop makes, as pinocchio::Data is the scratch
/// of a model: one per thread. It remembers which contacts there are, on which side of its shell
/// each sphere is, and how far bristles are stretched. Nothing but advance() changes that.
class SPHSHELL_PIN_API SceneState {
 public:
  /// Begins at its first advance(). Pairs that the scene gets later are not in it.
  explicit SceneState(const Scene& scene);

  /// The wrenches of all contacts, for pinocchio::aba(model, data, q, v, tau, forces): one per
  /// joint, in the joint's frame about its origin. Valid until the next call.
  /// @param q (nq) configuration
  /// @param v (nv) velocity
  /// @throws InvalidParameter on other sizes, numbers that are not finite, or a quaternion or
  ///         (cos, sin) pair that is not of unit length
  const std::vector<pinocchio::Force>& external_forces(const Eigen::VectorXd& q,
                                                       const Eigen::VectorXd& v);

  /// Forward dynamics (nv) under the torques `tau` (nv) and these forces, by Pinocchio's ABA or by
  /// what Scene::use_compiled() was given. Valid until the next call; errors as of
  /// external_forces().
  const Eigen::VectorXd& acceleration(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                                      const Eigen::VectorXd& tau);

  /// All contacts with their forces; arguments and errors as of external_forces().
  std::vector<SceneContact> contacts(const Eigen::VectorXd& q, const Eigen::VectorXd& v);

  /// Derivatives (nv, nv) of the generalized contact force, the sum of J^T f over the joints: by q,
  /// in its tangent space, and by v. Exact where contacts go on; bristles are held, and with the
  /// method Elements normals keep their directions. Arguments and errors as of external_forces().
  void contact_derivatives(const Eigen::VectorXd& q, const Eigen::VectorXd& v,
                           Eigen::MatrixXd& by_q, Eigen::MatrixXd& by_v);

  /// Moves the memory on to (q, v), the end of an accepted step of `dt` >= 0 [s]; the first call
  /// begins. Bristles are stretched by the new velocity at the contacts where the step began.
  /// @throws InvalidParameter as external_forces(), and on a `dt` that is negative or not finite
  void advance(const Eigen::VectorXd& q, const Eigen::VectorXd& v, double dt);

  /// All that is remembered, as numbers, to be kept and compared: two states of a scene with the
  /// same numbers go on alike. Python's SceneState.values says what each of them is.
  std::vector<double> values() const;

  /// Remembers what a state of such a scene had as values(), and nothing else.
  /// @throws InvalidParameter where they are not of a scene with the same pairs
  void restore(const std::vector<double>& values);

 private:
  struct Impl;
  Owned<Impl> impl_;
};

}  // namespace sphshell_pin
