#include "bindings/interop.hpp"

#include "dynamics/sensing/sensors.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/vector.h>

namespace nb = nanobind;
using namespace nb::literals;

void bind_sensors(nb::module_& m) {
  using namespace sphshell;
  using Parameters = Eigen::Matrix<double, 10, 1>;
  // What is measured is set at construction, the way of the signal by fields.
  nb::class_<Sensor>(m, "Sensor")
      .def_static(
          "force_torque",
          [](int joint, const SE3& frame, const Parameters& inertia, std::vector<int> children,
             std::vector<int> pairs_i, std::vector<int> pairs_j, std::vector<int> frames) {
            // Mass, first and second moments, as of Pinocchio's dynamic parameters; no mass:
            // nothing is beyond the sensor.
            const auto beyond = inertia[0] > 0 ? pinocchio::Inertia::FromDynamicParameters(inertia)
                                               : pinocchio::Inertia::Zero();
            return Sensor{ForceTorque{joint, frame, beyond, std::move(children), std::move(pairs_i),
                                      std::move(pairs_j), std::move(frames)}};
          },
          nb::kw_only(), "joint"_a, "frame"_a, "inertia"_a, "children"_a, "pairs_i"_a, "pairs_j"_a,
          "frames"_a)
      .def_static(
          "joint_torque", [](int index) { return Sensor{JointTorque{index}}; }, nb::kw_only(),
          "index"_a)
      .def_static(
          "contact_switch",
          [](std::vector<int> pairs, double threshold, double release) {
            return Sensor{ContactSwitch{std::move(pairs), threshold, release}};
          },
          nb::kw_only(), "pairs"_a, "threshold"_a, "release"_a)
      .def_prop_ro("size", &Sensor::size)
      .def_rw("rate", &Sensor::rate)
      .def_rw("delay", &Sensor::delay)
      .def_rw("cutoff", &Sensor::cutoff)
      .def_rw("range", &Sensor::range)
      .def_rw("noise", &Sensor::noise)
      .def_rw("seed", &Sensor::seed);
  m.def("normal_noise", &normal_noise, "seed"_a, "sample"_a, "value"_a);
}
