// Friction that sticks: springs between sphere and shell, whose stretch is a state of the contact.
#pragma once

#include <algorithm>
#include <array>

#include "sphshell_pin/laws/contact_force.hpp"
#include "sphshell_pin/laws/parameters.hpp"

namespace sphshell_pin {

/// Friction that sticks: an elastic, perfectly plastic spring, whose stretch is a state of the
/// contact; see SceneState::advance.
struct BristleFriction {
  static constexpr const char* kind = "bristle";
  double mu_static;          ///< >= 0
  double mu_dynamic;         ///< >= 0, not above mu_static
  double stiffness;          ///< > 0 [N/m]
  double damping = 0;        ///< >= 0 [N s/m]
  double v_stribeck = 0.01;  ///< > 0 [m/s]
  bool torsional = false;    ///< also against spin about the normal, as a soft finger

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("mu_static", law.mu_static, Bounds::not_negative());
    visit("mu_dynamic", law.mu_dynamic,
          Bounds::not_negative().not_above("mu_static", law.mu_static));
    visit("stiffness", law.stiffness, Bounds::positive("N/m"));
    visit("damping", law.damping, Bounds::not_negative("N s/m"));
    visit("v_stribeck", law.v_stribeck, Bounds::positive("m/s"));
    visit("torsional", law.torsional, Bounds{});
  }
};

/// The same with the stiffness of two elastic bodies, after Mindlin.
struct MindlinFriction {
  static constexpr const char* kind = "mindlin";
  static constexpr int kMostRings = 8;
  double mu_static;   ///< >= 0
  double mu_dynamic;  ///< >= 0, not above mu_static
  Materials materials;
  double v_stribeck = 0.01;     ///< > 0 [m/s]
  double damping_time = 0;      ///< >= 0 [s]
  bool torsional = false;       ///< also against spin about the normal
  double rolling = 0;           ///< >= 0, moment against rolling over radius and normal force
  double rolling_speed = 1e-3;  ///< > 0 [m/s]
  int rings = 1;                ///< 1 to 8, of the disc of contact; each sticks or slips for itself

  template <class Law, class Visit>
  static void each(Law& law, Visit&& visit) {
    visit("mu_static", law.mu_static, Bounds::not_negative());
    visit("mu_dynamic", law.mu_dynamic,
          Bounds::not_negative().not_above("mu_static", law.mu_static));
    Materials::each(law.materials, visit);
    visit("v_stribeck", law.v_stribeck, Bounds::positive("m/s"));
    visit("damping_time", law.damping_time, Bounds::not_negative("s"));
    visit("torsional", law.torsional, Bounds{});
    visit("rolling", law.rolling, Bounds::not_negative());
    visit("rolling_speed", law.rolling_speed, Bounds::positive("m/s"));
    visit("rings", law.rings, Bounds{"", -Bounds::kNone, 1, kMostRings});
  }
};

}  // namespace sphshell_pin

namespace sphshell {

// What the laws have in common whose bristles stick below a limit.
struct Sticking {
  double mu_static, mu_dynamic, v_stribeck;  // 1, 1, [m/s]
  bool torsional;
  int rings = 1;  // each with a state of three numbers

  // Stribeck's curve.
  template <class S>
  S stribeck(const S& speed2) const {
    using std::exp;
    return mu_dynamic + (mu_static - mu_dynamic) * exp(-speed2 / (v_stribeck * v_stribeck));
  }

  double coefficient(double speed, double) const { return stribeck(speed * speed); }

  // Radius of the disc of contact; on an ellipse of Hertz's law, that of the disc of the same
  // normal stiffness.
  template <class S>
  static S disc(const ContactKinematics<S>& m, double radius) {
    using std::sqrt;
    return m.scale > 0 ? S(0.75 * m.scale * sqrt(m.depth)) : S(sqrt(radius * m.depth));
  }

