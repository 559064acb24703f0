// What runs write down, as Python takes it.
#pragma once

#include <nanobind/nanobind.h>

#include <utility>
#include <vector>

#include "bindings/arrays.hpp"
#include "dynamics/run/simulation.hpp"

namespace sphshell {

// The memory of rows; NumPy's view of it with row_type() of their fields has named fields.
template <class Row>
Array<std::uint8_t> to_bytes(std::vector<Row> rows) {
  auto* kept = new std::vector<Row>(std::move(rows));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<Row>*>(p); });
  return Array<std::uint8_t>(kept->data(), {kept->size() * sizeof(Row)}, owner);
}
// Arguments of numpy.dtype, of a row of `size` [B].
nb::dict row_type(const RowField* fields, std::size_t count, std::size_t size);
template <class Row, std::size_t count>
nb::dict row_type(const RowField (&fields)[count]) {
  return row_type(fields, count, sizeof(Row));
}
// Columns by their names, moved and not copied.
nb::dict to_dict(Record record, int nq, int nv);
nb::dict to_dict(SensitivityRecord record);
nb::dict to_dict(const Counts& counts);
// (pair, depth [m]), or None.
nb::object to_python(const std::optional<DeepStart>& start);
nb::list to_list(const std::vector<PairSummary>& summaries);
nb::list to_list(const std::vector<LimitSummary>& limits);
template <class T>
std::vector<T> copies(const std::vector<const T*>& all) {
  std::vector<T> out;
  for (const T* one : all) out.push_back(*one);
  return out;
}

}  // namespace sphshell
