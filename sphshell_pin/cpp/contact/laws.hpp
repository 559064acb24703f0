// Normal force of one contact, from depth and gap rate. Templated, so that automatic
// differentiation gives the slopes of what the simulation runs.
#pragma once

#include <cmath>

#include <Eigen/Core>

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

// IMPACT: max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate);
// Hunt-Crossley: max(0, k depth^e (1 - b gap_rate)).
struct NormalLaw {
  enum class Kind : int { Impact = 0, HuntCrossley = 1 };
  Kind kind = Kind::Impact;
  double stiffness = 0;           // k [N/m^e]
  double exponent = 1;            // e
  double damping = 0;             // c [N s/m], or b [s/m]
  double full_damping_depth = 1;  // d [m], IMPACT only

  bool needs_rate() const { return damping > 0; }

  // depth > 0 [m]; gap_rate = n . v_rel [m/s], negative while closing.
  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate) const {
    const S elastic = stiffness * power(depth, exponent);
    if (!needs_rate()) return {elastic, elastic};
    S total = elastic;
    if (kind == Kind::Impact)
      total -= step(depth, 0, 0, full_damping_depth, damping) * gap_rate;
    else
      total -= elastic * damping * gap_rate;
    if (total < 0) total = S(0);
    return {total, elastic};
  }

  // Potential of the elastic part [J].
  double energy(double depth) const {
    return stiffness * power(depth, exponent) * depth / (exponent + 1);
  }
};

}  // namespace sphshell
