// What the library throws.
#pragma once

#include <stdexcept>
#include <string>

#if defined(__GNUC__)
#define SPHSHELL_PIN_API __attribute__((visibility("default")))
#else
#define SPHSHELL_PIN_API
#endif

namespace sphshell_pin {

/// Base of all errors of this library; what() is one sentence that says what to do.
class SPHSHELL_PIN_API Error : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
  ~Error() override;
};

/// A value outside its limits.
class SPHSHELL_PIN_API InvalidParameter : public Error {
 public:
  /// The text is "NAME = VALUE MUST", for instance "radius = -1 must be positive [m]".
  InvalidParameter(const std::string& name, const std::string& value, const std::string& must);
  ~InvalidParameter() override;
  const std::string& name() const { return name_; }

 private:
  std::string name_;
};

/// Vertices or elements of which no surface can be made; the text names the vertex or element.
class SPHSHELL_PIN_API InvalidShell : public Error {
 public:
  using Error::Error;
  ~InvalidShell() override;
};

/// A frame that the model does not have; the text lists the frames.
class SPHSHELL_PIN_API FrameNotFound : public Error {
 public:
  using Error::Error;
  ~FrameNotFound() override;
};

}  // namespace sphshell_pin