  // On which a spin about the normal is a slip, for a disc of contact of radius a.
  template <class S>
  static S arm_of(const S& a) {
    return 3 * M_PI / 16 * a;
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
struct BristleFriction : Sticking {
  using Parameters = sphshell_pin::BristleFriction;
  static constexpr const char* kind = Parameters::kind;
  double stiffness, damping;  // [N/m], [N s/m]

  explicit BristleFriction(const Parameters& p)
      : Sticking{p.mu_static, p.mu_dynamic, p.v_stribeck, p.torsional},
        stiffness(p.stiffness),
        damping(p.damping) {}

  double stretch(const Vec3& z, const Vec3&, double) const { return z.norm(); }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>& m, double radius,
           double relaxation) const {
    Vector3<S> w = out.slip;
    S arm(0);
    if (torsional) {
      arm = arm_of(disc(m, radius));
      w += arm * m.spin * m.normal;
    }
    // mu(|w|) N [N].
    const S limit = stribeck(S(w.squaredNorm())) * out.normal;
    Vector3<S> z = m.bristle;
    if (!torsional) z -= z.dot(m.normal) * m.normal;
    const Vector3<S> stretched = stiffness * z;
    out.stiffness = stiffness;
    // What the bristle can hold elastically; the rest relaxes.
    const Vector3<S> held = in_ball(stretched, limit) / stiffness;
    out.stretch2 = held.squaredNorm();
    out.bristle_rate = w - (z - held) / relaxation;
    const Vector3<S> all = -in_ball(Vector3<S>(stretched + damping * w), limit);
    const S along = all.dot(m.normal);
    out.friction = all - along * m.normal;
    // Along the normal the force on the arm is a moment.
    out.torsion = arm * along;
  }
};

// Most rings of a bristle, for arrays of fixed size.
inline constexpr int kMostRings = sphshell_pin::MindlinFriction::kMostRings;

// The same with the stiffness of two elastic bodies that touch on a disc of radius a (Mindlin, J.
// Appl. Mech. 16 (1949) 259; Johnson 1985, ch. 7): 8 G* a against slip, 16/3 G a^3 against spin.
// It grows with the disc, whose new rim carries nothing, so force and moment are kept while
// the bodies close and fall with the stiffness while they part: dF = k dw + F dk / k for dk < 0.
// The state is therefore not the stretch but the force over 8 G* x 1 m, and along the normal the
// moment over 8 G* x 1 m^2, of a contact that has lost nothing: regular at the touch, where a is
// zero. Beyond the limit both give way in the direction of the force, as maximal dissipation
// demands.
//
// With several rings each sticks or slips for itself, as in Mindlin's theory. By the method of
// dimensionality reduction (Popov and Hess 2015) the disc is a row of independent springs at x in
// (0, a), of stiffness 8 G* dx, 16 G x^2 dx and of a limit in proportion to (a^2 - x^2) dx. A ring
// holds those between two shares of a; its limit of the moment is that of Hertz's pressure between
// them. Where the shares move over the springs they pass from ring
// to ring with the mean stretch of the ring that they leave: the upwind scheme of finite volumes,
// in which one ring is the law above, and which cannot gain energy, as a mean stretch holds less.
struct MindlinFriction : Sticking {
  using Parameters = sphshell_pin::MindlinFriction;
  static constexpr const char* kind = Parameters::kind;
  double shear, twist;            // 8 G*, 16/3 G [Pa]
  double damping_time;            // of a damper beside the spring, over its stiffness [s]
  double rolling, rolling_speed;  // 1, [m/s]
  struct Ring {
    double inner, rim;    // of a
    double width, limit;  // of the disc's
    double cube, arm;     // of the disc's stiffness against spin, of its arm
  };
  std::array<Ring, kMostRings> parts;

  explicit MindlinFriction(const Parameters& p)
      : Sticking{p.mu_static, p.mu_dynamic, p.v_stribeck, p.torsional, p.rings},
        shear(p.materials.shear()),
        twist(p.materials.twist()),
        damping_time(p.damping_time),
        rolling(p.rolling),
        rolling_speed(p.rolling_speed) {
    // Of the moment of Hertz's pressure within r, over that of all of it.
    const auto moment = [](double r) {
      return (std::asin(r) - r * (1 - 2 * r * r) * std::sqrt(1 - r * r)) / M_PI_2;
    };
    for (int i = 0; i < rings; ++i) {
      const double inner = double(i) / rings, rim = double(i + 1) / rings;
      const double width = rim - inner, cube = rim * rim * rim - inner * inner * inner;
      const double limit = 1.5 * (width - cube / 3);
      parts[i] = {inner, rim, width, limit, cube, (moment(rim) - moment(inner)) / limit};
    }
  }

