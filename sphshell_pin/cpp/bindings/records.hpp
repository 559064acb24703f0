// What runs write down, as Python takes it.
#pragma once

#include <nanobind/nanobind.h>

#include <vector>

#include "bindings/arrays.hpp"
#include "dynamics/simulation.hpp"

namespace sphshell {

// The memory of rows; NumPy's view of it with contact_row_type() has named fields.
Array<std::uint8_t> to_bytes(std::vector<ContactRow> rows);
// Arguments of numpy.dtype.
nb::dict contact_row_type();
nb::dict to_dict(Record record, int nq, int nv);
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
