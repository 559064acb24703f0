// Checks of what users of the library hand over, as sphshell_pin/base/checks.py has them for
// Python.
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "sphshell_pin/errors.hpp"

namespace sphshell_pin {

// The shortest text that reads as the same number.
inline std::string shown(double x) {
  char text[32];
  for (int digits = 1; digits <= 17; ++digits) {
    std::snprintf(text, sizeof text, "%.*g", digits, x);
    if (std::strtod(text, nullptr) == x) break;
  }
  // A whole number without its exponent.
  if (std::abs(x) >= 1 && std::abs(x) < 1e15 && std::string(text).find('e') != std::string::npos)
    std::snprintf(text, sizeof text, "%.0f", x);
  return text;
}

template <class Vector>
std::string shown_all(const Vector& x) {
  std::string out;
  for (Eigen::Index i = 0; i < x.size(); ++i) out += (i ? ", " : "[") + shown(x[i]);
  return out + "]";
}

inline double check_finite(const std::string& name, double x) {
  if (!std::isfinite(x)) throw InvalidParameter(name, shown(x), "must be finite");
  return x;
}

// `unit` as in " [m]", or empty.
inline double check_positive(const std::string& name, double x, const std::string& unit) {
  if (!(check_finite(name, x) > 0))
    throw InvalidParameter(name, shown(x), "must be positive" + unit);
  return x;
}

inline double check_not_negative(const std::string& name, double x, const std::string& unit) {
  if (check_finite(name, x) < 0)
    throw InvalidParameter(name, shown(x), "must not be negative" + unit);
  return x;
}

inline void check_point(const std::string& name, const Eigen::Vector3d& x) {
  if (!x.allFinite()) throw InvalidParameter(name, shown_all(x), "must be finite");
}

}  // namespace sphshell_pin
