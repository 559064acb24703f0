#include "sphshell_pin/errors.hpp"

namespace sphshell_pin {

// Here, so that each error has one type in all libraries and programs.
Error::~Error() = default;
InvalidParameter::~InvalidParameter() = default;
InvalidShell::~InvalidShell() = default;
FrameNotFound::~FrameNotFound() = default;

InvalidParameter::InvalidParameter(const std::string& name, const std::string& value,
                                   const std::string& must)
    : Error(name + " = " + value + " " + must), name_(name) {}

}  // namespace sphshell_pin
