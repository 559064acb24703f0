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
  Vector3<S> rolling = Vector3<S>::Zero();       // moment against rolling [N m]
  S stiffness = S(0);                            // of the bristle along the surface [N/m]
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
// contact point [m/s]; of their relative angular velocity [rad/s] spin is the part along the
// normal, rolling the rest, for the laws that resist it.
template <class S>
struct ContactKinematics {
  S depth;
  Vector3<S> normal, relative;
  S spin = S(0);
  Vector3<S> bristle = Vector3<S>::Zero();  // [m]
  Vector3<S> rolling = Vector3<S>::Zero();
};

// The friction laws. Each has its name, its parameters, and
// - coefficient: of steady sliding at a slip speed [m/s];
// - add: writes friction, torsion and the bristle's rates to the force at a contact. `radius` [m]
//   is that of the sphere, `relaxation` [s] that of the bristles.
// Those that stick derive from Sticking, and have besides
// - stretch: length of the stretch [m] that a state z of the bristle (or its error) is, all three
// in
//   one frame, where the bristle has this stiffness [N/m].

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

// What the laws have in common whose bristles stick below a limit.
struct Sticking {
  double mu_static, mu_dynamic, v_stribeck;  // 1, 1, [m/s]
  bool torsional;

  // Stribeck's curve.
  template <class S>
  S stribeck(const S& speed2) const {
    using std::exp;
    return mu_dynamic + (mu_static - mu_dynamic) * exp(-speed2 / (v_stribeck * v_stribeck));
  }

  double coefficient(double speed) const { return stribeck(speed * speed); }

  // On which a spin about the normal is a slip, for a disc of contact of radius a.
  template <class S>
  static S arm_of(const S& a) {
    return 3 * M_PI / 16 * a;
  }

  // Friction and torsion of a force whose part along the normal acts on the arm.
  template <class S>
  static void split(ContactForce<S>& out, const ContactKinematics<S>& m, const Vector3<S>& all,
                    const S& arm) {
    const S along = all.dot(m.normal);
    out.friction = all - along * m.normal;
    out.torsion = arm * along;
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
  static constexpr const char* kind = "bristle";
  double stiffness, damping;  // [N/m], [N s/m]

  explicit BristleFriction(const Numbers& p)
      : Sticking{p.at(0), p.at(1), p.at(4), p.at(5) != 0}, stiffness(p.at(2)), damping(p.at(3)) {}

  double stretch(const Vec3& z, const Vec3&, double) const { return z.norm(); }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>& m, double radius,
           double relaxation) const {
    using std::sqrt;
    Vector3<S> w = out.slip;
    S arm(0);
    if (torsional) {
      arm = arm_of(S(sqrt(radius * m.depth)));
      w += arm * m.spin * m.normal;
    }
    const S limit = stribeck(S(w.squaredNorm())) * out.normal;
    Vector3<S> z = m.bristle;
    if (!torsional) z -= z.dot(m.normal) * m.normal;
    const Vector3<S> stretched = stiffness * z;
    out.stiffness = stiffness;
    out.bristle = in_ball(stretched, limit) / stiffness;
    out.bristle_rate = w - (z - out.bristle) / relaxation;
    split(out, m, Vector3<S>(-in_ball(Vector3<S>(stretched + damping * w), limit)), arm);
  }
};

// The same with the stiffness of two elastic bodies that touch on a disc of radius a (Mindlin, J.
// Appl. Mech. 16 (1949) 259; Johnson 1985, ch. 7): 8 G* a against slip, 16/3 G a^3 against
// spin. It grows with the disc, which begins to carry without a load, so force and moment are kept
// while the bodies close and fall with the stiffness while they part: dF = k dw + F dk / k for dk <
// 0. The state is therefore not the stretch but the force over 8 G* x 1 m, and along the normal the
// moment over 8 G* x 1 m^2, of a contact that has lost nothing: regular at the touch, where a is
// zero. Beyond the limit both give way in the direction of the force, as maximal dissipation
// demands.
struct MindlinFriction : Sticking {
  static constexpr const char* kind = "mindlin";
  double shear, twist;            // 8 G*, 16/3 G [Pa]
  double damping_time;            // of a damper beside the spring, over its stiffness [s]
  double rolling, rolling_speed;  // 1, [m/s]
  double axial;                   // k / a of a spring on the arm that twists like the disc [Pa]

