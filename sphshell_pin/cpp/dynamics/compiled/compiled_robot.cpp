#include "dynamics/compiled/compiled_robot.hpp"

#include <dlfcn.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <random>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// To be raised where the functions of the object change.
constexpr int kInterface = 1;
// Largest difference from Pinocchio, of the largest number of an answer.
constexpr double kAgreement = 1e-12;
constexpr int kStates = 5;

// Largest difference, of the largest number; not a number where one answer is none.
template <class A, class B>
static double relative_difference(const A& answer, const B& judge) {
  const double scale = judge.size() ? judge.cwiseAbs().maxCoeff() : 0;
  const double off =
      judge.size() ? (answer - judge).cwiseAbs().template maxCoeff<Eigen::PropagateNaN>() : 0;
  return off == 0 ? 0 : off / scale;
}

CompiledRobot::CompiledRobot(const std::string& path, const pinocchio::Model& model)
    : object_(dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL)), path_(path) {
  if (!object_) throw std::runtime_error("'" + path + "' cannot be opened: " + dlerror());
  try {
    const auto* sizes = find<const int>("sphshell_pin_sizes");
    const std::array<int, 4> wanted{kInterface, model.nq, model.nv, model.njoints};
    if (!std::equal(wanted.begin(), wanted.end(), sizes))
      throw std::runtime_error("'" + path + "' is of another model or version");
    acceleration_ =
        find<std::remove_pointer_t<decltype(acceleration_)>>("sphshell_pin_acceleration");
    kinematics_ = find<std::remove_pointer_t<decltype(kinematics_)>>("sphshell_pin_kinematics");
    check(model);
  } catch (...) {
    dlclose(object_);
    throw;
  }
}

CompiledRobot::~CompiledRobot() { dlclose(object_); }

template <class T>
T* CompiledRobot::find(const char* name) const {
  if (void* found = dlsym(object_, name)) return reinterpret_cast<T*>(found);
  throw std::runtime_error("'" + path_ + "' has no " + name);
}

// At states anywhere in the range of a radian or a meter around the neutral one.
void CompiledRobot::check(const pinocchio::Model& model) const {
  Multibody judge(model);
  for (int j = 1; j < model.njoints; ++j) judge.need(j);
  std::vector<int> joints(static_cast<std::size_t>(model.njoints - 1));
  for (int j = 1; j < model.njoints; ++j) joints[j - 1] = j;
  const auto count = static_cast<Eigen::Index>(model.njoints);
  MatrixX placements = MatrixX::Zero(12, count), own = placements;
  Matrix6X velocities = Matrix6X::Zero(6, count), rates = velocities;
  std::mt19937 random(1);
  const auto number = [&] { return std::uniform_real_distribution<double>(-1.5, 1.5)(random); };
  double worst = 0;
  const auto note = [&](double difference) {
    if (!(difference <= worst)) worst = difference;  // keeps what is not a number
  };
  for (int k = 0; k < kStates; ++k) {
    const VectorX step = VectorX::NullaryExpr(model.nv, number);
    const VectorX v = VectorX::NullaryExpr(model.nv, number);
    const VectorX tau = VectorX::NullaryExpr(model.nv, number);
    VectorX q, out(model.nv);
    q.resize(model.nq);
    judge.integrate(judge.neutral(), step, q);
    Forces external(model.joints.size(), pinocchio::Force::Zero());
    for (pinocchio::Force& force : external) force.toVector() = VectorX::NullaryExpr(6, number);
    for (const Forces* forces : {static_cast<const Forces*>(nullptr), &std::as_const(external)}) {
      acceleration(q.data(), v.data(), tau.data(),
                   forces ? forces->front().toVector().data() : nullptr, out.data());
      note(relative_difference(out, judge.acceleration(q, v, tau, forces)));
    }
    judge.kinematics(q, v);
    kinematics(joints.data(), static_cast<int>(joints.size()), q.data(), v.data(),
               placements.data(), velocities.data());
    for (int j = 1; j < model.njoints; ++j) {
      const pinocchio::SE3& pose = judge.world_from_joint(j);
      own.col(j) << pose.rotation().reshaped(), pose.translation();
      rates.col(j) = judge.velocity(j).toVector();
    }
    note(relative_difference(placements, own));
    note(relative_difference(velocities, rates));
  }
  if (worst <= kAgreement) return;
  char text[16];
  std::snprintf(text, sizeof text, "%.1e", worst);
  throw std::domain_error("'" + path_ + "' differs from Pinocchio by " + text +
                          " of the largest number of an answer");
}

}  // namespace sphshell
