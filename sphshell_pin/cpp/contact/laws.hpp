// Normal force of one contact, from depth and gap rate. Templated, so that automatic
// differentiation gives the slopes of what the simulation runs.
#pragma once

#include <cmath>
#include <variant>

#include <Eigen/Core>

#include "contact/kinds.hpp"

namespace sphshell {

using Vec3 = Eigen::Vector3d;
template <class S>
using Vector3 = Eigen::Matrix<S, 3, 1>;

// STEP of ADAMS: a cubic from h0 at x0 to h1 at x1, constant outside.
template <class S>
S step(const S& x, double x0, double h0, double x1, double h1) {
  if (x <= x0) return S(h0);
  if (x >= x1) return S(h1);
  const S u = (x - x0) / (x1 - x0);
  return h0 + (h1 - h0) * u * u * (3 - 2 * u);
}

template <class S>
S power(const S& x, double exponent) {
  using std::pow, std::sqrt;
  if (exponent == 1) return x;
  if (exponent == 1.5) return x * sqrt(x);
  if (exponent == 2) return x * x;
  return pow(x, exponent);
}

template <class S>
struct NormalForce {
  S total;    // >= 0 [N]
  S elastic;  // its part that derives from the potential [N]
};

template <class S>
NormalForce<S> push(const S& total, const S& elastic) {
  return {total < 0 ? S(0) : total, elastic};
}

// The laws. Each has its name, its parameters, and:
//   force   at depth > 0 [m] and gap_rate = n . v_rel [m/s], negative while closing;
//   energy  potential of the elastic part [J];
//   needs_rate  whether the force depends on gap_rate.

// max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate)
struct ImpactLaw {
  static constexpr const char* kind = "impact";
  double stiffness, exponent, damping, full_damping_depth;  // [N/m^e], 1, [N s/m], [m]

  explicit ImpactLaw(const Numbers& p)
      : stiffness(p.at(0)), exponent(p.at(1)), damping(p.at(2)), full_damping_depth(p.at(3)) {}

  bool needs_rate() const { return damping > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate) const {
    const S elastic = stiffness * power(depth, exponent);
    if (!needs_rate()) return {elastic, elastic};
    return push(S(elastic - step(depth, 0, 0, full_damping_depth, damping) * gap_rate), elastic);
  }

  double energy(double depth) const {
    return stiffness * power(depth, exponent) * depth / (exponent + 1);
  }
};

// max(0, k depth^e (1 - b gap_rate))
struct HuntCrossleyLaw {
  static constexpr const char* kind = "hunt-crossley";
  double stiffness, exponent, dissipation;  // [N/m^e], 1, [s/m]

  explicit HuntCrossleyLaw(const Numbers& p)
      : stiffness(p.at(0)), exponent(p.at(1)), dissipation(p.at(2)) {}

  bool needs_rate() const { return dissipation > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate) const {
    const S elastic = stiffness * power(depth, exponent);
    if (!needs_rate()) return {elastic, elastic};
    return push(S(elastic - elastic * dissipation * gap_rate), elastic);
  }

  double energy(double depth) const {
    return stiffness * power(depth, exponent) * depth / (exponent + 1);
  }
};

// One of the laws.
struct NormalLaw {
  std::variant<ImpactLaw, HuntCrossleyLaw> law = ImpactLaw({0, 1, 0, 1});

  bool needs_rate() const {
    return std::visit([](const auto& one) { return one.needs_rate(); }, law);
  }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate) const {
    return std::visit([&](const auto& one) { return one.force(depth, gap_rate); }, law);
  }

  double energy(double depth) const {
    return std::visit([&](const auto& one) { return one.energy(depth); }, law);
  }
};

}  // namespace sphshell
