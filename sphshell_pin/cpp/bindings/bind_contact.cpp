#include <nanobind/eigen/dense.h>
#include <nanobind/nanobind.h>

#include "contact/friction.hpp"

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
  nb::class_<FrictionLaw>(m, "FrictionLaw")
      .def_static(
          "two_velocity",
          [](double mu_static, double mu_dynamic, double v_static, double v_dynamic) {
            FrictionLaw law;
            law.kind = FrictionLaw::Kind::TwoVelocity;
            law.mu_static = mu_static;
            law.mu_dynamic = mu_dynamic;
            law.v_static = v_static;
            law.v_dynamic = v_dynamic;
            return law;
          },
          nb::arg("mu_static"), nb::arg("mu_dynamic"), nb::arg("v_static"), nb::arg("v_dynamic"))
      .def_static(
          "bristle",
          [](double mu_static, double mu_dynamic, double stiffness, double damping,
             double v_stribeck, bool torsional) {
            FrictionLaw law;
            law.kind = FrictionLaw::Kind::Bristle;
            law.mu_static = mu_static;
            law.mu_dynamic = mu_dynamic;
            law.stiffness = stiffness;
            law.damping = damping;
            law.v_static = v_stribeck;
            law.torsional = torsional;
            return law;
          },
          nb::arg("mu_static"), nb::arg("mu_dynamic"), nb::arg("stiffness"), nb::arg("damping"),
          nb::arg("v_stribeck"), nb::arg("torsional"))
      .def("coefficient", &FrictionLaw::coefficient, nb::arg("speed"));
  m.def(
      "contact_force",
      [](const NormalLaw& law, const FrictionLaw* friction, double depth, const Vec3& normal,
         const Vec3& relative, double spin, const Vec3& bristle, double radius, double relaxation) {
        const Meeting<double> meeting{depth, normal, relative, spin, bristle};
        const ContactForce<double> f =
            contact_force(law, friction ? *friction : FrictionLaw(), radius, relaxation, meeting);
        return nb::make_tuple(f.normal, f.friction, f.torsion, f.bristle_rate);
      },
      nb::arg("law"), nb::arg("friction").none(), nb::arg("depth"), nb::arg("normal"),
      nb::arg("relative"), nb::arg("spin"), nb::arg("bristle"), nb::arg("radius"),
      nb::arg("relaxation"));
}
