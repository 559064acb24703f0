// The friction laws: their parameters (namespace sphshell_pin), the tangential force of one
// contact, and both forces together.
#pragma once

#include "sphshell_pin/laws/bristle.hpp"
#include "sphshell_pin/laws/normal.hpp"

namespace sphshell_pin {

/// A frictionless contact.
struct NoFriction {
  static constexpr const char* kind = "none";

  template <class Law, class Visit>
  static void each(Law&, Visit&&) {}
};

/// ADAMS's Coulomb friction, regularized over two slip speeds: a loaded contact creeps.
struct CoulombFriction {
  static constexpr const char* kind = "coulomb";
  double mu_static = 0.3;   ///< >= 0, at v_static
  double mu_dynamic = 0.1;  ///< >= 0, not above mu_static
  double v_static = 0.1;    ///< > 0 [m/s]
  double v_dynamic = 1.0;   ///< > v_static [m/s]

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("mu_static", law.mu_static, Bounds::not_negative());
    visit("mu_dynamic", law.mu_dynamic,
          Bounds::not_negative().not_above("mu_static", law.mu_static));
    visit("v_static", law.v_static, Bounds::positive("m/s"));
    visit("v_dynamic", law.v_dynamic, Bounds::positive("m/s").more_than("v_static", law.v_static));
  }
};

}  // namespace sphshell_pin

namespace sphshell {

// The friction laws as the core computes them. Each has its Parameters, and
// - coefficient: of steady sliding at a slip speed [m/s] under a load [N];
// - add: writes friction, torsion and the bristle's rates to the force at a contact. `radius` [m]
//   is that of the sphere, `relaxation` [s] that of the bristles.
// Those that stick derive from Sticking, and have besides
// - stretch: length of the stretch [m] that a state z of the bristle (or its error) is, all three
// in
//   one frame, where the bristle has this stiffness [N/m].

struct NoFriction : sphshell_pin::NoFriction {
  using Parameters = sphshell_pin::NoFriction;
  explicit NoFriction(const Parameters&) {}

  double coefficient(double, double) const { return 0; }

  template <class S>
  void add(ContactForce<S>&, const ContactKinematics<S>&, double, double) const {}
};

// ADAMS's Coulomb friction, regularized over two slip speeds: it creeps.
struct CoulombFriction : sphshell_pin::CoulombFriction {
  using Parameters = sphshell_pin::CoulombFriction;
  explicit CoulombFriction(const Parameters& p) : Parameters(p) {}

  // coefficient / slip speed [s/m]: finite at rest, so that no direction is divided by zero.
  template <class S>
  S over_speed(const S& speed2) const {
    using std::sqrt;
    // A cubic that rises from zero with a horizontal tangent at v_static, divided by the speed.
    if (speed2 < v_static * v_static)
      return mu_static * (3 - speed2 / (v_static * v_static)) / (2 * v_static);
    const S speed = sqrt(speed2);
    return step(speed, v_static, mu_static, v_dynamic, mu_dynamic) / speed;
  }

  double coefficient(double speed, double) const { return speed * over_speed(speed * speed); }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>&, double, double) const {
    out.friction = -out.normal * over_speed(S(out.slip.squaredNorm())) * out.slip;
  }
};

// Of slip speed [m/s] and normal force [N], against the slip: it creeps. Negative values count as
// zero.
struct FunctionFriction : OwnFunction {
  using Parameters = void;  // a user's function, see bindings/bind_contact.cpp
  static constexpr const char* kind = "function";
  static constexpr double kLeast = 1e-6;  // a slower slip bears a force in proportion [m/s]

  double coefficient(double speed, double load) const {
    return speed * over_speed(speed, load) / load;
  }

  // The force over the slip speed [N s/m].
  double over_speed(double speed, double normal) const {
    const double taken = std::max(speed, kLeast);
    const double force = function(taken, normal, parameters.data());
    finite(force, "force of a FunctionFriction", "slip speed [m/s]", taken, "normal force [N]",
           normal);
    return std::max(0.0, force) / taken;
  }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>&, double, double) const {
    using std::sqrt;
    if constexpr (std::is_same_v<S, double>) {
      out.friction = -over_speed(out.slip.norm(), out.normal) * out.slip;
    } else {
      // The chain rule by hand: a user's function takes doubles only.
      const S speed2 = out.slip.squaredNorm();
      const double s = sqrt(speed2.value), n = out.normal.value;
      S over(over_speed(s, n));
      if (n > 0)
        over.slope +=
            slope([&](double x) { return over_speed(s, x); }, n, kStep * n) * out.normal.slope;
      if (s > kLeast)
        over.slope += slope([&](double x) { return over_speed(x, n); }, s, kStep * s) / (2 * s) *
                      speed2.slope;
      out.friction = -over * out.slip;
    }
  }
};

// One of the friction laws.
struct FrictionLaw {
  std::variant<NoFriction, CoulombFriction, BristleFriction, MindlinFriction, FunctionFriction>
      law = NoFriction({});

  bool active() const { return !std::holds_alternative<NoFriction>(law); }
  // What the contacts that have a stretch for a state have in common, else null.
  const Sticking* sticking() const {
    return std::visit(
        [](const auto& one) -> const Sticking* {
          if constexpr (std::is_base_of_v<Sticking, std::decay_t<decltype(one)>>) return &one;
          return nullptr;
        },
        law);
  }
  bool has_state() const { return sticking() != nullptr; }
  bool torsional() const { return has_state() && sticking()->torsional; }
  // States of a contact, of three numbers each.
  int rings() const { return has_state() ? sticking()->rings : 1; }
  // Whether it resists rolling.
  bool rolls() const {
    const MindlinFriction* mindlin = std::get_if<MindlinFriction>(&law);
    return mindlin && mindlin->rolling > 0;
  }
  // See the laws; zero where there is no bristle [m].
  double stretch(const Vec3& z, const Vec3& normal, double stiffness) const {
    return std::visit(
        [&](const auto& one) {
          if constexpr (std::is_base_of_v<Sticking, std::decay_t<decltype(one)>>)
            return one.stretch(z, normal, stiffness);
          return 0.0;
        },
        law);
  }

  // The load [N] counts for a user's function alone.
  double coefficient(double speed, double load = 1) const {
    return std::visit([&](const auto& one) { return one.coefficient(speed, load); }, law);
  }
};

template <class S>
ContactForce<S> contact_force(const NormalLaw& law, const FrictionLaw& friction, double radius,
                              double relaxation, const ContactKinematics<S>& m) {
  ContactForce<S> out;
  const S gap_rate = m.normal.dot(m.relative);
  const NormalForce<S> push = law.force(m.depth, gap_rate, m.scale);
  out.normal = push.total;
  out.elastic = push.elastic;
  out.slip = m.relative - gap_rate * m.normal;
  std::visit([&](const auto& one) { one.add(out, m, radius, relaxation); }, friction.law);
  return out;
}

// Power lost by the normal damping, and that of friction, which bristles partly store [W].
inline double damping_power(const ContactForce<double>& f, const ContactKinematics<double>& m) {
  return -(f.normal - f.elastic) * m.normal.dot(m.relative);
}
inline double friction_power(const ContactForce<double>& f, const ContactKinematics<double>& m) {
  return -f.friction.dot(f.slip) - f.torsion * m.spin - f.rolling.dot(m.rolling);
}

}  // namespace sphshell
