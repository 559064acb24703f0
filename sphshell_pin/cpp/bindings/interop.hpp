// The border to Pinocchio's own Python objects: the one place that knows Boost.Python.
#pragma once

#include <pinocchio/multibody.hpp>
// Pinocchio first: Boost.Python's headers disturb it otherwise.
#include <nanobind/eigen/dense.h>
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

// A placement comes as its homogeneous transform (4, 4), whose last row is not looked at.
template <>
struct nanobind::detail::type_caster<pinocchio::SE3> {
  using Matrix = make_caster<Eigen::Matrix4d>;
  NB_TYPE_CASTER(pinocchio::SE3, Matrix::Name)

  bool from_python(handle src, uint32_t flags, cleanup_list* cleanup) noexcept {
    Matrix matrix;
    if (!matrix.from_python(src, flags, cleanup)) return false;
    value = pinocchio::SE3(Eigen::Matrix3d(matrix.value.topLeftCorner<3, 3>()),
                           Eigen::Vector3d(matrix.value.topRightCorner<3, 1>()));
    return true;
  }
};
