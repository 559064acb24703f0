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

// The method called `name`, or null, with the names of all.
template <class... Methods>
static std::unique_ptr<Stepper> find(std::string_view name, SceneData& scene, std::string& names,
                                     const std::tuple<Methods...>*) {
  std::unique_ptr<Stepper> out;
  const auto look = [&](auto make_one, const char* kind) {
    if (kind == name) out = make_one(scene);
    names += (names.empty() ? "" : ", ") + std::string(kind);
  };
  (look(make<Methods>, Methods::kind), ...);
  return out;
}

std::unique_ptr<Stepper> make_stepper(std::string_view integrator, SceneData& scene) {
  using All =
      decltype(std::tuple_cat(std::declval<ExplicitMethods>(), std::declval<ImplicitMethods>()));
  std::string names;
  if (auto found = find(integrator, scene, names, static_cast<const All*>(nullptr))) return found;
  throw std::invalid_argument("integrator '" + std::string(integrator) +
                              "' does not exist; the table has: " + names);
}

}  // namespace sphshell
