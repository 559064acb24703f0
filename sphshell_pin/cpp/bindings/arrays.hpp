// Conversions between C++ rows and NumPy arrays that own their memory.
#pragma once

#include <nanobind/ndarray.h>

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "bindings/own_errors.hpp"

namespace sphshell {

template <class T>
using Array = nb::ndarray<nb::numpy, T>;
using Points = nb::ndarray<const double, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Doubles = nb::ndarray<const double, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using IntTriples = nb::ndarray<const int, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Ints = nb::ndarray<const int, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Bytes = nb::ndarray<const std::uint8_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;

// Moves a vector's memory into an array of the given shape; one of const elements is read-only.
template <class Element, class T>
Array<Element> array_of(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Array<Element>(kept->data(), shape, owner);
}

template <class T>
Array<T> to_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  return array_of<T>(std::move(values), shape);
}

template <class T>
Array<T> to_array(std::vector<T> values) {
  const std::size_t n = values.size();
  return to_array(std::move(values), {n});
}

// Of several columns.
template <class... T>
nb::tuple to_arrays(std::vector<T>... columns) {
  return nb::make_tuple(to_array(std::move(columns))...);
}

// nanobind's own conversion of small vectors and matrices calls numpy.copy, which is written in
// Python: a daemon thread may end in it when the interpreter does (see gil.hpp).
inline Array<double> to_array(const Eigen::VectorXd& x) {
  return to_array(std::vector<double>(x.begin(), x.end()));
}

template <class Element = double>
Array<Element> by_rows(const Eigen::MatrixXd& x) {
  const auto rows = x.reshaped<Eigen::RowMajor>();
  return array_of<Element>(std::vector<double>(rows.begin(), rows.end()),
                           {std::size_t(x.rows()), std::size_t(x.cols())});
}

inline Array<double> to_array(const Eigen::MatrixXd& x) { return by_rows(x); }

// What users may only read: a vector, or a matrix row by row, as NumPy's arrays are by default,
// while Eigen's are column by column.
template <class Derived>
Array<const double> read_only_array(const Eigen::MatrixBase<Derived>& x) {
  if constexpr (Derived::ColsAtCompileTime != 1)
    return by_rows<const double>(x);
  else
    return array_of<const double>(std::vector<double>(x.derived().begin(), x.derived().end()),
                                  {std::size_t(x.size())});
}

// The three numbers of a vector, behind those that are there.
inline void append(std::vector<double>& out, const Eigen::Vector3d& x) {
  out.insert(out.end(), x.data(), x.data() + 3);
}

// Row i of an array (n, 3).
inline Eigen::Vector3d row(const Points& points, std::size_t i) {
  return Eigen::Vector3d(points(i, 0), points(i, 1), points(i, 2));
}

}  // namespace sphshell
