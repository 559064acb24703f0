#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <sphshell_pin/scene.hpp>

#include <limits>

#include "check.hpp"

using namespace sphshell_pin;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using pinocchio::SE3;
using Vector = Eigen::Ref<const VectorXd>;  // for which Pinocchio has aba() compiled

namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kRadius = 0.02, kMass = 0.1;

// Balls of kRadius, "ball 0" and so on, each on a joint of its own.
template <class Joint>
pinocchio::Model balls(int count) {
  pinocchio::Model model;
  for (int k = 0; k < count; ++k) {
    const std::string name = "ball " + std::to_string(k);
    const auto joint = model.addJoint(0, Joint(), SE3::Identity(), name);
    model.appendBodyToJoint(joint, pinocchio::Inertia::FromSphere(kMass, kRadius));
    model.addJointFrame(joint);
    model.addBodyFrame(name, joint);
  }
  return model;
}

Shell floor_of(double half) {
  return Shell({{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}},
               {{0, 1, 2, 3}});
}

const ImpactLaw kLaw{1e5, 1.5};

void a_ball_on_a_floor_feels_the_law() {
  Scene scene(balls<pinocchio::JointModelFreeFlyer>(1));
  CHECK(scene.add_contact({kRadius, "ball 0"}, floor_of(1), kLaw,
                          CoulombFriction{0.5, 0.4, 0.005, 0.05}) == 0);
  SceneState state(scene);
  VectorXd q(7), v = VectorXd::Zero(6);
  q << 0.1, 0.2, kRadius - 5e-4, 0.6, 0, 0, 0.8;
  v[0] = 2;  // along x, which the rotation about x leaves
  const double normal = 1e5 * std::pow(5e-4, 1.5);
  const pinocchio::Force force = state.external_forces(q, v)[1];
  const Eigen::Matrix3d turn = Eigen::Quaterniond(0.8, 0.6, 0, 0).toRotationMatrix();
  CHECK((turn * force.linear() - Vector3d(-0.4 * normal, 0, normal)).norm() < 1e-12);
  // Friction acts at the touch point, the lower end of an arm of radius - depth.
  CHECK((turn * force.angular() - Vector3d(0, 0.4 * normal * (kRadius - 5e-4), 0)).norm() < 1e-14);
  const std::vector<SceneContact> contacts = state.contacts(q, v);
  CHECK(contacts.size() == 1 && contacts[0].pair == 0 && contacts[0].element == 0);
  CHECK(contacts[0].feature == Feature::Face);
  CHECK_NEAR(contacts[0].normal_force, normal, 1e-12);
  CHECK((contacts[0].friction_force - Vector3d(-0.4 * normal, 0, 0)).norm() < 1e-12);
  CHECK((contacts[0].slip_velocity - Vector3d(2, 0, 0)).norm() < 1e-15);
  CHECK((contacts[0].point - Vector3d(0.1, 0.2, 0)).norm() < 1e-15);
  q[2] = 1;
  const std::vector<pinocchio::Force>& far = state.external_forces(q, v);
  CHECK(far.size() == 2 && far[1].toVector().isZero(0));
  CHECK(state.contacts(q, v).empty());
}

void a_shell_may_be_on_a_moving_body() {
  Scene scene(balls<pinocchio::JointModelFreeFlyer>(2));
  Mount mount;
  mount.frame = "ball 1";
  mount.placement = SE3(Eigen::Matrix3d::Identity(), Vector3d(0, 0, 0.1));
  scene.add_contact({kRadius, "ball 0", {0, 0, -0.01}}, floor_of(0.1), kLaw, {}, mount);
  scene.add_contact({kRadius, "ball 0", {0.3, 0, 0}}, Sphere{0.05, "ball 1", {0.3, 0, 0.05}}, kLaw);
  CHECK(scene.num_pairs() == 2);
  SceneState state(scene);
  VectorXd q(14), v = VectorXd::Zero(12);
  q << 0, 0, 0.1 + 0.01 + kRadius - 1e-3, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 1;
  CHECK(state.contacts(q, v).size() == 1);
  q[2] = 0.05 + 0.05 + kRadius - 1e-3;  // the other pair
  const std::vector<SceneContact> contacts = state.contacts(q, v);
  CHECK(contacts.back().pair == 1);
  CHECK_NEAR(contacts.back().depth, 1e-3, 1e-15);
  // Both bodies stand as the world does: what acts on one acts on the other.
  const std::vector<pinocchio::Force>& forces = state.external_forces(q, v);
  const SE3 from_1(Eigen::Matrix3d::Identity(), q.head<3>());
  CHECK((from_1.act(forces[1]) + forces[2]).toVector().norm() < 1e-12);
}

