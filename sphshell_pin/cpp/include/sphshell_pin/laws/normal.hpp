// The normal laws: their parameters (namespace sphshell_pin), and the force of one contact from
// depth and gap rate, as the core computes it. Equations and how to choose the parameters:
// docs/laws.md.
#pragma once

#include <functional>
#include <sstream>

#include "sphshell_pin/laws/table.hpp"

namespace sphshell_pin {

/// ADAMS's IMPACT: max(0, stiffness depth^exponent - STEP(depth, damping) gap_rate).
struct ImpactLaw {
  static constexpr const char* kind = "impact";
  double stiffness;                  ///< > 0 [N/m^exponent]
  double exponent = 1.5;             ///< > 0
  double damping = 0;                ///< >= 0 [N s/m]
  double full_damping_depth = 1e-4;  ///< > 0 [m]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("stiffness", law.stiffness, Bounds::positive("N/m^exponent"));
    visit("exponent", law.exponent, Bounds::positive());
    visit("damping", law.damping, Bounds::not_negative("N s/m"));
    visit("full_damping_depth", law.full_damping_depth, Bounds::positive("m"));
  }
};

/// Hunt and Crossley: max(0, stiffness depth^exponent (1 - dissipation gap_rate)).
struct HuntCrossleyLaw {
  static constexpr const char* kind = "hunt-crossley";
  double stiffness;        ///< > 0 [N/m^exponent]
  double exponent = 1.5;   ///< > 0
  double dissipation = 0;  ///< >= 0 [s/m]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("stiffness", law.stiffness, Bounds::positive("N/m^exponent"));
    visit("exponent", law.exponent, Bounds::positive());
    visit("dissipation", law.dissipation, Bounds::not_negative("s/m"));
  }
};

/// Hertz's law: its stiffness follows the curvatures of sphere and shell at each contact.
struct HertzLaw {
  static constexpr const char* kind = "hertz";
  Materials materials;
  double dissipation = 0;      ///< b of Hunt and Crossley, >= 0 [s/m]
  double relaxation_time = 0;  ///< of a viscoelastic material, >= 0 [s]
  double radius = 0;           ///< > 0: of a sphere on a plane, whatever it touches [m]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    Materials::each(law.materials, visit);
    visit("dissipation", law.dissipation, Bounds::not_negative("s/m"));
    visit("relaxation_time", law.relaxation_time, Bounds::not_negative("s"));
    visit("radius", law.radius, Bounds::not_negative("m"));
  }
};

/// An elastic layer on the sphere, pressed wherever it overlaps the body behind the shell; with the
/// methods Facets and Smooth.
struct FoundationLaw {
  static constexpr const char* kind = "foundation";
  double modulus;          ///< > 0 [Pa]
  double thickness;        ///< > 0 [m]
  double dissipation = 0;  ///< >= 0 [s/m]
  double radius = 0;       ///< > 0: of a sphere on a plane, whatever it touches [m]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("modulus", law.modulus, Bounds::positive("Pa"));
    visit("thickness", law.thickness, Bounds::positive("m"));
    visit("dissipation", law.dissipation, Bounds::not_negative("s/m"));
    visit("radius", law.radius, Bounds::not_negative("m"));
  }
};

}  // namespace sphshell_pin

namespace sphshell {

// The laws as the core computes them. Each has its Parameters, and
// - force: a template, as dual numbers give its slopes; at depth > 0 [m] and gap_rate = n . v_rel
// [m/s], negative while closing, and for Hertz's law the scale of the gap, see Hertz [m^0.5];
// - energy: the potential of the elastic part [J], by the depth and that scale;
// - needs_rate: whether the force depends on gap_rate.

// What the laws have in common whose spring is k depth^e.
template <class Stated>
struct PowerLaw : Stated {
  using Parameters = Stated;
  explicit PowerLaw(const Parameters& p) : Parameters(p) {}

  template <class S>
  S elastic(const S& depth) const {
    return this->stiffness * power(depth, this->exponent);
  }
  double energy(double depth, double) const {
    return elastic(depth) * depth / (this->exponent + 1);
  }
};

// max(0, k depth^e - STEP(depth, 0, 0, d, c) gap_rate)
struct ImpactLaw : PowerLaw<sphshell_pin::ImpactLaw> {
  using PowerLaw::PowerLaw;

  bool needs_rate() const { return damping > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S&) const {
    const S spring = elastic(depth);
    if (!needs_rate()) return {spring, spring};
    return push(S(spring - step(depth, 0, 0, full_damping_depth, damping) * gap_rate), spring);
  }
};

// max(0, k depth^e (1 - b gap_rate))
struct HuntCrossleyLaw : PowerLaw<sphshell_pin::HuntCrossleyLaw> {
  using PowerLaw::PowerLaw;

  bool needs_rate() const { return dissipation > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S&) const {
    const S spring = elastic(depth);
    if (!needs_rate()) return {spring, spring};
    return push(S(spring - spring * dissipation * gap_rate), spring);
  }
};

// Hertz's force between a sphere and whatever it touches, E* scale depth^1.5, with the damping of
// Hunt and Crossley (1 - b gap_rate), or that of a viscoelastic material that relaxes in a time
// tau, 1.5 tau E* scale depth^0.5 gap_rate (Kuwabara and Kono, Jpn. J. Appl. Phys. 26 (1987) 1230).
struct HertzLaw : sphshell_pin::HertzLaw {
  using Parameters = sphshell_pin::HertzLaw;
  double modulus;      // E* [Pa]
  double fixed_scale;  // whatever it touches; 0: that of the gap [m^0.5]

