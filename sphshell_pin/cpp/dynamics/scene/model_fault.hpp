#pragma once

#include <pinocchio/multibody.hpp>
#include <string>

namespace sphshell {

// Says what is wrong with the indices of a model, with which Pinocchio's algorithms read and write
// without a check; empty if nothing is. Its lists must have one entry per joint, parents first.
std::string model_fault(const pinocchio::Model& model);

}  // namespace sphshell
