#include "bindings/interop.hpp"

#include "bindings/law_integral.hpp"

#include <nanobind/stl/vector.h>

#include "contact/laws/dual.hpp"

using namespace sphshell;

namespace {

// The parameters of a kind as rows of name, unit, bounds (above, at least, at most) and default.
template <class Family>
nb::list parameters_of(const std::string& kind) {
  struct Lister {
    nb::list rows;
    void operator()(const char* name, const std::optional<double>& value, const Bounds& b) {
      rows.append(nb::make_tuple(name, b.unit, b.above, b.at_least, b.at_most,
                                 value ? nb::cast(*value) : nb::none()));
    }
    void operator()(const char* name, const std::vector<double>&, const Bounds& b) {
      (*this)(name, std::nullopt, b);
    }
  } lister;
  Kinds<Family>::of(kind, [&](auto law, auto*) { law.each(law, lister); });
  return std::move(lister.rows);
}

// Binds a family, whose member `law` holds one of its kinds: made by the name of a kind and the
// numbers of its dataclass, with the names of all kinds and what C++ states of their parameters.
template <class Law>
nb::class_<Law> bind_family(nb::module_& m, const char* name, nb::type_slots parts) {
  using Family = Kinds<decltype(Law::law)>;
  return nb::class_<Law>(m, name, parts)
      .def("__init__", [](Law* self, const std::string& kind,
                          const Numbers& numbers) { new (self) Law{Family::make(kind, numbers)}; })
      .def_static("kinds", &Family::names)
      .def_static("parameters", &parameters_of<decltype(Law::law)>);
}

// A law of a user's functions; without one of energy that is the integral of the force.
NormalLaw of_function(Numbers parameters, std::uintptr_t force, nb::object of_force,
                      std::uintptr_t energy, nb::object of_energy) {
  FunctionLaw law;
  LawForce own(force, std::move(of_force));
  law.potential = LawIntegral(own);
  if (!of_energy.is_none()) law.potential = LawEnergy(energy, std::move(of_energy));
  law.function = std::move(own);
  law.parameters = std::move(parameters);
  return {std::move(law)};
}

FrictionLaw friction_of_function(Numbers parameters, std::uintptr_t force, nb::object of_force) {
  FunctionFriction law;
  law.function = LawForce(force, std::move(of_force));
  law.parameters = std::move(parameters);
  return {std::move(law)};
}

// A fault of a user's function, as the package's own error.
void translate_fault(const std::exception_ptr& thrown, void*) {
  try {
    std::rethrow_exception(thrown);
  } catch (const OwnFunction::Fault& fault) {
    const nb::object type = nb::module_::import_("sphshell_pin.errors").attr("SphshellError");
    PyErr_SetString(type.ptr(), fault.what());
  }
}

}  // namespace

void bind_contact(nb::module_& m) {
  nb::register_exception_translator(translate_fault);
  bind_family<NormalLaw>(m, "NormalLaw", slots<NormalLaw>())
      .def_static("of_function", &of_function, "parameters"_a, "force"_a, "of_force"_a, "energy"_a,
                  "of_energy"_a.none())
      .def_prop_ro("needs_rate", &NormalLaw::needs_rate)
      .def("force",
           [](const NormalLaw& law, double depth, double gap_rate) {
             return depth > 0 ? law.force(depth, gap_rate).total : 0.0;
           })
      // By the depth, at rest: from a dual number.
      .def("stiffness",
           [](const NormalLaw& law, double depth) {
             using S = Dual<1>;
             return depth > 0 ? law.force(S::seed(depth, 0), S(0)).elastic.slope[0] : 0.0;
           })
      .def("energy",
           [](const NormalLaw& law, double depth) { return depth > 0 ? law.energy(depth) : 0.0; });
  // The same for friction; no friction is null in Python.
  bind_family<FrictionLaw>(m, "FrictionLaw", slots<FrictionLaw>())
      .def_static("of_function", &friction_of_function)
      .def_prop_ro("has_state", &FrictionLaw::has_state)
      .def_prop_ro("torsional", &FrictionLaw::torsional)
      .def("coefficient", &FrictionLaw::coefficient, "speed"_a, "load"_a = 1.0);
  m.def("contact_moduli", [](const Numbers& materials) {
    // E*, 8 G* and 16/3 G of sphere and shell [Pa].
    Materials both{};
    Materials::each(both, NumberReader{materials});
    return nb::make_tuple(both.modulus(), both.shear(), both.twist());
  });
  m.def(
      "contact_force",
      [](const NormalLaw& law, const FrictionLaw* friction, double depth, const Vec3& normal,
         const Vec3& relative, double spin, const Vec3& rolling, const Vec3& bristle, double radius,
         double relaxation) {
        // Both laws at one contact, without a scene: force, friction, moment, rate of the bristle.
        const ContactKinematics<double> kinematics{depth, normal, relative, spin, bristle, rolling};
        const ContactForce<double> f = contact_force(law, friction ? *friction : FrictionLaw(),
                                                     radius, relaxation, kinematics);
        const Vec3 moment = f.torsion * normal + f.rolling;
        return nb::make_tuple(f.normal, f.friction, moment, f.bristle_rate);
      },
      "law"_a, "friction"_a.none(), "depth"_a, "normal"_a, "relative"_a, "spin"_a, "rolling"_a,
      "bristle"_a, "radius"_a, "relaxation"_a);
}
