#include "dynamics/integrators/explicit.hpp"
#include "dynamics/integrators/implicit.hpp"

namespace sphshell {

template <class Method>
static std::unique_ptr<Stepper> make(SceneData& scene) {
  // Implicit methods linearize the scene and are made for it.
  if constexpr (std::is_constructible_v<Method, SceneData&>)
    return std::make_unique<Method>(scene);
  else
    return std::make_unique<Method>();
}

// A new method is its class and one line here, and a class of that kind in Python.
static constexpr std::pair<const char*, std::unique_ptr<Stepper> (*)(SceneData&)> kMethods[] = {
    {"semi-implicit-euler", make<SemiImplicitEuler>},
    {"runge-kutta-4", make<RungeKutta4>},
    {"adaptive", make<DormandPrince>},
    {"linearly-implicit-euler", make<LinearlyImplicitEuler>},
    {"implicit", make<Rodas>},
};

std::unique_ptr<Stepper> make_stepper(std::string_view integrator, SceneData& scene) {
  std::string names;
  for (const auto& [name, make_one] : kMethods) {
    if (name == integrator) return make_one(scene);
    names += (names.empty() ? "" : ", ") + std::string(name);
  }
  throw std::invalid_argument("integrator '" + std::string(integrator) +
                              "' does not exist; the table has: " + names);
}

}  // namespace sphshell
