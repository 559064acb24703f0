// Contact laws: the normal force from the depth, friction from the slip. Their equations and how to
// choose the parameters are in docs/laws.md; names, units and defaults are those of Python.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "sphshell_pin/errors.hpp"

namespace sphshell_pin {

/// ADAMS's IMPACT: max(0, stiffness depth^exponent - STEP(depth, damping) gap_rate).
struct ImpactLaw {
  double stiffness;                  ///< > 0 [N/m^exponent]
  double exponent = 1.5;             ///< > 0
  double damping = 0;                ///< >= 0 [N s/m]
  double full_damping_depth = 1e-4;  ///< > 0 [m]
};

/// Hunt and Crossley: max(0, stiffness depth^exponent (1 - dissipation gap_rate)).
struct HuntCrossleyLaw {
  double stiffness;        ///< > 0 [N/m^exponent]
  double exponent = 1.5;   ///< > 0
  double dissipation = 0;  ///< >= 0 [s/m]
};

/// Elastic materials of the sphere, and of the shell where it has another one.
struct Materials {
  double young;                          ///< Young's modulus of the sphere, > 0 [Pa]
  double poisson;                        ///< Poisson's ratio, in (-1, 0.5]
  std::optional<double> young_2 = {};    ///< of the shell, with poisson_2
  std::optional<double> poisson_2 = {};  ///< of the shell

  /// E* [Pa]: 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2.
  SPHSHELL_PIN_API double modulus() const;
};

/// Hertz's law: its stiffness follows the curvatures of sphere and shell at each contact.
struct HertzLaw {
  Materials materials;
  double dissipation = 0;      ///< b of Hunt and Crossley, >= 0 [s/m]
  double relaxation_time = 0;  ///< of a viscoelastic material, >= 0 [s]
  double radius = 0;           ///< > 0: of a sphere on a plane, whatever it touches [m]
};

/// Elastic, from a table: depths and forces start at zero and increase.
struct TableLaw {
  std::vector<double> depth;  ///< (k >= 2) [m]
  std::vector<double> force;  ///< (k) [N]
};

/// An elastic layer on the sphere, pressed wherever it overlaps the body behind the shell; with the
/// methods Facets and Smooth.
struct FoundationLaw {
  double modulus;          ///< > 0 [Pa]
  double thickness;        ///< > 0 [m]
  double dissipation = 0;  ///< >= 0 [s/m]
};

/// One of the laws, checked.
class SPHSHELL_PIN_API NormalLaw {
 public:
  /// @throws InvalidParameter on a number that is not finite or outside its bounds
  NormalLaw(const ImpactLaw& law);
  NormalLaw(const HuntCrossleyLaw& law);
  NormalLaw(const HertzLaw& law);
  NormalLaw(const TableLaw& law);
  NormalLaw(const FoundationLaw& law);
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

  struct Impl;
  /// For the library itself.
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

/// A frictionless contact.
struct NoFriction {};

/// ADAMS's Coulomb friction, regularized over two slip speeds: a loaded contact creeps.
struct CoulombFriction {
  double mu_static = 0.3;   ///< >= 0, at v_static
  double mu_dynamic = 0.1;  ///< >= 0, not above mu_static
  double v_static = 0.1;    ///< > 0 [m/s]
  double v_dynamic = 1.0;   ///< > v_static [m/s]
};

/// Friction that sticks: an elastic, perfectly plastic spring, whose stretch is a state of the
/// contact; see SceneState::advance.
struct BristleFriction {
  double mu_static;          ///< >= 0
  double mu_dynamic;         ///< >= 0, not above mu_static
  double stiffness;          ///< > 0 [N/m]
  double damping = 0;        ///< >= 0 [N s/m]
  double v_stribeck = 0.01;  ///< > 0 [m/s]
  bool torsional = false;    ///< also against spin about the normal, as a soft finger
};

/// The same with the stiffness of two elastic bodies, after Mindlin.
struct MindlinFriction {
  double mu_static;   ///< >= 0
  double mu_dynamic;  ///< >= 0, not above mu_static
  Materials materials;
  double v_stribeck = 0.01;     ///< > 0 [m/s]
  double damping_time = 0;      ///< >= 0 [s]
  bool torsional = false;       ///< also against spin about the normal
  double rolling = 0;           ///< >= 0, moment against rolling over radius and normal force
  double rolling_speed = 1e-3;  ///< > 0 [m/s]
  int rings = 1;                ///< 1 to 8, of the disc of contact; each sticks or slips for itself
};

/// One of the friction laws, checked.
class SPHSHELL_PIN_API FrictionLaw {
 public:
  /// @throws InvalidParameter on a number that is not finite or outside its bounds
  FrictionLaw(const NoFriction& law = {});
  FrictionLaw(const CoulombFriction& law);
  FrictionLaw(const BristleFriction& law);
  FrictionLaw(const MindlinFriction& law);
  // A move is a copy, as of a Shell.
  FrictionLaw(const FrictionLaw&) = default;
  FrictionLaw& operator=(const FrictionLaw&) = default;

  /// Whether contacts have a stretch for a state.
  bool has_state() const;
  /// The coefficient of steady sliding.
  /// @param slip_speed >= 0 [m/s]
  /// @throws InvalidParameter on a speed that is negative or not finite
  double coefficient(double slip_speed) const;

  struct Impl;
  /// For the library itself.
  const Impl& impl() const { return *impl_; }

 private:
  std::shared_ptr<const Impl> impl_;
};

}  // namespace sphshell_pin
