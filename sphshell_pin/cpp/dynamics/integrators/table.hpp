// Integration methods by the names that scenarios give them.
#pragma once

#include <string_view>

#include "dynamics/integrators/stepper.hpp"

namespace sphshell {

// Throws std::invalid_argument, which lists the names, for any other.
std::unique_ptr<Stepper> make_stepper(std::string_view integrator, SceneData& scene);

}  // namespace sphshell
