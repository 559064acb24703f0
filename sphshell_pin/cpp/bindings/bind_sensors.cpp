#include "bindings/interop.hpp"

#include "dynamics/sensing/sensors.hpp"

#include <nanobind/stl/map.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

namespace nb = nanobind;
using namespace nb::literals;

void bind_sensors(nb::module_& m) {
  using namespace sphshell;
  // What is measured is set at construction, the way of the signal by attributes.
  nb::class_<Sensor>(m, "Sensor")
      .def(
          "__init__",
          [](Sensor* self, const std::string& kind, std::map<std::string, VectorX> fields) {
            new (self) Sensor{make_measured(kind, {std::move(fields)})};
          },
          "kind"_a, "fields"_a)
      .def_prop_ro("size", &Sensor::size)
      .def_rw("rate", &Sensor::rate)
      .def_rw("delay", &Sensor::delay)
      .def_rw("cutoff", &Sensor::cutoff)
      .def_rw("range", &Sensor::range)
      .def_rw("noise", &Sensor::noise)
      .def_rw("seed", &Sensor::seed);
  m.def("normal_noise", &normal_noise, "seed"_a, "sample"_a, "value"_a);
}
