#include "dynamics/control/controllers.hpp"

#include "dynamics/control/target_path.hpp"

#include <Eigen/Eigenvalues>

namespace sphshell {
namespace {

constexpr double kMobility = 1e-9;  // of the largest: directions in which a frame cannot move

// `actuated` is 1 where a joint's velocity is driven, else 0 (a free-floating base or object).
class GravityCompensation : public Controller, Fields {
 public:
  explicit GravityCompensation(const Fields& fields) : Fields(fields) {}
  void torque(SceneData& scene, double, const VectorX& q, const VectorX&, VectorX& tau) override {
    tau = scene.body().gravity(q).cwiseProduct(actuated_);
  }

 private:
  const VectorX actuated_ = vector("actuated");
};

// kp (q_ref - q) - kd v, and the gravity torque where asked for.
class JointPd : public Controller, Fields {
 public:
  explicit JointPd(const Fields& fields) : Fields(fields) {}

  void torque(SceneData& scene, double, const VectorX& q, const VectorX& v, VectorX& tau) override {
    scene.body().difference(q, q_ref_, error_);
    tau = kp_.cwiseProduct(error_) - kd_.cwiseProduct(v);
    if (gravity_) tau += scene.body().gravity(q);
    tau.array() *= actuated_.array();
    if (friction_) scene.joints().compensate(v, actuated_, tau);
  }

 private:
  const VectorX kp_ = vector("kp"), kd_ = vector("kd"), q_ref_ = vector("q_ref"),
                actuated_ = vector("actuated");
  VectorX error_ = VectorX::Zero(kd_.size());
  const bool gravity_ = flag("gravity"), friction_ = flag("friction_compensation");
};

// Parameters of CartesianImpedance; units as in dynamics/control/impedance.py.
struct ImpedanceSettings : Fields {
  explicit ImpedanceSettings(const Fields& fields) : Fields(fields) {}