  explicit MindlinFriction(const Numbers& p)
      : Sticking{p.at(0), p.at(1), p.at(4), p.at(6) != 0},
        shear(p.at(2)),
        twist(p.at(3)),
        damping_time(p.at(5)),
        rolling(p.at(7)),
        rolling_speed(p.at(8)),
        axial(twist / (arm_of(1.0) * arm_of(1.0))) {}

  double stretch(const Vec3& z, const Vec3& normal, double stiffness) const {
    const double a = stiffness / shear, along = z.dot(normal);
    const Vec3 across = z - along * normal;
    if (!torsional) return across.norm() / a;
    return std::hypot(across.norm(), along / arm_of(a)) / a;
  }

  template <class S>
  void add(ContactForce<S>& out, const ContactKinematics<S>& m, double radius,
           double relaxation) const {
    using std::sqrt;
    if (rolling > 0) add_rolling(out, m, radius);
    const S a = sqrt(S(radius * m.depth));
    if (!(a > 0)) return;
    const Vector3<S>& n = m.normal;
    const S gap_rate = n.dot(m.relative);
    // k' / k while the bodies part.
    const S fall = gap_rate > 0 ? S(-0.5 * gap_rate / m.depth) : S(0);
    const S arm = torsional ? arm_of(a) : S(0);
    const double stiffest = torsional ? std::max(shear, axial) : shear;
    Vector3<S> w = out.slip;
    if (torsional) w += arm * m.spin * n;
    const S limit = stribeck(S(w.squaredNorm())) * out.normal;

    const auto scaled = [&](const Vector3<S>& x, const S& across, const S& along) -> Vector3<S> {
      const Vector3<S> part = x.dot(n) * n;
      return across * (x - part) + along * part;
    };
    const Vector3<S> load = scaled(m.bristle, S(shear), torsional ? S(shear / arm) : S(0));
    const Vector3<S> held = in_ball(load, limit);
    const Vector3<S> give = (load - held) / (stiffest * relaxation);
    out.bristle_rate = scaled(Vector3<S>(a * w - give), S(1), S(arm * (axial / shear)));
    if (fall < 0) out.bristle_rate += scaled(held, S(fall / shear), S(3 * fall * arm / shear));
    // Its length is that of a stretch with the same energy.
    out.stiffness = shear * a;
    out.bristle = scaled(held, S(1), S(std::sqrt(shear / axial))) / out.stiffness;
    Vector3<S> all = load;
    if (damping_time > 0)
      all += scaled(w, S(shear * damping_time * a), S(axial * damping_time * a));
    split(out, m, Vector3<S>(-in_ball(all, limit)), arm);
  }

  // Of the moment rolling x radius x N, regularized at a slow speed of rolling: it creeps.
  template <class S>
  void add_rolling(ContactForce<S>& out, const ContactKinematics<S>& m, double radius) const {
    using std::sqrt;
    const S x2 = m.rolling.squaredNorm() * (radius * radius / (rolling_speed * rolling_speed));
    const S share = x2 < 1 ? S((3 - x2) / 2) : S(1 / sqrt(x2));
    out.rolling = -(rolling * radius * radius / rolling_speed) * out.normal * share * m.rolling;
  }
};

// One of the friction laws.
struct FrictionLaw {
  std::variant<NoFriction, CoulombFriction, BristleFriction, MindlinFriction> law = NoFriction({});

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

  double coefficient(double speed) const {
    return std::visit([&](const auto& one) { return one.coefficient(speed); }, law);
  }
};

template <class S>
ContactForce<S> contact_force(const NormalLaw& law, const FrictionLaw& friction, double radius,
                              double relaxation, const ContactKinematics<S>& m) {
  ContactForce<S> out;
  const S gap_rate = m.normal.dot(m.relative);
  const NormalForce<S> push = law.force(m.depth, gap_rate);
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
