// Tangential force of one contact, and both forces together.
#pragma once

#include <Eigen/Geometry>

#include "contact/laws.hpp"

namespace sphshell {

// What acts on the sphere at a contact.
template <class S>
struct ContactForce {
  S normal = S(0), elastic = S(0);               // along the normal [N]; its elastic part
  Vector3<S> friction = Vector3<S>::Zero();      // [N]
  S torsion = S(0);                              // moment about the normal [N m]
  Vector3<S> bristle = Vector3<S>::Zero();       // its stretch, brought back to the cone [m]
  Vector3<S> bristle_rate = Vector3<S>::Zero();  // but for its turning with the normal [m/s]
  Vector3<S> slip = Vector3<S>::Zero();          // of the sphere against the shell [m/s]
};

// x, or the nearest to it in the ball.
template <class S>
Vector3<S> in_ball(const Vector3<S>& x, const S& radius) {
  using std::sqrt;
  // In a ball of no size the slopes are zero as well, even where x is.
  if (!(radius > 0)) return Vector3<S>::Zero();
  const S length2 = x.squaredNorm();
  if (length2 <= radius * radius) return x;
  return x * (radius / sqrt(length2));
}

// The state of a contact. relative: velocity of the sphere's body against the shell's at the
// contact point [m/s]; spin: of their relative angular velocity along the normal [rad/s].
template <class S>
struct ContactKinematics {
  S depth;
  Vector3<S> normal, relative;
  S spin = S(0);
  Vector3<S> bristle = Vector3<S>::Zero();  // [m]
  S scale = S(0);                           // of the gap, for Hertz's law [m^0.5]
};

// The friction laws. Each has its name, its parameters, and
// - coefficient: of steady sliding at a slip speed [m/s];
// - add: writes friction, torsion and the bristle's rates to the force at a contact. `radius` [m]
//   is that of the sphere, `relaxation` [s] that of the bristles.

struct NoFriction {
  static constexpr const char* kind = "none";
  explicit NoFriction(const Numbers&) {}

  double coefficient(double) const { return 0; }

  template <class S>
  void add(ContactForce<S>&, const ContactKinematics<S>&, double, double) const {}
};

// ADAMS's Coulomb friction, regularized over two slip speeds: it creeps.
struct CoulombFriction {
  static constexpr const char* kind = "coulomb";
  double mu_static, mu_dynamic, v_static, v_dynamic;  // 1, 1, [m/s], [m/s]

  explicit CoulombFriction(const Numbers& p)
      : mu_static(p.at(0)), mu_dynamic(p.at(1)), v_static(p.at(2)), v_dynamic(p.at(3)) {}

  // coefficient / slip speed [s/m]: finite at rest, so that no direction is divided by zero.
  template <class S>
  S over_speed(const S& speed2) const {
    using std::sqrt;
    if (speed2 < v_static * v_static)
      return mu_static * (3 - speed2 / (v_static * v_static)) / (2 * v_static);
    const S speed = sqrt(speed2);
    return step(speed, v_static, mu_static, v_dynamic, mu_dynamic) / speed;
  }

  double coefficient(double speed) const { return speed * over_speed(speed * speed); }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>&, double, double) const {
    out.friction = -out.normal * over_speed(S(out.slip.squaredNorm())) * out.slip;
  }
};

// An elastic, perfectly plastic spring between sphere and shell (Dupont et al. 2002; Stribeck's
// curve), whose stretch is a state z of the contact, in the shell's frame:
//
//   force = -P(stiffness z + damping w),   z' = w - (z - P(stiffness z) / stiffness) / relaxation,
//
// with w the slip and P the projection on the ball of radius mu N: below that load nothing creeps.
// Beyond it z relaxes in a time that is short against the motion, but not zero: the rates stay
// bounded where the normal force is small. For a soft finger the component of z along the normal is
// the twist of the disc of contact, on the arm rho = 3 pi / 16 a of Hertz's pressure: the moment's
// limit is mu N rho, and P couples it with the force as in Howe and Cutkosky's limit surface
// (1996).
struct BristleFriction {
  static constexpr const char* kind = "bristle";
  double mu_static, mu_dynamic, stiffness, damping, v_stribeck;  // 1, 1, [N/m], [N s/m], [m/s]
  bool torsional;

  explicit BristleFriction(const Numbers& p)
      : mu_static(p.at(0)),
        mu_dynamic(p.at(1)),
        stiffness(p.at(2)),
        damping(p.at(3)),
        v_stribeck(p.at(4)),
        torsional(p.at(5) != 0) {}

  template <class S>
  S stribeck(const S& speed2) const {
    using std::exp;
    return mu_dynamic + (mu_static - mu_dynamic) * exp(-speed2 / (v_stribeck * v_stribeck));
  }

  double coefficient(double speed) const { return stribeck(speed * speed); }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>& m, double radius,
           double relaxation) const {
    using std::sqrt;
    Vector3<S> w = out.slip;
    S arm(0);
    if (torsional) {
      arm = 3 * M_PI / 16 * sqrt(radius * m.depth);
      w += arm * m.spin * m.normal;
    }
    const S limit = stribeck(S(w.squaredNorm())) * out.normal;
    Vector3<S> z = m.bristle;
    if (!torsional) z -= z.dot(m.normal) * m.normal;
    const Vector3<S> stretched = stiffness * z;
    out.bristle = in_ball(stretched, limit) / stiffness;
    out.bristle_rate = w - (z - out.bristle) / relaxation;
    const Vector3<S> all = -in_ball(Vector3<S>(stretched + damping * w), limit);
    const S along = all.dot(m.normal);
    out.friction = all - along * m.normal;
    out.torsion = arm * along;
  }
};

// One of the friction laws.
struct FrictionLaw {
  std::variant<NoFriction, CoulombFriction, BristleFriction> law = NoFriction({});

  bool active() const { return !std::holds_alternative<NoFriction>(law); }
  // Of the contacts that have a stretch for a state, else null.
  const BristleFriction* bristle() const { return std::get_if<BristleFriction>(&law); }
  bool has_state() const { return bristle() != nullptr; }
  bool torsional() const { return bristle() && bristle()->torsional; }

  double coefficient(double speed) const {
    return std::visit([&](const auto& one) { return one.coefficient(speed); }, law);
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
  return -f.friction.dot(f.slip) - f.torsion * m.spin;
}

}  // namespace sphshell
