// The border to Pinocchio's own Python objects: the one place that knows Boost.Python.
#pragma once

#include <pinocchio/multibody.hpp>
// Pinocchio first: Boost.Python's headers disturb it otherwise.
#include <nanobind/nanobind.h>

#include <boost/python.hpp>
#include <vector>

namespace sphshell {

// The caller has checked that `object` is a pinocchio.Model.
inline const pinocchio::Model& model_of(nanobind::handle object) {
  return boost::python::extract<pinocchio::Model&>(object.ptr())();
}

template <class T>
nanobind::object to_python(const T& value) {
  const boost::python::object object(value);
  return nanobind::borrow(object.ptr());
}

}  // namespace sphshell
