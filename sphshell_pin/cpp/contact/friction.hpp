// Tangential force of one contact, and both forces together.
#pragma once

#include <Eigen/Geometry>

#include "contact/laws.hpp"

namespace sphshell {

// Two laws. TwoVelocity is ADAMS's regularised Coulomb friction: it creeps. Bristle is an elastic,
// perfectly plastic spring between sphere and shell (Dupont et al. 2002; Stribeck's curve), whose
// stretch is a state z of the contact, in the shell's frame:
//
//   force = -P(stiffness z + damping w),   z' = w - (z - P(stiffness z) / stiffness) / relaxation,
//
// with w the slip and P the projection on the ball of radius mu N: below that load nothing creeps.
// Beyond it z relaxes in a time that is short against the motion, but not zero: the rates stay
// bounded where the normal force is small. For a soft finger the component of z along the normal is
// the twist of the disc of contact, on the arm rho = 3 pi / 16 a of Hertz's pressure: the moment's
// limit is mu N rho, and P couples it with the force as in Howe and Cutkosky's limit surface
// (1996).
struct FrictionLaw {
  enum class Kind : int { None = 0, TwoVelocity = 1, Bristle = 2 };
  Kind kind = Kind::None;
  double mu_static = 0, mu_dynamic = 0;
  double v_static = 1, v_dynamic = 2;  // [m/s]; of the bristle v_static is Stribeck's speed
  double stiffness = 0, damping = 0;   // of the bristle [N/m], [N s/m]
  bool torsional = false;

  bool active() const { return kind != Kind::None; }
  bool has_state() const { return kind == Kind::Bristle; }

  // coefficient / slip speed [s/m] of TwoVelocity: finite at rest, so that no direction is
  // divided by zero.
  template <class S>
  S over_speed(const S& speed2) const {
    using std::sqrt;
    if (speed2 < v_static * v_static)
      return mu_static * (3 - speed2 / (v_static * v_static)) / (2 * v_static);
    const S speed = sqrt(speed2);
    return step(speed, v_static, mu_static, v_dynamic, mu_dynamic) / speed;
  }

  // coefficient of Bristle.
  template <class S>
  S stribeck(const S& speed2) const {
    using std::exp;
    return mu_dynamic + (mu_static - mu_dynamic) * exp(-speed2 / (v_static * v_static));
  }

  double coefficient(double speed) const {
    return kind == Kind::Bristle ? stribeck(speed * speed) : speed * over_speed(speed * speed);
  }
};

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

// Where and how the two bodies meet. relative: velocity of the sphere's body against the shell's at
// the contact point [m/s]; spin: along the normal of their relative angular velocity [rad/s].
template <class S>
struct Meeting {
  S depth;
  Vector3<S> normal, relative;
  S spin = S(0);
  Vector3<S> bristle = Vector3<S>::Zero();  // [m]
};

template <class S>
ContactForce<S> contact_force(const NormalLaw& law, const FrictionLaw& friction, double radius,
                              double relaxation, const Meeting<S>& m) {
  using std::sqrt;
  ContactForce<S> out;
  const S gap_rate = m.normal.dot(m.relative);
  const NormalForce<S> push = law.force(m.depth, gap_rate);
  out.normal = push.total;
  out.elastic = push.elastic;
  out.slip = m.relative - gap_rate * m.normal;
  if (friction.kind == FrictionLaw::Kind::TwoVelocity) {
    const S speed2 = out.slip.squaredNorm();
    out.friction = -push.total * friction.over_speed(speed2) * out.slip;
  } else if (friction.kind == FrictionLaw::Kind::Bristle) {
    Vector3<S> w = out.slip;
    S arm(0);
    if (friction.torsional) {
      arm = 3 * M_PI / 16 * sqrt(radius * m.depth);
      w += arm * m.spin * m.normal;
    }
    const S limit = friction.stribeck(S(w.squaredNorm())) * push.total;
    Vector3<S> z = m.bristle;
    if (!friction.torsional) z -= z.dot(m.normal) * m.normal;
    const Vector3<S> stretched = friction.stiffness * z;
    out.bristle = in_ball(stretched, limit) / friction.stiffness;
    out.bristle_rate = w - (z - out.bristle) / relaxation;
    const Vector3<S> all = -in_ball(Vector3<S>(stretched + friction.damping * w), limit);
    const S along = all.dot(m.normal);
    out.friction = all - along * m.normal;
    out.torsion = arm * along;
  }
  return out;
}

// Power lost by the normal damping, and that of friction, which bristles partly store [W].
inline double damping_power(const ContactForce<double>& f, const Meeting<double>& m) {
  return -(f.normal - f.elastic) * m.normal.dot(m.relative);
}
inline double friction_power(const ContactForce<double>& f, const Meeting<double>& m) {
  return -f.friction.dot(f.slip) - f.torsion * m.spin;
}

}  // namespace sphshell
