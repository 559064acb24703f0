// Errors of sphshell_pin.errors, raised from here; Busy where two would use one thing at a time.
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

// Of something with one state: who comes while a call is under way, from another thread or from a
// routine that this call has called, gets errors.Busy. The interpreter's lock guards the fields.
class OneUser {
 public:
  explicit OneUser(std::string what) : what_(std::move(what)) {}
  OneUser(const OneUser&) = delete;
  OneUser& operator=(const OneUser&) = delete;

  void enter(const char* doing) {
    if (in_) raise_own("Busy", what_, doing_, thread_);
    in_ = true;
    doing_ = doing;
    thread_ = PyThread_get_thread_ident();
  }
  void leave() { in_ = false; }

 private:
  const std::string what_;
  std::string doing_;
  unsigned long thread_ = 0;
  bool in_ = false;
};

// Holds the object as long as it lives.
class Use {
 public:
  Use(OneUser& user, const char* doing) : user_(user) { user_.enter(doing); }
  ~Use() { user_.leave(); }
  Use(const Use&) = delete;
  Use& operator=(const Use&) = delete;

 private:
  OneUser& user_;
};

}  // namespace sphshell
