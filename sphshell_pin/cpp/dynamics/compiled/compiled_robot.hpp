// Forward dynamics and kinematics of one model as a shared object of generated C.
#pragma once

#include <pinocchio/multibody.hpp>

#include <string>

namespace sphshell {

// The functions of an object that Python's dynamics/compiled generates: constants of the model are
// folded into them, and they know no type of Eigen's or Pinocchio's. They have no state.
class CompiledRobot {
 public:
  // Opens the object, and compares its answers with Pinocchio's at several states. Throws
  // std::runtime_error, in one sentence, where it cannot be opened, is of another model, or differs
  // by more than 1e-12 of the largest number of an answer.
  CompiledRobot(const std::string& path, const pinocchio::Model& model);
  CompiledRobot(const CompiledRobot&) = delete;
  CompiledRobot& operator=(const CompiledRobot&) = delete;
  ~CompiledRobot();

  // `external`: 6 numbers for each joint, or null; `out`: (nv).
  void acceleration(const double* q, const double* v, const double* tau, const double* external,
                    double* out) const {
    acceleration_(q, v, tau, external, out);
  }
  // Of `count` joints, parents first, by number: placements (12 numbers for each joint of the
  // model: a rotation by columns, a translation), and velocities (6) unless v is null.
  void kinematics(const int* joints, int count, const double* q, const double* v,
                  double* placements, double* velocities) const {
    kinematics_(joints, count, q, v, placements, velocities);
  }

 private:
  void check(const pinocchio::Model& model) const;
  template <class T>
  T* find(const char* name) const;

  void* object_;
  std::string path_;
  void (*acceleration_)(const double*, const double*, const double*, const double*, double*);
  void (*kinematics_)(const int*, int, const double*, const double*, double*, double*);
};

}  // namespace sphshell