  // 4/3 sqrt(R): the scale of a sphere of that radius on a plane.
  explicit HertzLaw(const Parameters& p)
      : Parameters(p), modulus(materials.modulus()), fixed_scale(4.0 / 3 * std::sqrt(radius)) {}

  bool needs_rate() const { return dissipation > 0 || relaxation_time > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S& scale) const {
    using std::sqrt;
    const S used = fixed_scale > 0 ? S(fixed_scale) : scale;
    const S root = modulus * used * sqrt(depth), elastic = root * depth;
    if (!needs_rate()) return {elastic, elastic};
    return push(S(elastic - (elastic * dissipation + 1.5 * relaxation_time * root) * gap_rate),
                elastic);
  }

  double energy(double depth, double scale) const {
    const double used = fixed_scale > 0 ? fixed_scale : scale;
    return 0.4 * modulus * used * depth * depth * std::sqrt(depth);
  }
};

// The elastic foundation of contact/laws/foundation.hpp; with a radius that of a ball on a plane,
// where the depth is all that counts.
struct FoundationLaw : sphshell_pin::FoundationLaw {
  using Parameters = sphshell_pin::FoundationLaw;
  explicit FoundationLaw(const Parameters& p) : Parameters(p) {}

  bool needs_rate() const { return dissipation > 0; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S&) const {
    // Integral of kappa (R^2 - rho^2) / (2 rho) over the plane's disc: kappa times the volume of
    // the cap.
    const S elastic = modulus / thickness * M_PI * depth * depth * (radius - depth / 3);
    if (!needs_rate()) return {elastic, elastic};
    return push(S(elastic - elastic * dissipation * gap_rate), elastic);
  }

  double energy(double depth, double) const {
    return modulus / thickness * M_PI * depth * depth * depth * (radius / 3 - depth / 12);
  }
};

// A user's function of two numbers, which is known by its values alone.
struct OwnFunction {
  static constexpr double kStep = 1e-4;  // relative

  // What returned a number that is not finite.
  struct Fault : std::runtime_error {
    using std::runtime_error::runtime_error;
  };

  std::function<double(double, double, const double*)> function;  // [N]
  Numbers parameters;

  // Differences of fourth order: they agree with the slopes of smooth functions to about 1e-11.
  template <class Function>
  static double slope(const Function& f, double x, double h) {
    return (8 * (f(x + h) - f(x - h)) - (f(x + 2 * h) - f(x - 2 * h))) / (12 * h);
  }

  // `what` of which law it is, and of which numbers.
  static double finite(double value, const char* what, const char* first, double x,
                       const char* second, double y) {
    if (std::isfinite(value)) return value;
    std::ostringstream said;
    said << "the " << what << " is " << value << " at " << first << ' ' << x << ", " << second
         << ' ' << y << ": its function must return finite numbers";
    throw Fault(said.str());
  }
};

// Of depth [m] and gap rate [m/s]; its elastic part is that at rest.
struct FunctionLaw : OwnFunction {
  using Parameters = void;  // a user's functions, see bindings/bind_contact.cpp
  static constexpr const char* kind = "function";
  static constexpr double kLeastRate = 1e-2;  // over which slopes are taken at rest [m/s]

  std::function<double(double, const double*)> potential;  // [J]

  bool needs_rate() const { return true; }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S&) const {
    if constexpr (std::is_same_v<S, double>) {
      const double elastic = at(depth, 0);
      return push(gap_rate == 0 ? elastic : at(depth, gap_rate), elastic);
    } else {
      // The chain rule by hand: a user's function takes doubles only.
      const double d = depth.value, rate = gap_rate.value;
      const auto by_depth = [&](double r) {
        return slope([&](double x) { return at(x, r); }, d, kStep * d);
      };
      const double by_rate = slope([&](double r) { return at(d, r); }, rate,
                                   kStep * std::max(std::abs(rate), kLeastRate));
      return push(S(at(d, rate), by_depth(rate) * depth.slope + by_rate * gap_rate.slope),
                  S(at(d, 0), by_depth(0) * depth.slope));
    }
  }

  double energy(double depth, double) const {
    return checked(potential(depth, parameters.data()), "energy of a FunctionLaw", depth, 0);
  }

 private:
  // Calls the user's function, and checks what it returns.
  double at(double depth, double gap_rate) const {
    return checked(function(depth, gap_rate, parameters.data()), "force of a FunctionLaw", depth,
                   gap_rate);
  }

  static double checked(double value, const char* what, double depth, double gap_rate) {
    return finite(value, what, "depth [m]", depth, "gap rate [m/s]", gap_rate);
  }
};

// One of the laws.
struct NormalLaw {
  std::variant<ImpactLaw, HuntCrossleyLaw, HertzLaw, TableLaw, FoundationLaw, FunctionLaw> law =
      ImpactLaw({0, 1});

  bool needs_rate() const {
    return std::visit([](const auto& one) { return one.needs_rate(); }, law);
  }
  // Of a force that follows the shape of the gap, else null.
  const HertzLaw* hertz() const {
    const HertzLaw* one = std::get_if<HertzLaw>(&law);
    return one && one->fixed_scale == 0 ? one : nullptr;
  }
  // Of a force that is an integral over the overlap, else null.
  const FoundationLaw* foundation() const {
    const FoundationLaw* one = std::get_if<FoundationLaw>(&law);
    return one && one->radius == 0 ? one : nullptr;
  }

  template <class S>
  NormalForce<S> force(const S& depth, const S& gap_rate, const S& scale = S(0)) const {
    return std::visit([&](const auto& one) { return one.force(depth, gap_rate, scale); }, law);
  }

  double energy(double depth, double scale = 0) const {
    return std::visit([&](const auto& one) { return one.energy(depth, scale); }, law);
  }
};

}  // namespace sphshell