  // That carry the controlled frame, and the path; these in those joints.
  int joint = integer("joint"), path_joint = integer("path_joint");
  SE3 frame = Fields::frame("frame"), path_placement = Fields::frame("path_placement");
  double stiffness = number("stiffness"), damping = number("damping");  // [N/m], [N s/m]
  double normal_force = number("normal_force");                  // pressed against the normal [N]
  double force_rise = number("force_rise");                      // time in which that comes on [s]
  double rotational_stiffness = number("rotational_stiffness");  // [N m]
  double rotational_damping = number("rotational_damping");      // [N m s]
  VectorX posture_stiffness = vector("posture_stiffness"), joint_damping = vector("joint_damping"),
          q_ref = vector("q_ref"), actuated = vector("actuated");
  bool decoupled = flag("decoupled");  // the inertia of the robot does not disturb the frame
  // Motors make up for damping and dry friction of the joints.
  bool friction_compensation = flag("friction_compensation");
};

// Cartesian impedance (Hogan 1985): J^T F plus the bias torques, with
// F = K (x_d - x) + D (xdot_d - xdot); with a normal force, the spring acts in the tangent plane of
// the path's normal only and the frame is pressed against that normal. Decoupled, the wrench that
// the target's acceleration takes is added, Lambda (a_d - Jdot v) with Lambda = (J M^-1 J^T)^-1,
// and posture and joint damping act where they do not accelerate the frame (Khatib 1987).
class CartesianImpedance : public Controller {
 public:
  explicit CartesianImpedance(const Fields& fields)
      : s_(fields), path_(fields), error_(VectorX::Zero(s_.actuated.size())) {}
  void prepare(SceneData& scene) override;
  void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
              VectorX& tau) override;
  void take_over(const Controller& before, double t) override;
  bool follows_time() const override { return path_.moves() || s_.force_rise > 0; }
  double next_kink(double t) const override {
    const double on_path = path_.next_kink(t - late_) + late_;
    return t < s_.force_rise ? std::min(on_path, s_.force_rise) : on_path;
  }

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

void CartesianImpedance::prepare(SceneData& scene) {
  scene.need_velocity_of(s_.joint);
  scene.need_velocity_of(s_.path_joint);
  opposed_.assign(scene.body().model().joints.size(), pinocchio::Force::Zero());
  started_ = false;
}

void CartesianImpedance::torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
                                VectorX& tau) {
  Multibody& body = scene.body();
  const SE3& joint = body.world_from_joint(s_.joint);
  const SE3 pose = joint * s_.frame;
  const pinocchio::Motion twist = s_.frame.actInv(body.velocity(s_.joint));
  const Vec3 velocity = pose.rotation() * twist.linear(), spin = pose.rotation() * twist.angular();
  // The orientation at the first call is the one that is held.
  if (!started_) hold_ = pose.rotation(), started_ = true;

  const TargetPath::Target on_path = path_.at(t - late_);
  SE3 path = s_.path_placement;
  if (s_.path_joint != 0) path = body.world_from_joint(s_.path_joint) * s_.path_placement;
  const Vec3 target = path.act(on_path.point);
  Vec3 target_velocity = path.rotation() * on_path.velocity;
  Vec3 normal = path.rotation() * on_path.normal;
  if (s_.path_joint != 0) target_velocity += body.velocity_at(s_.path_joint, target);

  Vec3 offset = target - pose.translation();
  if (s_.normal_force != 0) {
    normal.normalize();
    offset -= offset.dot(normal) * normal;
  }
  // Spring and damper towards the target; along the normal the constant force instead of the
  // spring.
  Vec3 force = s_.stiffness * offset + s_.damping * (target_velocity - velocity);
  if (s_.normal_force != 0) {
    const double share = t < s_.force_rise ? std::max(t / s_.force_rise, 0.0) : 1.0;
    force -= share * share * (3 - 2 * share) * s_.normal_force * normal;
  }
  Vec3 moment = -s_.rotational_damping * spin;
  if (s_.rotational_stiffness != 0)
    // log3: the rotation vector from the frame's orientation to the held one.
    moment += s_.rotational_stiffness *
              pinocchio::log3(Eigen::Matrix3d(hold_ * pose.rotation().transpose()));

  aside_.setZero(v.size());
  if (s_.posture_stiffness.size() > 0) {
    body.difference(q, s_.q_ref, error_);
    aside_ = s_.posture_stiffness.cwiseProduct(error_);
  }
  if (s_.joint_damping.size() > 0) aside_ -= s_.joint_damping.cwiseProduct(v);
  if (s_.decoupled) {
    const pinocchio::Force more = wrench_of_motion(body, q, v, on_path, path);
    force += pose.rotation() * more.linear();
    moment += pose.rotation() * more.angular();
  }

  // One recursion gives the bias torques and J^T F: inverse dynamics at rest against -F.
  pinocchio::Force& opposed = opposed_[s_.joint];
  const Vec3 local = joint.rotation().transpose() * force;
  opposed.linear() = -local;
  opposed.angular() =
      -(joint.rotation().transpose() * moment) - s_.frame.translation().cross(local);
  tau = (body.bias(q, v, opposed_) + aside_).cwiseProduct(s_.actuated);
  if (s_.friction_compensation) scene.joints().compensate(v, s_.actuated, tau);
}

// In the frame: Lambda (a_d - Jdot v - J M^-1 tau), with tau what acts aside of F. Of a carrier
// that moves, a_d has what its velocity determines. Where the frame has no mobility, as in a
// singular posture, there is no wrench.
pinocchio::Force CartesianImpedance::wrench_of_motion(Multibody& body, const VectorX& q,
                                                      const VectorX& v,
                                                      const TargetPath::Target& target,
                                                      const SE3& path) {
  pinocchio::Force& opposed = opposed_[s_.joint];
  opposed.setZero();
  body.bias(q, v, opposed_);
  Vec3 wanted = path.rotation() * target.acceleration;
  if (s_.path_joint != 0) {
    const SE3& carrier = body.world_from_joint(s_.path_joint);
    const pinocchio::Motion &w = body.velocity(s_.path_joint), drift = body.drift(s_.path_joint);
    const Vec3 r = carrier.actInv(path.act(target.point));
    // Acceleration of a point that moves on a turning carrier: drift, centripetal and Coriolis
    // terms.
    const Vec3 along = s_.path_placement.rotation() * target.velocity;
    wanted +=
        carrier.rotation() * (drift.linear() + drift.angular().cross(r) +
                              w.angular().cross(w.linear() + w.angular().cross(r) + 2 * along));
  }
  const pinocchio::Motion twist = s_.frame.actInv(body.velocity(s_.joint));
  const pinocchio::Motion drift = s_.frame.actInv(body.drift(s_.joint));
  const SE3 pose = body.world_from_joint(s_.joint) * s_.frame;
  body.task(q, s_.joint, s_.frame, jacobian_, mobility_);
  Eigen::Matrix<double, 6, 1> error;
  // The linear part is that of the frame's origin: spatial acceleration plus spin x v.
  error << pose.rotation().transpose() * wanted - drift.linear() -
               twist.angular().cross(twist.linear()),
      -drift.angular();
  error -= mobility_.transpose() * aside_;
  // Without a hold of the orientation that is left to the spring of the posture.
  const int rows = s_.rotational_stiffness != 0 || s_.rotational_damping != 0 ? 6 : 3;
  const MatrixX mobility = (jacobian_ * mobility_).topLeftCorner(rows, rows);
  // Lambda by the eigenvectors of J M^-1 J^T, without the directions in which the frame cannot
  // move.
  const Eigen::SelfAdjointEigenSolver<MatrixX> by_axis(mobility);
  const double least = kMobility * by_axis.eigenvalues()[rows - 1];
  Eigen::Matrix<double, 6, 1> wrench = Eigen::Matrix<double, 6, 1>::Zero();
  for (int k = 0; k < rows; ++k) {
    const auto axis = by_axis.eigenvectors().col(k);
    if (by_axis.eigenvalues()[k] > least)
      wrench.head(rows) += axis * (axis.dot(error.head(rows)) / by_axis.eigenvalues()[k]);
  }
  return pinocchio::Force(wrench);
}

// The orientation held stays, and the target stays where it is on the path.
void CartesianImpedance::take_over(const Controller& before, double t) {
  const auto* other = dynamic_cast<const CartesianImpedance*>(&before);
  if (!other || !path_.same_curve(other->path_)) return;
  hold_ = other->hold_;
  started_ = other->started_;
  const double place = other->path_.place_at(t - other->late_);
  // Where it still waits it sets out at once if its time has come, from the start of the path.
  late_ = place > 0 ? t - path_.time_of(place) : std::max(other->late_, t - path_.begin());
}

// A new controller is its class above and one line here, and a class of that kind in Python.
constexpr KindOf<Controller> kControllers[] = {
    {"gravity-compensation", make_of<Controller, GravityCompensation>},
    {"joint-pd", make_of<Controller, JointPd>},
    {"cartesian-impedance", make_of<Controller, CartesianImpedance>},
};

}  // namespace

std::shared_ptr<Controller> make_controller(const std::string& kind, const Fields& fields) {
  return make_from(kControllers, kind, fields);
}

}  // namespace sphshell
