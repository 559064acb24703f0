// One user at a time.
#pragma once

#include <string>
#include <utility>

#include "bindings/own_errors.hpp"

namespace sphshell {

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
