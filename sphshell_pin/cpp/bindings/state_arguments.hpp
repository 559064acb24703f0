// q, v and tau as users hand them over: checked once, here.
#pragma once

#include "bindings/interop.hpp"

#include <cstring>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <utility>

#include "bindings/own_errors.hpp"
#include "dynamics/scene/multibody.hpp"

namespace sphshell {

// Of a model: q (nq), v and tau (nv).
struct StateArgument {
  VectorX q, v, tau;
};

// Arrays of float64 with the right sizes, finite and normalized, pass at once; None stands for
// zeros. All else (lists, integers, masked arrays, mistakes) goes to a Python function, which
// returns such arrays or raises: it alone knows the words of the errors.
class StateArguments {
 public:
  // `shown` is the copy of `model` that users read; a change of it is an error.
  // convert(q, v, tau) -> the three as arrays.
  StateArguments(nb::object model, nb::object shown, nb::object convert)
      : model_object_(std::move(model)),
        shown_object_(std::move(shown)),
        convert_(std::move(convert)),
        array_type_(nb::module_::import_("numpy").attr("ndarray")),
        model_(model_of(model_object_)),
        shown_(model_of(shown_object_)) {}

  StateArgument operator()(nb::handle q, nb::handle v, nb::handle tau) const {
    StateArgument out;
    if (unchanged() && read_all(q, v, tau, out)) return out;
    const nb::object arrays = convert_(q, v, tau);
    if (!read_all(arrays[0], arrays[1], arrays[2], out))
      raise_own("InvalidParameter", "q", q, "must be a configuration of this model");
    return out;
  }

 private:
  // False where one of them needs a conversion, or is wrong.
  bool read_all(nb::handle q, nb::handle v, nb::handle tau, StateArgument& out) const {
    return read(q, model_.nq, out.q) && read(v, model_.nv, out.v) &&
           read(tau, model_.nv, out.tau) &&
           // Coordinates that are as many as velocities are no quaternions.
           (model_.nq == model_.nv || pinocchio::isNormalized(model_, out.q, 1e-3));
  }

  // False unless it is a contiguous array of float64 with that many finite numbers, or None.
  bool read(nb::handle given, Eigen::Index size, VectorX& out) const {
    if (given.is_none()) {
      out.setZero(size);
      return true;
    }
    // Subclasses, such as masked arrays, may mean something else by their numbers.
    if (Py_TYPE(given.ptr()) != reinterpret_cast<PyTypeObject*>(array_type_.ptr())) return false;
    Py_buffer buffer;
    if (PyObject_GetBuffer(given.ptr(), &buffer, PyBUF_ND | PyBUF_FORMAT)) {
      PyErr_Clear();  // not contiguous
      return false;
    }
    const bool fits =
        buffer.ndim == 1 && buffer.shape[0] == size && std::strcmp(buffer.format, "d") == 0;
    if (fits) out = Eigen::Map<const VectorX>(static_cast<const double*>(buffer.buf), size);
    PyBuffer_Release(&buffer);
    return fits && out.allFinite();
  }

  // What the forces and accelerations depend on, by its bits: a number that is nan has not changed.
  // Pinocchio's own comparison takes as long as a third of ABA; runs make it, too.
  bool unchanged() const {
    const pinocchio::Model &a = model_, &b = shown_;
    return a.njoints == b.njoints && a.frames.size() == b.frames.size() && a.parents == b.parents &&
           same(a.gravity.toVector(), b.gravity.toVector()) && same_parts(a.inertias, b.inertias) &&
           same_parts(a.jointPlacements, b.jointPlacements) && same(a.armature, b.armature);
  }

  template <class Vector>
  static bool same(const Vector& a, const Vector& b) {
    return a.size() == b.size() &&
           std::memcmp(a.data(), b.data(), std::size_t(a.size()) * sizeof(double)) == 0;
  }

  template <class Parts>
  static bool same_parts(const Parts& a, const Parts& b) {
    using Part = typename Parts::value_type;
    return a.size() == b.size() &&
           std::memcmp(static_cast<const void*>(a.data()), b.data(), a.size() * sizeof(Part)) == 0;
  }

  const nb::object model_object_, shown_object_, convert_, array_type_;
  const pinocchio::Model &model_, &shown_;
};

}  // namespace sphshell
