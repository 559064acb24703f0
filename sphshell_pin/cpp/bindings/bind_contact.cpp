#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>

#include "contact/laws.hpp"

namespace nb = nanobind;

void bind_contact(nb::module_& m) {
  using namespace sphshell;
  nb::class_<NormalLaw>(m, "NormalLaw")
      .def(
          "__init__",
          [](NormalLaw* law, int kind, double stiffness, double exponent, double damping,
             double full_damping_depth) {
            new (law) NormalLaw{static_cast<NormalLaw::Kind>(kind), stiffness, exponent, damping,
                                full_damping_depth};
          },
          nb::arg("kind"), nb::arg("stiffness"), nb::arg("exponent"), nb::arg("damping"),
          nb::arg("full_damping_depth") = 1.0)
      .def("force",
           [](const NormalLaw& law, double depth, double gap_rate) {
             return depth > 0 ? law.force(depth, gap_rate).total : 0.0;
           })
      .def("energy",
           [](const NormalLaw& law, double depth) { return depth > 0 ? law.energy(depth) : 0.0; });
  nb::class_<CoulombLaw>(m, "CoulombLaw")
      .def(
          "__init__",
          [](CoulombLaw* law, double mu_static, double mu_dynamic, double v_static,
             double v_dynamic) {
            new (law) CoulombLaw{true, mu_static, mu_dynamic, v_static, v_dynamic};
          },
          nb::arg("mu_static"), nb::arg("mu_dynamic"), nb::arg("v_static"), nb::arg("v_dynamic"))
      .def("coefficient",
           [](const CoulombLaw& law, double speed) { return speed * law.over_speed(speed); });
  m.def(
      "contact_force",
      [](const NormalLaw& law, const CoulombLaw* friction, double depth, const Vec3& normal,
         const Vec3& relative) {
        const ContactForce f =
            contact_force(law, friction ? *friction : CoulombLaw(), depth, normal, relative);
        return nb::make_tuple(f.normal, f.friction, f.slip);
      },
      nb::arg("law"), nb::arg("friction").none(), nb::arg("depth"), nb::arg("normal"),
      nb::arg("relative"));
}
