// What runs write down, as Python takes it.
#pragma once

#include "bindings/arrays.hpp"
#include "dynamics/run/simulation.hpp"

namespace sphshell {

// The memory of rows; NumPy's view of it with row_type() of their fields has named fields.
template <class Row>
Array<std::uint8_t> to_bytes(std::vector<Row> rows) {
  const std::size_t bytes = rows.size() * sizeof(Row);
  return array_of<std::uint8_t>(std::move(rows), {bytes});
}
// Arguments of numpy.dtype, of a row of `size` [B].
nb::dict row_type(const RowField* fields, std::size_t count, std::size_t size);
template <class Row, std::size_t count>
nb::dict row_type(const RowField (&fields)[count]) {
  return row_type(fields, count, sizeof(Row));
}
// Columns by their names, moved and not copied.
nb::dict to_dict(Record record, int nq, int nv);

// What a run answers, as Python has it: columns and figures by their names.
nb::dict as_python(SensitivityRecord record);
nb::dict as_python(const Counts& counts);
nb::list as_python(const std::vector<PairSummary>& summaries);
nb::list as_python(const std::vector<LimitSummary>& limits);
// (pair, depth [m]), or None.
nb::object as_python(const std::optional<DeepStart>& start);
inline int as_python(Simulation::Status status) { return static_cast<int>(status); }
inline Array<double> as_python(const VectorX& x) { return to_array(x); }
inline double as_python(double x) { return x; }
inline bool as_python(bool x) { return x; }

// What a run, while it goes on, and what is left of one tell alike: figures_of(self).
template <class T, class FiguresOf>
void bind_figures(nb::class_<T>& bound, FiguresOf figures_of) {
  const auto figure = [&](const char* name, auto member) {
    bound.def_prop_ro(
        name, [=](T& self) { return as_python(figures_of(self).*member); },
        nb::rv_policy::automatic);
  };
  figure("time", &Figures::time);
  figure("last_step", &Figures::last_step);
  figure("wall_time", &Figures::wall_time);
  figure("counts", &Figures::counts);
  figure("q", &Figures::q);
  figure("v", &Figures::v);
  figure("summaries", &Figures::summaries);
  figure("limits", &Figures::limits);
}

}  // namespace sphshell
