// Pinocchio's algorithms as the simulation uses them; their templates are compiled in one file.
#pragma once

#include <pinocchio/multibody.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace sphshell {

using VectorX = Eigen::VectorXd;
using MatrixX = Eigen::MatrixXd;
using Matrix6X = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using VectorRef = Eigen::Ref<const VectorX>;
using Forces = std::vector<pinocchio::Force>;

// A segment of the velocity whose group does not commute: its composition needs a correction in
// Runge-Kutta methods of order 3 and more. Of a position it has `linear` numbers, then of a
// rotation `angular` ones: 3 and 3, 2 and 1 in the plane, 0 and 3 of a rotation alone.
struct CurvedSegment {
  int linear, angular;
  int index_v, index_q;

  // Its parts of what has a velocity's numbers from `first` on, as vectors in space: the plane is
  // z = 0. Sizes that only the run knows would take 4 % more of a free body's step.
  Eigen::Vector3d linear_of(const VectorX& x, int first = 0) const {
    const double* from = x.data() + first + index_v;
    if (linear == 3) return Eigen::Map<const Eigen::Vector3d>(from);
    return linear == 2 ? Eigen::Vector3d(from[0], from[1], 0) : Eigen::Vector3d::Zero();
  }
  Eigen::Vector3d angular_of(const VectorX& x, int first = 0) const {
    const double* from = x.data() + first + index_v + linear;
    return angular == 3 ? Eigen::Vector3d(from[0], from[1], from[2])
                        : Eigen::Vector3d(0, 0, from[0]);
  }
};

// A joint whose axes turn in its own frame as it moves: composite, universal, spherical ZYX, ...
struct TurningAxes {
  int joint;
  Matrix6X by_q;  // in the joint's frame: column k + nv m, of axis k with respect to coordinate m
};

class CompiledRobot;

// A constant model with the scratch that its algorithms write: one per thread.
class Multibody {
 public:
  explicit Multibody(const pinocchio::Model& model);
  // Pinocchio's own take seconds to compile: here, and not in every file.
  Multibody(const Multibody& other);
  ~Multibody();

  // Answers acceleration() and kinematics() from now on, in place of Pinocchio, unless null.
  void use(std::shared_ptr<const CompiledRobot> compiled) { compiled_ = std::move(compiled); }

  // Placements and, with v, velocities of the joints that were asked for by `need`, no others.
  void kinematics(const VectorX& q, const VectorX* v = nullptr);
  void kinematics(const VectorX& q, const VectorX& v) { kinematics(q, &v); }
  // From now on kinematics() places this joint, and those that carry it.
  void need(int joint);