void derivatives_are_those_of_the_forces() {
  Scene scene(balls<pinocchio::JointModelFreeFlyer>(1));
  scene.add_contact({kRadius, "ball 0", {1e-3, 2e-3, 0}}, floor_of(1),
                    ImpactLaw{1e5, 1.5, 10, 1e-3}, CoulombFriction{0.5, 0.4, 0.05, 0.5});
  SceneState state(scene);
  VectorXd q(7), v(6), q_moved(7);
  q << 0.1, 0.2, kRadius - 5e-4, 0.36, 0.48, 0, 0.8;
  v << 0.02, 0.01, -0.01, 0.3, -0.2, 0.1;
  MatrixXd by_q, by_v;
  state.contact_derivatives(q, v, by_q, by_v);
  CHECK(by_q.rows() == 6 && by_q.cols() == 6 && by_v.rows() == 6 && by_v.cols() == 6);
  // A free joint's Jacobian in its own frame is the identity.
  const auto force = [&](const VectorXd& at, const VectorXd& rate) -> VectorXd {
    return state.external_forces(at, rate)[1].toVector();
  };
  const double h = 1e-7;
  for (int k = 0; k < 6; ++k) {
    const VectorXd step = h * VectorXd::Unit(6, k);
    const VectorXd up = force(pinocchio::integrate(scene.model(), q, step), v);
    const VectorXd down = force(pinocchio::integrate(scene.model(), q, VectorXd(-step)), v);
    CHECK(((up - down) / (2 * h) - by_q.col(k)).norm() < 1e-5 * by_q.norm());
    const VectorXd slope = (force(q, v + step) - force(q, v - step)) / (2 * h);
    CHECK((slope - by_v.col(k)).norm() < 1e-5 * by_v.norm());
  }
}

// Puts a body on an incline of tan = 0.364 with mu = 0.5; returns how far it comes from 0.1 to 0.2
// s.
double creep(const FrictionLaw& friction, bool advance) {
  pinocchio::Model model = balls<pinocchio::JointModelTranslation>(1);
  model.gravity.linear() = 9.81 * Vector3d(std::sin(0.349), 0, -std::cos(0.349));
  Scene scene(model);
  scene.add_contact({kRadius, "ball 0"}, floor_of(1), ImpactLaw{1e5, 1.5, 50, 1e-5}, friction);
  SceneState state(scene);
  pinocchio::Data data(model);
  const double dt = 2e-5;
  VectorXd q = Vector3d(0, 0, kRadius - 4e-4), v = VectorXd::Zero(3);
  const VectorXd none = VectorXd::Zero(3);
  state.advance(q, v, 0);
  double start = 0;
  for (int step = 0; step < 10000; ++step) {
    if (step == 5000) start = q[0];
    const auto& forces = state.external_forces(q, v);
    v += dt * pinocchio::aba(model, data, Vector(q), Vector(v), Vector(none), forces);
    q = pinocchio::integrate(model, q, VectorXd(dt * v));
    if (advance) state.advance(q, v, dt);
  }
  const SceneContact contact = state.contacts(q, v).at(0);
  CHECK(contact.contact_id == 0);
  // Whether it rests or creeps at a constant speed, friction holds the weight along the incline.
  CHECK_NEAR(contact.friction_force[0], -kMass * 9.81 * std::sin(0.349), 1e-3);
  return q[0] - start;
}

void bristles_hold_what_rests() {
  const BristleFriction bristle{0.5, 0.5, 1e5, 20};
  CHECK(std::abs(creep(bristle, true)) < 1e-9);
  // Without the memory it stays unstretched; Coulomb's law creeps.
  CHECK(creep(bristle, false) > 1e-3);
  CHECK(creep(CoulombFriction{0.5, 0.5, 0.01, 0.1}, true) > 1e-4);
}

void states_are_independent() {
  Scene scene(balls<pinocchio::JointModelTranslation>(1));
  scene.add_contact({kRadius, "ball 0"}, floor_of(1), kLaw, BristleFriction{0.5, 0.5, 1e5});
  scene.set_relaxation(0, 1e-5);
  SceneState first(scene);
  VectorXd q = Vector3d(0, 0, kRadius - 5e-4), v = Vector3d(0.1, 0, 0);
  first.advance(q, v, 0);
  SceneState second = first;
  first.advance(q + 1e-5 * v, v, 1e-5);
  const VectorXd none = VectorXd::Zero(3);
  const double stretched = first.external_forces(q, none)[1].linear()[0];
  CHECK_NEAR(stretched, -1e5 * 1e-6, 1e-9);
  CHECK(second.external_forces(q, none)[1].linear()[0] == 0);
  second = first;
  CHECK(second.external_forces(q, none)[1].linear()[0] == stretched);
  // What is remembered is a value.
  SceneState third(scene);
  CHECK(third.values() != first.values());
  third.restore(first.values());
  CHECK(third.values() == first.values());
  CHECK(third.external_forces(q, none)[1].linear()[0] == stretched);
  CHECK_THROWS(InvalidParameter, "values = 1 numbers must be the values of a state",
               third.restore({0}));
  // A scene is copied when a state is made of it, and a model when a scene is.
  scene.add_contact({kRadius, "ball 0"}, floor_of(1), kLaw);
  CHECK(first.contacts(q, none).size() == 1 && SceneState(scene).contacts(q, none).size() == 2);
  const Scene empty(pinocchio::Model{});
  CHECK(SceneState(empty).external_forces(VectorXd(0), VectorXd(0)).size() == 1);
}

