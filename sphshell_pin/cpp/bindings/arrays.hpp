// Conversions between C++ rows and NumPy arrays that own their memory.
#pragma once

#include <nanobind/ndarray.h>

#include <functional>
#include <initializer_list>

#include "bindings/own_errors.hpp"
#include "shell/topology.hpp"

namespace sphshell {

template <class T>
using Array = nb::ndarray<nb::numpy, T>;
template <class T, int... columns>
using InArray = nb::ndarray<const T, nb::shape<-1, columns...>, nb::c_contig, nb::device::cpu>;

// Moves a vector's memory into an array of the given shape; one of const elements is read-only.
template <class Element, class Row>
Array<Element> array_of(std::vector<Row> rows, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<Row>(std::move(rows));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
  return Array<Element>(kept->data(), shape, owner);
}

template <class T>
Array<T> to_array(std::vector<T> values, std::initializer_list<std::size_t> shape) {
  return array_of<T>(std::move(values), shape);
}

// Rows of so many columns.
template <std::size_t columns, class T>
Array<T> rows_of(std::vector<T> values) {
  const std::size_t rows = values.size() / columns;
  return to_array(std::move(values), {rows, columns});
}

// (n,) of numbers, (n, k) of vectors or arrays of k numbers.
template <class Row>
auto to_array(std::vector<Row> rows) {
  const std::size_t n = rows.size();
  if constexpr (std::is_arithmetic_v<Row>)
    return to_array(std::move(rows), {n});
  else
    return array_of<typename Row::value_type>(std::move(rows),
                                              {n, sizeof(Row) / sizeof(typename Row::value_type)});
}

// Of the memory of several vectors.
template <class... Row>
nb::tuple to_arrays(std::vector<Row>&... columns) {
  return nb::make_tuple(to_array(std::move(columns))...);
}

// What `get`, a member or a function, gives of each row.
template <class Row, class Get>
auto column(const std::vector<Row>& rows, Get get) {
  std::vector<std::decay_t<std::invoke_result_t<Get, const Row&>>> out;
  for (const Row& row : rows) out.push_back(std::invoke(get, row));
  return out;
}
template <class Row, class... Get>
nb::tuple columns(const std::vector<Row>& rows, Get... get) {
  return nb::make_tuple(to_array(column(rows, get))...);
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

}  // namespace sphshell

// Of an array that is contiguous, or made so; its memory is looked at.
template <class T, int... columns>
struct nanobind::detail::type_caster<sphshell::Rows<T, columns...>> {
  using Rows = sphshell::Rows<T, columns...>;
  using Array = make_caster<sphshell::InArray<T, columns...>>;
  NB_TYPE_CASTER(Rows, Array::Name)

  bool from_python(handle src, uint32_t flags, cleanup_list* cleanup) noexcept {
    if (!array.from_python(src, flags, cleanup)) return false;
    value = {array.value.data(), array.value.shape(0)};
    return true;
  }

 private:
  Array array;  // kept during the call
};