  // Forward dynamics (nv); `external`: forces on the joints' bodies, in the joints' frames, or
  // null.
  const VectorX& acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                              const Forces* external = nullptr);
  // Derivatives (nv, nv) of acceleration(q, v, tau), with respect to q in its tangent space, v and
  // tau. Pinocchio's derivatives leave out how axes turn, and want joints in depth-first order: for
  // other models they are central differences, right to nine digits.
  void acceleration_derivatives(const VectorX& q, const VectorX& v, const VectorX& tau,
                                Eigen::Ref<MatrixX> by_q, Eigen::Ref<MatrixX> by_v,
                                Eigen::Ref<MatrixX> by_tau);
  // Placements, and axes in the world and how they turn, of the joints that were asked for.
  void place_axes(const VectorX& q);
  // To be called before both.
  void want_derivatives();

  // The torque that holds the weight.
  const VectorX& gravity(const VectorX& q);
  // Torque that holds the bias forces and opposes `external`: rnea(q, v, 0, external).
  const VectorX& bias(const VectorX& q, const VectorX& v, const Forces& external);
  // After bias(): the acceleration of the joint's body that velocities alone determine, in the
  // joint's frame (spatial: its linear part is not that of a point).
  pinocchio::Motion drift(int joint) const;
  // Jacobian (6, nv) of a frame of `joint`, in that frame, and M^-1 of its transpose (nv, 6).
  void task(const VectorX& q, int joint, const pinocchio::SE3& frame, Matrix6X& jacobian,
            MatrixX& mobility);
  // All joints at q: what the two below answer for.
  void place(const VectorX& q);
  // Adds factor x the velocity of a point of `joint`, in the world, by the velocities (3, nv).
  void add_jacobian(int joint, const Eigen::Vector3d& point, double factor, MatrixX& out) const;
  // J M^-1 J^T.
  MatrixX mobility(const MatrixX& jacobian) const;
  // Inverse dynamics, and what it leaves, all in the joints' frames.
  void transmit(const VectorX& q, const VectorX& v, const VectorX& acceleration,
                const Forces& external);
  const VectorX& transmitted() const { return data_.tau; }
  // What a joint's parent exerts on the joint's body and all beyond it, in the parent's frame.
  pinocchio::Force transmitted_to_parent(int joint) const {
    return data_.liMi[joint].act(data_.f[joint]);
  }
  const pinocchio::Motion& transmitted_velocity(int joint) const { return data_.v[joint]; }
  // Less the acceleration of gravity.
  const pinocchio::Motion& transmitted_acceleration(int joint) const { return data_.a_gf[joint]; }
  // q exp(step), and the step that leads from q0 to q1, both in the tangent space of the first one.
  void integrate(const VectorX& q, const VectorX& step, VectorX& out) const;
  void difference(const VectorX& q0, const VectorX& q1, VectorX& out) const;
  VectorX neutral() const;
  // By which errors of coordinates and velocities are measured, per velocity component: lengths of
  // positions from the origin, 1 for turns; lengths of the vectors that components belong to.
  void sizes(const VectorX& q, VectorX& out) const;
  void speeds(const VectorRef& v, VectorX& out) const;
  // In joules; the potential energy of the weight is zero at the world's origin.
  double kinetic_energy(const VectorX& q, const VectorX& v);
  double potential_energy(const VectorX& q);

  const pinocchio::SE3& world_from_joint(int joint) const { return data_.oMi[joint]; }
  // Where something at `placement` in the joint is in the world.
  pinocchio::SE3 world_from(int joint, const pinocchio::SE3& placement) const {
    return joint == 0 ? placement : data_.oMi[joint] * placement;
  }
  Eigen::Vector3d world_from(int joint, const Eigen::Vector3d& point) const {
    return joint == 0 ? point : data_.oMi[joint].act(point);
  }
  const pinocchio::Motion& velocity(int joint) const { return data_.v[joint]; }
  // Of the joint's body, in the world [m/s], [rad/s].
  Eigen::Vector3d velocity_at(int joint, const Eigen::Vector3d& point_world) const {
    if (joint == 0) return Eigen::Vector3d::Zero();
    const pinocchio::SE3& pose = data_.oMi[joint];
    const pinocchio::Motion& v = data_.v[joint];
    return pose.rotation() * (v.linear() + v.angular().cross(pose.actInv(point_world)));
  }
  // In the world [rad/s]; zero of the world itself.
  Eigen::Vector3d angular_velocity(int joint) const {
    if (joint == 0) return Eigen::Vector3d::Zero();
    return data_.oMi[joint].rotation() * data_.v[joint].angular();
  }
  // Of place_axes(): one column per velocity of each joint, mimic joints' included (Pinocchio's
  // idx_vExtended), linear part first, about the world's origin.
  const Matrix6X& axes() const { return data_.J; }
  const std::vector<TurningAxes>& turning() const { return turning_; }
  const pinocchio::Model& model() const { return model_; }
  const std::vector<CurvedSegment>& curved() const { return curved_; }

 private:
  // The model in which joints that mimic others move by themselves, and how fast its joints move
  // for each velocity of this one.
  struct Unlocked {
    pinocchio::Model model;
    pinocchio::Data data;
    MatrixX ratios, by_q, by_v, by_a;
    VectorX q;
  };
  // Makes unlocked_, and brings its coordinates to those of q.
  void unlock();
  void place_unlocked(const VectorX& q);

  // Pinocchio's, whose factorization of the mass matrix the derivatives go on with.
  const VectorX& own_acceleration(const VectorX& q, const VectorX& v, const VectorX& tau,
                                  const Forces* external = nullptr);
  template <class Step, class... State>
  void run_needed(const State&... state);
  // Fills by_q of a joint at q.
  void turn_axes(const VectorX& q, TurningAxes& axes);
  // Writes the mass matrix (nv, nv) into data_.M, both triangles.
  void compute_mass(const VectorX& q);
  // M^-1 (tau - bias), with the mass matrix that compute_mass() has just left in data_.
  const VectorX& solve(const VectorX& tau, const VectorX& bias);

  pinocchio::Model model_;
  pinocchio::Data data_;
  std::shared_ptr<const CompiledRobot> compiled_;
  VectorX zero_;
  // Pinocchio's ABA has no mimic joints: of models with some, the mass matrix is factorized.
  bool mimics_;
  Eigen::LLT<MatrixX, Eigen::Upper> mass_;
  VectorX solution_;
  std::vector<TurningAxes> turning_;
  bool differences_ = false;
  std::optional<Unlocked> unlocked_;  // of models with mimic joints, for derivatives
  VectorX step_, moved_;              // scratch of the differences
  std::vector<CurvedSegment> curved_;
  std::vector<int> needed_;  // joints, parents first
};

}  // namespace sphshell
