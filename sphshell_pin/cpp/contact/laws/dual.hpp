// Numbers that carry their derivatives along: a law written for any scalar gives its slopes.
#pragma once

#include <cmath>

#include <Eigen/Core>

namespace sphshell {

// A value and its derivatives with respect to N seeds. No expression templates, so that the laws
// need not know about them.
template <int N>
struct Dual {
  using Slope = Eigen::Array<double, N, 1>;
  double value;
  Slope slope;

  Dual(double x = 0) : value(x), slope(Slope::Zero()) {}
  Dual(double x, const Slope& s) : value(x), slope(s) {}
  // The variable number i itself.
  static Dual seed(double x, int i) {
    Dual out(x);
    out.slope[i] = 1;
    return out;
  }

  Dual& operator+=(const Dual& b) { return *this = *this + b; }
  Dual& operator-=(const Dual& b) { return *this = *this - b; }
  Dual& operator*=(const Dual& b) { return *this = *this * b; }
  Dual& operator/=(const Dual& b) { return *this = *this / b; }

  friend Dual operator-(const Dual& a) { return {-a.value, -a.slope}; }
  friend Dual operator+(const Dual& a, const Dual& b) {
    return {a.value + b.value, a.slope + b.slope};
  }
  friend Dual operator-(const Dual& a, const Dual& b) {
    return {a.value - b.value, a.slope - b.slope};
  }
  friend Dual operator*(const Dual& a, const Dual& b) {
    return {a.value * b.value, a.value * b.slope + b.value * a.slope};
  }
  // (a / b)' = (a' - (a / b) b') / b: one division of values.
  friend Dual operator/(const Dual& a, const Dual& b) {
    const double ratio = a.value / b.value;
    return {ratio, (a.slope - ratio * b.slope) / b.value};
  }
  // With constants, which are most of what a law multiplies by.
  friend Dual operator+(const Dual& a, double b) { return {a.value + b, a.slope}; }
  friend Dual operator+(double a, const Dual& b) { return {a + b.value, b.slope}; }
  friend Dual operator-(const Dual& a, double b) { return {a.value - b, a.slope}; }
  friend Dual operator-(double a, const Dual& b) { return {a - b.value, -b.slope}; }
  friend Dual operator*(const Dual& a, double b) { return {a.value * b, a.slope * b}; }
  friend Dual operator*(double a, const Dual& b) { return {a * b.value, a * b.slope}; }
  friend Dual operator/(const Dual& a, double b) { return {a.value / b, a.slope / b}; }

  // Branches of a law are decided by values: at a kink the derivative is that of the branch taken.
  friend bool operator<(const Dual& a, const Dual& b) { return a.value < b.value; }
  friend bool operator>(const Dual& a, const Dual& b) { return a.value > b.value; }
  friend bool operator<=(const Dual& a, const Dual& b) { return a.value <= b.value; }
  friend bool operator>=(const Dual& a, const Dual& b) { return a.value >= b.value; }

  // At zero, where the slope is infinite, the laws have a length that is zero whatever the seeds.
  friend Dual sqrt(const Dual& x) {
    if (x.value == 0) return Dual();
    const double root = std::sqrt(x.value);
    return {root, x.slope * (0.5 / root)};
  }
  friend Dual exp(const Dual& x) {
    const double value = std::exp(x.value);
    return {value, x.slope * value};
  }
  friend Dual pow(const Dual& x, double exponent) {
    return {std::pow(x.value, exponent), x.slope * (exponent * std::pow(x.value, exponent - 1))};
  }
};

}  // namespace sphshell

namespace Eigen {

// What Eigen asks of a scalar type, so that vectors and matrices of duals work.
template <int N>
struct NumTraits<sphshell::Dual<N>> : NumTraits<double> {
  using Real = sphshell::Dual<N>;
  using NonInteger = sphshell::Dual<N>;
  using Nested = sphshell::Dual<N>;
  enum { RequireInitialization = 1, ReadCost = N + 1, AddCost = N + 1, MulCost = 3 * N };
};

template <int N, class Operation>
struct ScalarBinaryOpTraits<double, sphshell::Dual<N>, Operation> {
  using ReturnType = sphshell::Dual<N>;
};
template <int N, class Operation>
struct ScalarBinaryOpTraits<sphshell::Dual<N>, double, Operation> {
  using ReturnType = sphshell::Dual<N>;
};

}  // namespace Eigen
