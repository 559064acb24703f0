// A fingertip on a wall, in your own loop: finger_on_wall three_link_finger.urdf
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <sphshell_pin/scene.hpp>

#include <cstdio>

namespace pin = pinocchio;
namespace sp = sphshell_pin;
using Vector = Eigen::Ref<const Eigen::VectorXd>;  // for which Pinocchio has aba() compiled

int main(int argc, char** argv) try {
  if (argc != 2) throw std::invalid_argument("usage: finger_on_wall URDF");
  pin::Model model;
  pin::urdf::buildModel(argv[1], model);
  pin::Data data(model);

  const sp::Shell wall(
      {{0.07, -0.1, 0.0}, {0.07, 0.1, 0.0}, {0.07, 0.1, 0.2}, {0.07, -0.1, 0.2}},  // [m]
      {{0, 1, 2, 3}});
  sp::Scene scene(model);
  scene.add_contact(sp::Sphere{0.010, "tip"}, wall, sp::ImpactLaw{1e6, 1.5, 20.0, 1e-4},
                    sp::CoulombFriction{0.5, 0.4, 0.005, 0.05});
  sp::SceneState state(scene);

  const double kp = 0.5, kd = 0.01, dt = 2e-5;
  Eigen::VectorXd q = Eigen::Vector3d(0.2, 0.6, 0.4), v = Eigen::VectorXd::Zero(model.nv);
  const Eigen::VectorXd q_wanted = q.array() + 0.2;
  for (int step = 0; step < 15000; ++step) {
    const Eigen::VectorXd tau = kp * (q_wanted - q) - kd * v;
    const auto& forces = state.external_forces(q, v);
    v += dt * pin::aba(model, data, Vector(q), Vector(v), Vector(tau), forces);
    q = pin::integrate(model, q, Eigen::VectorXd(dt * v));
    state.advance(q, v, dt);
  }

  std::printf("q %.15g %.15g %.15g\n", q[0], q[1], q[2]);
  for (const sp::SceneContact& contact : state.contacts(q, v))
    std::printf("force %.15g N, depth %.15g m, element %d\n", contact.normal_force, contact.depth,
                contact.element);
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 2;
}