void bad_input_is_refused() {
  using E = InvalidParameter;
  Scene scene(balls<pinocchio::JointModelFreeFlyer>(1));
  const Shell floor = floor_of(1);
  CHECK_THROWS(FrameNotFound, "no frame 'bal'; the model has: universe, ball 0",
               scene.add_contact({kRadius, "bal"}, floor, kLaw));
  CHECK_THROWS(E, "radius = -1 must be positive [m]",
               scene.add_contact({-1, "ball 0"}, floor, kLaw));
  CHECK_THROWS(E, "radius = nan", scene.add_contact({kNan, "ball 0"}, floor, kLaw));
  CHECK_THROWS(E, "offset = [0, nan, 0] must be finite",
               scene.add_contact({1, "ball 0", {0, kNan, 0}}, floor, kLaw));
  CHECK_THROWS(E, "radius = 0", scene.add_contact({1, "ball 0"}, Sphere{0, "universe"}, kLaw));
  Mount mount;
  mount.frame = "table";
  CHECK_THROWS(FrameNotFound, "no frame 'table'",
               scene.add_contact({1, "ball 0"}, floor, kLaw, {}, mount));
  mount = {};
  mount.placement.translation()[2] = kNan;
  CHECK_THROWS(E, "placement = [0, 0, nan] must be finite",
               scene.add_contact({1, "ball 0"}, floor, kLaw, {}, mount));
  mount = {};
  mount.placement.rotation() *= -1;
  CHECK_THROWS(E, "placement.rotation = a matrix of determinant -1 must be a rotation",
               scene.add_contact({1, "ball 0"}, floor, kLaw, {}, mount));
  CHECK(scene.num_pairs() == 0);  // a refused contact leaves nothing behind
  CHECK_THROWS(E, "pair = 0 must be one of the 0", scene.set_relaxation(0, 1e-5));

  scene.add_contact({kRadius, "ball 0"}, floor, kLaw);
  CHECK_THROWS(E, "time = 0 must be positive [s]", scene.set_relaxation(0, 0));
  SceneState state(scene);
  const VectorXd q = pinocchio::neutral(scene.model()), v = VectorXd::Zero(6);
  VectorXd bad = q;
  CHECK_THROWS(E, "q = a vector of size 6 must have size 7: this model has nq = 7, nv = 6",
               state.external_forces(v, v));
  CHECK_THROWS(E, "v = a vector of size 0", state.contacts(q, VectorXd()));
  bad[1] = kNan;
  CHECK_THROWS(E, "q[1] = nan must be finite", state.external_forces(bad, v));
  VectorXd fast = v;
  fast[5] = std::numeric_limits<double>::infinity();
  CHECK_THROWS(E, "v[5] = inf", state.advance(q, fast, 0));
  bad = q;
  bad[6] = 2;
  CHECK_THROWS(E, "unit length", state.external_forces(bad, v));
  CHECK_THROWS(E, "dt = -1 must not be negative [s]", state.advance(q, v, -1));
  MatrixXd by_q, by_v;
  CHECK_THROWS(E, "unit length", state.contact_derivatives(bad, v, by_q, by_v));
  state.advance(q, v, 0);  // and it still works

  pinocchio::Model model = balls<pinocchio::JointModelFreeFlyer>(2);
  model.parents[1] = 2;
  CHECK_THROWS(E, "model.parents[1] = 2 must come before joint 'ball 0'", Scene{model});
  model = balls<pinocchio::JointModelFreeFlyer>(1);
  model.inertias[1].mass() = kNan;
  CHECK_THROWS(E, "must be finite: joint 'ball 0'", Scene{model});
  model = balls<pinocchio::JointModelFreeFlyer>(1);
  model.inertias.pop_back();
  CHECK_THROWS(E, "model.inertias = 1 must have 2 entries", Scene{model});
  model = balls<pinocchio::JointModelFreeFlyer>(1);
  model.joints[1].setIndexes(1, 40, 40, 40);
  CHECK_THROWS(E, "the indices of joint 'ball 0' are not those of its place", Scene{model});
  model = balls<pinocchio::JointModelFreeFlyer>(1);
  model.nq = 3;
  CHECK_THROWS(E, "nq = 3, nv = 6 are not the sums of its joints, 7 and 6", Scene{model});
}

}  // namespace

int main() {
  a_ball_on_a_floor_feels_the_law();
  a_shell_may_be_on_a_moving_body();
  derivatives_are_those_of_the_forces();
  bristles_hold_what_rests();
  states_are_independent();
  bad_input_is_refused();
}
