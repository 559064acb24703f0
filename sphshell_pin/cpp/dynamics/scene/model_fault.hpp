#pragma once

#include <optional>
#include <pinocchio/multibody.hpp>
#include <string>

namespace sphshell {

// As errors say it: "NAME = VALUE MUST".
struct ModelFault {
  std::string name, value, must;
};

// What is wrong with a model that Pinocchio's algorithms would not survive, as they read and write
// without a check: joints that are not in the order parents first, lists of different lengths,
// inertias, placements or gravity that are not finite, indices out of range.
std::optional<ModelFault> model_fault(const pinocchio::Model& model);

}  // namespace sphshell
