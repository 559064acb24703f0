// Errors of sphshell_pin.errors, raised from here.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/stl/string.h>

#include <string>

namespace sphshell {

namespace nb = nanobind;
using namespace nb::literals;

template <class... Args>
[[noreturn]] void raise_own(const char* error, const Args&... args) {
  const nb::object value = nb::module_::import_("sphshell_pin.errors").attr(error)(args...);
  PyErr_SetObject(value.type().ptr(), value.ptr());
  throw nb::python_error();
}

// What comes past the Python face is not checked; a wrong size would be read beyond its end.
inline void check_count(const char* name, std::size_t given, std::size_t needed) {
  if (given == needed) return;
  raise_own("InvalidParameter", name, given, "must have shape (" + std::to_string(needed) + ",)",
            "has shape (" + std::to_string(given) + ",),");
}

}  // namespace sphshell
