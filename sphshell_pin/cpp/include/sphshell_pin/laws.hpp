// Contact laws: the normal force from the depth, friction from the slip. Their equations and how to
// choose the parameters are in docs/laws.md; names, units and defaults are those of Python. The
// laws themselves: laws/normal.hpp and laws/friction.hpp.
#pragma once

#include "sphshell_pin/errors.hpp"
#include "sphshell_pin/laws/friction.hpp"

namespace sphshell_pin {

/// Raises InvalidParameter for a parameter that is not finite or outside its bounds.
struct SPHSHELL_PIN_API BoundsCheck {
  void operator()(const char* name, double value, const Bounds& bounds) const;
  void operator()(const char* name, int value, const Bounds& bounds) const;
  void operator()(const char* name, const std::vector<double>& column, const Bounds& bounds) const;
  void operator()(const char*, bool, const Bounds&) const {}
  void operator()(const char* name, const std::optional<double>& value, const Bounds& b) const {
    if (value) (*this)(name, *value, b);
  }
};

/// Returns the core's law of these parameters, checked.
template <class Family, class Law>
Family checked_law(const Law& law) {
  Law::each(law, BoundsCheck());
  return {sphshell::Kinds<decltype(Family::law)>::from(law)};
}

/// One of the laws, checked.
class SPHSHELL_PIN_API NormalLaw {
 public:
  /// Of ImpactLaw, HuntCrossleyLaw, HertzLaw, TableLaw or FoundationLaw.
  /// @throws InvalidParameter on a number that is not finite or outside its bounds
  template <class Law, class = decltype(Law::kind)>
  NormalLaw(const Law& law) : law_(checked_law<sphshell::NormalLaw>(law)) {}
  // A move is a copy, as of a Shell.
  NormalLaw(const NormalLaw&) = default;
  NormalLaw& operator=(const NormalLaw&) = default;

  /// The force [N] at a depth [m], 0 where that is not positive.
  /// @param gap_rate [m/s], negative while closing
  /// @throws InvalidParameter of laws that follow the shape of what is touched, and on numbers that
  ///         are not finite
  double force(double depth, double gap_rate = 0) const;
  /// The potential of the elastic part [J]; throws as force() does.
  double energy(double depth) const;

  /// For the library itself.
  const sphshell::NormalLaw& core() const { return law_; }

 private:
  sphshell::NormalLaw law_;
};

/// One of the friction laws, checked.
class SPHSHELL_PIN_API FrictionLaw {
 public:
  FrictionLaw() = default;
  /// Of NoFriction, CoulombFriction, BristleFriction or MindlinFriction.
  /// @throws InvalidParameter on a number that is not finite or outside its bounds
  template <class Law, class = decltype(Law::kind)>
  FrictionLaw(const Law& law) : law_(checked_law<sphshell::FrictionLaw>(law)) {}
  // A move is a copy, as of a Shell.
  FrictionLaw(const FrictionLaw&) = default;
  FrictionLaw& operator=(const FrictionLaw&) = default;

  /// Whether contacts have a stretch for a state.
  bool has_state() const { return law_.has_state(); }
  /// The coefficient of steady sliding.
  /// @param slip_speed >= 0 [m/s]
  /// @throws InvalidParameter on a speed that is negative or not finite
  double coefficient(double slip_speed) const;

  /// For the library itself.
  const sphshell::FrictionLaw& core() const { return law_; }

 private:
  sphshell::FrictionLaw law_;
};

}  // namespace sphshell_pin
