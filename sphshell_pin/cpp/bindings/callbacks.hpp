// Users' routines as the core calls them, and how the garbage collector sees them.
//
// Types that hold a routine say so by tp_traverse. None needs tp_clear: the core's objects do not
// refer to each other in a circle, so every cycle passes through a Python object that is cleared.
#pragma once

#include "bindings/gil.hpp"
#include "dynamics/control/controllers.hpp"

namespace sphshell {

// A Python object that a routine needs. Each copy has a reference of its own, as the garbage
// collector wants to count.
class Routine {
 public:
  explicit Routine(nb::object object) : object_(std::move(object)) {}
  Routine(const Routine& other);
  Routine(Routine&&) = default;
  ~Routine();
  nb::handle object() const { return object_; }

 private:
  nb::object object_;
};

// A contact source. The callable returns points, normals and depths as arrays of float64, checked
// and made contiguous by its Python wrapper.
class PythonSource : public Routine {
 public:
  using Routine::Routine;
  // Appends the contacts that the user's function finds, but for those without a depth.
  void operator()(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& out) const;
};

// What the user's function of these numbers returns.
double call_law(nb::handle callable, const std::vector<double>& where);

// A function of a law: the C function at an address, which `object` keeps alive, or without one
// the callable itself, whose Python wrapper knows the parameters and returns a float.
template <class... Where>
class LawFunction : public Routine {
 public:
  LawFunction(std::uintptr_t address, nb::object object)
      : Routine(std::move(object)), pointer_(reinterpret_cast<Pointer>(address)) {}
  double operator()(Where... where, const double* parameters) const {
    return pointer_ ? pointer_(where..., parameters) : call_law(object(), {where...});
  }

 private:
  using Pointer = double (*)(Where..., const double*);
  Pointer pointer_;
};
using LawForce = LawFunction<double, double>;
using LawEnergy = LawFunction<double>;

// A callable tau(t, q, v, contacts): vectors and rows of contacts come as memory, of which its
// Python wrapper makes arrays; it returns an array of float64 (nv). One that reads sensors takes
// their latest readings too.
class PythonController : public Controller, public Routine {
 public:
  using Routine::Routine;
  bool follows_time() const override { return true; }
  void read(const std::vector<double>& readings) override { readings_ = &readings; }
  void torque(SceneData& scene, double t, const VectorX& q, const VectorX& v,
              VectorX& tau) override;

 private:
  const std::vector<double>* readings_ = nullptr;  // of the run's sensors
};

// Shows objects to Python's garbage collector, until it wants no more.
struct Visitor {
  visitproc visit;
  void* arg;
  int stop = 0;

  void operator()(nb::handle object) {
    if (stop == 0 && object.is_valid()) stop = visit(object.ptr(), arg);
  }
};

// The Python objects that a law, a pair or pairs hold.
void look_at(const NormalLaw& law, Visitor& visitor);
void look_at(const FrictionLaw& friction, Visitor& visitor);
void look_at(const Pair& pair, Visitor& visitor);
void look_at(const std::vector<Pair>& pairs, Visitor& visitor);
inline void look_at(const Routine& routine, Visitor& visitor) { visitor(routine.object()); }

// tp_traverse of a bound T: its type, and what look_at() shows of it.
template <class T>
int traverse(PyObject* self, visitproc visit, void* arg) {
  Visitor visitor{visit, arg};
  visitor(nb::handle((PyObject*)Py_TYPE(self)));
  if (nb::inst_ready(self)) look_at(*nb::inst_ptr<T>(self), visitor);
  return visitor.stop;
}

// Lets Python's garbage collector see what the object holds, so that cycles through callbacks are
// freed.
template <class T>
nb::type_slots slots() {
  static PyType_Slot all[] = {{Py_tp_traverse, reinterpret_cast<void*>(&traverse<T>)},
                              {0, nullptr}};
  return nb::type_slots(all);
}

}  // namespace sphshell
