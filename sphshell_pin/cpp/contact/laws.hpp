// Normal force and friction of one contact, from depth and relative velocity.
#pragma once

#include <algorithm>
#include <cmath>

#include <Eigen/Core>

namespace sphshell {

using Vec3 = Eigen::Vector3d;

// STEP of ADAMS: a cubic from h0 at x0 to h1 at x1, constant outside.
inline double step(double x, double x0, double h0, double x1, double h1) {
  const double u = std::clamp((x - x0) / (x1 - x0), 0.0, 1.0);
  return h0 + (h1 - h0) * u * u * (3 - 2 * u);
}

inline double power(double x, double exponent) {
  if (exponent == 1) return x;
  if (exponent == 1.5) return x * std::sqrt(x);
  if (exponent == 2) return x * x;
  return std::pow(x, exponent);
}

struct NormalForce {
  double total;    // >= 0 [N]
  double elastic;  // its part that derives from the potential [N]
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
  NormalForce force(double depth, double gap_rate) const {
    const double elastic = stiffness * power(depth, exponent);
    if (!needs_rate()) return {elastic, elastic};
    const double total = kind == Kind::Impact
                             ? elastic - step(depth, 0, 0, full_damping_depth, damping) * gap_rate
                             : elastic * (1 - damping * gap_rate);
    return {std::max(0.0, total), elastic};
  }

  // Potential of the elastic part [J].
  double energy(double depth) const {
    return stiffness * power(depth, exponent) * depth / (exponent + 1);
  }
};

// ADAMS's two-velocity Coulomb law.
struct CoulombLaw {
  bool active = false;
  double mu_static = 0, mu_dynamic = 0;
  double v_static = 1, v_dynamic = 2;  // [m/s]

  // coefficient / slip speed [s/m]: finite at rest, so that no direction is divided by zero.
  double over_speed(double speed) const {
    const double x = speed / v_static;
    if (x < 1) return mu_static * (3 - x * x) / (2 * v_static);
    return step(speed, v_static, mu_static, v_dynamic, mu_dynamic) / speed;
  }
};

struct ContactForce {
  double normal = 0;             // [N], below zero where the weight is
  double damping_power = 0;      // lost by the normal damping [W]
  double friction_power = 0;     // lost by friction [W]
  Vec3 friction = Vec3::Zero();  // on the sphere [N]
  Vec3 slip = Vec3::Zero();      // tangential velocity of the sphere against the shell [m/s]
};

// relative: velocity of the sphere's body against the shell's, both at the contact point [m/s];
// weight: that of the contact, by which all of the force is multiplied.
inline ContactForce contact_force(const NormalLaw& law, const CoulombLaw& friction, double depth,
                                  const Vec3& normal, const Vec3& relative, double weight = 1) {
  ContactForce out;
  const double gap_rate = normal.dot(relative);
  NormalForce push = law.force(depth, gap_rate);
  push.total *= weight, push.elastic *= weight;
  out.normal = push.total;
  out.damping_power = -(push.total - push.elastic) * gap_rate;
  out.slip = relative - gap_rate * normal;
  if (friction.active) {
    const double speed = out.slip.norm();
    out.friction = -push.total * friction.over_speed(speed) * out.slip;
    out.friction_power = -out.friction.dot(out.slip);
  }
  return out;
}

}  // namespace sphshell
