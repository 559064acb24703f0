// Forces at one contact and what they depend on. All are templates: dual numbers give the slopes of
// what the simulation runs.
#pragma once

#include <cmath>

#include <Eigen/Geometry>

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

// The usual exponents without pow(), which is slow and differs between processors in the last bit.
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

// Contacts do not pull: damping cannot make the force negative.
template <class S>
NormalForce<S> push(const S& total, const S& elastic) {
  return {total < 0 ? S(0) : total, elastic};
}

// What acts on the sphere at a contact.
template <class S>
struct ContactForce {
  S normal = S(0), elastic = S(0);               // along the normal [N]; its elastic part
  Vector3<S> friction = Vector3<S>::Zero();      // [N]
  S torsion = S(0);                              // moment about the normal [N m]
  Vector3<S> rolling = Vector3<S>::Zero();       // moment against rolling [N m]
  S stiffness = S(0);                            // of the bristle along the surface [N/m]
  S stretch2 = S(0);                             // square of what it is stretched [m^2]
  Vector3<S> bristle_rate = Vector3<S>::Zero();  // but for its turning with the normal [m/s]
  Vector3<S> slip = Vector3<S>::Zero();          // of the sphere against the shell [m/s]
};

// The projection P of the friction laws: x, or the nearest to it in the ball.
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
  // Of a bristle of several rings: the states of those behind the first, and where their rates go.
  const Vector3<S>* outer = nullptr;
  Vector3<S>* outer_rate = nullptr;
  S scale = S(0);  // of the gap, for Hertz's law [m^0.5]
};

}  // namespace sphshell