  double stretch(const Vec3& z, const Vec3& normal, double stiffness) const {
    const double a = stiffness / shear, along = z.dot(normal);
    const Vec3 across = z - along * normal;
    if (!torsional) return across.norm() / a;
    return std::hypot(across.norm(), along / arm_of(a)) / a;
  }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>& m, double radius,
           double relaxation) const {
    if (rolling > 0) add_rolling(out, m, radius);
    const S a = disc(m, radius);
    if (!(a > 0)) return;
    const Vector3<S>& n = m.normal;
    // a ~ sqrt(depth), so a' / a = depth' / (2 depth), and depth' = -n . v.
    const S growth = -0.5 * n.dot(m.relative) / m.depth;  // a' / a
    const S disc_arm = torsional ? arm_of(a) : S(0);
    const S speed2 = out.slip.squaredNorm() + (disc_arm * m.spin) * (disc_arm * m.spin);
    const S limit = stribeck(speed2) * out.normal;
    out.stiffness = shear * a;

    // A force, its part along the normal on an arm, times two factors.
    const auto scaled = [&](const Vector3<S>& x, const S& across, const S& along) -> Vector3<S> {
      const Vector3<S> part = x.dot(n) * n;
      return across * (x - part) + along * part;
    };
    // Rates are accumulated, as a ring gives its neighbors what passes over the common edge.
    if (m.outer_rate) std::fill_n(m.outer_rate, rings - 1, Vector3<S>::Zero());
    for (int i = 0; i < rings; ++i) {
      const Ring& part = parts[i];
      const S arm = part.arm * disc_arm, most = part.limit * limit;
      Vector3<S> w = out.slip;
      if (torsional) w += arm * m.spin * n;
      const Vector3<S> z = i == 0 ? m.bristle : m.outer ? m.outer[i - 1] : Vector3<S>::Zero();
      const Vector3<S> load = scaled(z, S(shear), torsional ? S(shear / arm) : S(0));
      const Vector3<S> held = in_ball(load, most);
      // Over a, across the normal and, on the arm, along it.
      const double unit_arm = part.arm * arm_of(1.0);
      const double k = shear * part.width, k_along = twist * part.cube / (unit_arm * unit_arm);
      out.stretch2 += scaled(held, S(1 / k), S(1 / k_along)).dot(held) / (shear * a * a);

      // Relaxation with the stiffer direction's rate in both, so that neither is faster than asked
      // for.
      const double stiffest = torsional ? std::max(k, k_along) : k;
      const Vector3<S> slip = a * w - (load - held) / (stiffest * relaxation);
      rate(out, m, i) += scaled(slip, S(part.width), S(arm * (k_along / shear)));
      // What leaves the ring over the edge that moves into it.
      const bool grows = growth > 0;
      const double edge = grows ? part.inner : part.rim;
      if (edge > 0) {
        const S g = (grows ? growth : S(-growth)) / shear;
        const Vector3<S> left = scaled(held, S(g * (edge / part.width)),
                                       S(g * arm * (3 * edge * edge * edge / part.cube)));
        rate(out, m, i) -= left;
        if (grows || i + 1 < rings) rate(out, m, grows ? i - 1 : i + 1) += left;
      }
      Vector3<S> damped = load;
      if (damping_time > 0)
        damped += scaled(w, S(k * damping_time * a), S(k_along * damping_time * a));
      const Vector3<S> all = -in_ball(damped, most);
      const S along = all.dot(n);
      out.friction += all - along * n;
      out.torsion += arm * along;
    }
  }

  template <class S>
  static Vector3<S>& rate(ContactForce<S>& out, const ContactKinematics<S>& m, int ring) {
    return ring == 0 || !m.outer_rate ? out.bristle_rate : m.outer_rate[ring - 1];
  }

  // Of the moment rolling x radius x N, regularized at a slow speed of rolling: it creeps.
  template <class S>
  void add_rolling(ContactForce<S>& out, const ContactKinematics<S>& m, double radius) const {
    using std::sqrt;
    // That of a ball on a plane with the same disc of contact.
    const S r = m.scale > 0 ? S(0.5625 * m.scale * m.scale) : S(radius);
    const S x2 = m.rolling.squaredNorm() * (r * r / (rolling_speed * rolling_speed));
    const S share = x2 < 1 ? S((3 - x2) / 2) : S(1 / sqrt(x2));
    out.rolling = -(rolling / rolling_speed) * r * r * out.normal * share * m.rolling;
  }
};

}  // namespace sphshell
