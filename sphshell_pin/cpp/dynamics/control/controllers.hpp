// Joint torques from the state.
#pragma once

#include <limits>
#include <memory>
#include <vector>

#include "dynamics/scene/scene_data.hpp"
#include "dynamics/control/target_path.hpp"

namespace sphshell {

class Controller {
 public:
  virtual ~Controller() = default;
  // Called once before a run, to ask for the placements that torque() reads.
  virtual void prepare(SceneData&) {}
  // Called once before a run that has sensors: where their latest readings will be.
  virtual void read(const std::vector<double>& /*readings*/) {}
  // Writes the torques; the scene's contacts have been evaluated at (q, v).
  virtual void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
                      VectorX& tau) = 0;
  // Takes the place of `before` at time t, in the middle of a run: goes on from where that is.
  virtual void take_over(const Controller& /*before*/, double /*t*/) {}
  // Implicit integrators difference the torques by the state, and if they follow it, by time.
  virtual bool follows_time() const { return false; }
  // The next time at which the torques bend or jump.
  virtual double next_kink(double /*t*/) const { return std::numeric_limits<double>::infinity(); }
};

// `actuated` is 1 where a joint's velocity is driven, else 0 (a free-floating base or object).
class GravityCompensation : public Controller {
 public:
  explicit GravityCompensation(VectorX actuated);
  void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
              VectorX& tau) override;

 private:
  VectorX actuated_;
};

// kp (q_ref - q) - kd v, and the gravity torque where asked for.
class JointPd : public Controller {
 public:
  JointPd(VectorX kp, VectorX kd, VectorX q_ref, bool gravity, VectorX actuated);
  void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
              VectorX& tau) override;

 private:
  VectorX kp_, kd_, q_ref_, actuated_, error_;
  bool gravity_;
};

// Parameters of CartesianImpedance; units as in dynamics/control/impedance.py.
struct ImpedanceSettings {
  int joint = 0;                // that carries the controlled frame
  SE3 frame = SE3::Identity();  // in that joint
  int path_joint = 0;           // that carries the path
  SE3 path_placement = SE3::Identity();
  PathSettings path;                                        // in the path's frame
  double stiffness = 0, damping = 0;                        // [N/m], [N s/m]
  double normal_force = 0;                                  // pressed against the normal [N]
  double rotational_stiffness = 0, rotational_damping = 0;  // [N m], [N m s]
  VectorX posture_stiffness, joint_damping, q_ref, actuated;
  bool decoupled = false;  // the inertia of the robot does not disturb the frame
};

// Cartesian impedance (Hogan 1985): J^T F plus the bias torques, with
// F = K (x_d - x) + D (xdot_d - xdot); with a normal force, the spring acts in the tangent plane of
// the path's normal only and the frame is pressed against that normal. Decoupled, the wrench that
// the target's acceleration takes is added, Lambda (a_d - Jdot v) with Lambda = (J M^-1 J^T)^-1,
// and posture and joint damping act where they do not accelerate the frame (Khatib 1987).
class CartesianImpedance : public Controller {
 public:
  explicit CartesianImpedance(ImpedanceSettings settings);
  void prepare(SceneData& scene) override;
  void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
              VectorX& tau) override;
  void take_over(const Controller& before, double t) override;
  bool follows_time() const override { return path_.moves(); }
  double next_kink(double t) const override { return path_.next_kink(t - late_) + late_; }

 private:
  ImpedanceSettings s_;
  TargetPath path_;
  double late_ = 0;  // the path is followed so much later than its times say [s]
  bool started_ = false;
  Eigen::Matrix3d hold_;  // orientation at the start
  Forces opposed_;
  VectorX error_, aside_;  // joint torques besides those of F
  Matrix6X jacobian_;
  MatrixX mobility_;

  pinocchio::Force wrench_of_motion(Multibody& body, const VectorX& q, const VectorX& v,
                                    const TargetPath::Target& target, const SE3& path);
};

}  // namespace sphshell
