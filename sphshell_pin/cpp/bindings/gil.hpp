// The interpreter's lock, in threads that may be alive when the interpreter ends.
//
// A daemon thread that wants the lock by then is ended by Python (up to 3.13) with pthread_exit,
// which unwinds its stack; on its way through C++ that is std::terminate. Here the thread sleeps
// instead until the process is gone, as Python 3.14 has it.
#pragma once

#include "bindings/own_errors.hpp"

#include <chrono>
#include <stdexcept>
#include <thread>
#include <utility>

namespace sphshell {

[[noreturn]] inline void sleep_for_ever() {
  for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
}

// `wait` calls C functions of Python that may wait for the lock: what unwinds through them is
// pthread_exit.
template <class Wait>
auto or_sleep(Wait&& wait) noexcept {
  try {
    return wait();
  } catch (...) {
    sleep_for_ever();
  }
}

// Lets other threads of Python run while C++ computes.
class ReleaseGil {
 public:
  ReleaseGil() noexcept : state_(PyEval_SaveThread()) {}
  ~ReleaseGil() {
    or_sleep([this] { PyEval_RestoreThread(state_); });
  }
  ReleaseGil(const ReleaseGil&) = delete;
  ReleaseGil& operator=(const ReleaseGil&) = delete;

 private:
  PyThreadState* state_;
};

// In any thread, and where the lock is held already.
class AcquireGil {
 public:
  AcquireGil() noexcept {
    const bool known = PyGILState_GetThisThreadState() != nullptr;
    if (known && PyGILState_Check()) return;
    // A thread that Python does not know has no state to ask for once the interpreter ends.
    if (!known && !Py_IsInitialized()) sleep_for_ever();
    state_ = or_sleep([] { return PyGILState_Ensure(); });
    taken_ = true;
    is_foreign_ = !known;
  }
  ~AcquireGil() {
    if (taken_) PyGILState_Release(state_);
  }
  AcquireGil(const AcquireGil&) = delete;
  AcquireGil& operator=(const AcquireGil&) = delete;

  // Calls a user's routine with the tuple (a new reference) that make_arguments() returns. In a
  // thread of the core's own what it raises becomes a std::runtime_error with its text, as no
  // Python object may leave the lock's scope there.
  template <class MakeArguments>
  nb::object call(nb::handle routine, MakeArguments&& make_arguments) const {
    PyObject* answer = or_sleep([&]() -> PyObject* {
      PyObject* arguments = make_arguments();
      if (!arguments) return nullptr;
      PyObject* out = PyObject_Call(routine.ptr(), arguments, nullptr);
      Py_DECREF(arguments);
      return out;
    });
    if (answer) return nb::steal(answer);
    const nb::python_error error;
    if (is_foreign_) throw std::runtime_error(error.what());
    throw error;
  }

 private:
  PyGILState_STATE state_ = PyGILState_UNLOCKED;
  bool taken_ = false, is_foreign_ = false;
};

}  // namespace sphshell
