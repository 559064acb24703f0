// A Panda presses a ball into waves of 2 (VERTICES - 1)^2 triangles, by Pinocchio's ABA and by a
// compiled robot.
// It prints how far the accelerations of the two are apart, and the time of a step [us] of each.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/parsers/urdf.hpp>
#include <sphshell_pin/scene.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector = Eigen::Ref<const VectorXd>;  // for which Pinocchio has aba() compiled

constexpr double kStep = 1e-6;  // s
constexpr int kRounds = 9;
constexpr char kTip[] = "panda_hand_tcp";

double height(double x, double y) { return 0.05 * std::sin(5 * x) * std::cos(5 * y); }

sphshell_pin::Shell waves(int count) {
  sphshell_pin::Points points;
  std::vector<sphshell_pin::Element> elements;
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      const double x = -1 + 2.0 * i / (count - 1), y = -1 + 2.0 * j / (count - 1);
      points.push_back({x, y, height(x, y)});
      if (i + 1 == count || j + 1 == count) continue;
      const int a = i * count + j, b = a + count;
      elements.push_back({a, b, b + 1});
      elements.push_back({a, b + 1, a + 1});
    }
  return {points, elements};
}

// Seconds of the processor for a step, by `accelerate(q, v)`.
template <class Acceleration>
double time_of_step(int steps, VectorXd q, VectorXd v, Acceleration accelerate) {
  const std::clock_t began = std::clock();
  for (int k = 0; k < steps; ++k) {
    v += kStep * accelerate(q, v);
    q += kStep * v;
  }
  return static_cast<double>(std::clock() - began) / CLOCKS_PER_SEC / steps;
}

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + kRounds / 2, values.end());
  return values[kRounds / 2];
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: press URDF COMPILED STEPS VERTICES\n");
    return 2;
  }
  const int steps = std::atoi(argv[3]);
  pinocchio::Model model;
  pinocchio::urdf::buildModel(argv[1], model);
  pinocchio::Data data(model);
  VectorXd q(9);
  q << 0, 0.35, 0, -2.0, 0, 2.35, 0.8, 0.02, 0.02;
  const VectorXd v = VectorXd::Constant(9, 1e-3), tau = VectorXd::Zero(9);
  pinocchio::framesForwardKinematics(model, data, q);

  sphshell_pin::Scene scene(model);
  sphshell_pin::Mount mount;
  const double radius = 0.012, depth = 0.0005;
  mount.placement.translation() = data.oMf[model.getFrameId(kTip)].translation() +
                                  Vector3d(-0.013, 0.007, depth - radius - height(0.013, -0.007));
  scene.add_contact({radius, kTip}, waves(std::atoi(argv[4])),
                    sphshell_pin::ImpactLaw{1e4, 1.5, 50.0, 1e-4},
                    sphshell_pin::CoulombFriction{0.3, 0.2, 0.01, 0.1}, mount);
  sphshell_pin::SceneState by_pinocchio(scene);
  scene.use_compiled(argv[2]);
  sphshell_pin::SceneState compiled(scene);

  const auto aba = [&](const VectorXd& q, const VectorXd& v) -> const VectorXd& {
    return pinocchio::aba(model, data, Vector(q), Vector(v), Vector(tau),
                          by_pinocchio.external_forces(q, v));
  };
  const auto own = [&](const VectorXd& q, const VectorXd& v) -> const VectorXd& {
    return compiled.acceleration(q, v, tau);
  };
  const VectorXd judge = aba(q, v);
  std::printf("touching %zu, apart %.3e\n", by_pinocchio.contacts(q, v).size(),
              (own(q, v) - judge).cwiseAbs().maxCoeff() / judge.cwiseAbs().maxCoeff());
  std::vector<double> taken, taken_compiled;
  for (int k = 0; k < kRounds; ++k) {
    taken.push_back(time_of_step(steps, q, v, aba));
    taken_compiled.push_back(time_of_step(steps, q, v, own));
  }
  const double before = median(taken) * 1e6, after = median(taken_compiled) * 1e6;
  std::printf("pinocchio %.3f us, compiled %.3f us, ratio %.2f\n", before, after, before / after);
  return 0;
}
