// Checks that say where they fail, in any build type.
#pragma once

#include <sphshell_pin/errors.hpp>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#define CHECK(condition) check((condition), #condition, __FILE__, __LINE__)
#define CHECK_NEAR(a, b, tolerance) \
  check(std::abs((a) - (b)) <= (tolerance), #a " = " #b, __FILE__, __LINE__)
#define CHECK_THROWS(Error, text, ...) \
  check_throws<Error>([&] { __VA_ARGS__; }, text, __FILE__, __LINE__)

inline void check(bool holds, const char* what, const char* file, int line) {
  if (holds) return;
  std::fprintf(stderr, "%s:%d: %s does not hold\n", file, line, what);
  std::exit(1);
}

// `text` is part of the message.
template <class Error, class Call>
void check_throws(Call&& call, const std::string& text, const char* file, int line) {
  std::string message = "nothing was thrown";
  try {
    call();
  } catch (const Error& error) {
    message = error.what();
    if (message.find(text) != std::string::npos) return;
  } catch (const std::exception& error) {
    message = std::string("another type: ") + error.what();
  }
  std::fprintf(stderr, "%s:%d: wanted '%s', got '%s'\n", file, line, text.c_str(), message.c_str());
  std::exit(1);
}
