#include "dynamics/integrators/table.hpp"

#include <stdexcept>
#include <string>
#include <type_traits>

#include "dynamics/integrators/explicit.hpp"
#include "dynamics/integrators/implicit.hpp"

namespace sphshell {
namespace {

template <class Method>
std::unique_ptr<Stepper> make(SceneData& scene) {
  // Implicit methods linearize the scene and are made for it.
  if constexpr (std::is_constructible_v<Method, SceneData&>)
    return std::make_unique<Method>(scene);
  else
    return std::make_unique<Method>();
}

struct Entry {
  std::string_view name;
  std::unique_ptr<Stepper> (*make)(SceneData&);
};

// A new method is one line here, and the class of that name in dynamics/run/integrators.py.
constexpr Entry kIntegrators[] = {
    {"semi-implicit-euler", make<SemiImplicitEuler>},
    {"runge-kutta-4", make<RungeKutta4>},
    {"linearly-implicit-euler", make<LinearlyImplicitEuler>},
    {"adaptive", make<DormandPrince>},
    {"implicit", make<Rodas>},
};

}  // namespace

std::unique_ptr<Stepper> make_stepper(std::string_view integrator, SceneData& scene) {
  std::string names;
  for (const Entry& entry : kIntegrators) {
    if (entry.name == integrator) return entry.make(scene);
    names += (names.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw std::invalid_argument("integrator '" + std::string(integrator) +
                              "' does not exist; the table has: " + names);
}

}  // namespace sphshell
