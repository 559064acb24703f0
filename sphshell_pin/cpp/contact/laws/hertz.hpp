// Hertz's theory of two elastic bodies whose gap is a paraboloid: the stiffness and the ellipse of
// contact, from the relative curvatures.
#pragma once

#include <Eigen/Core>

namespace sphshell {

// Of a gap z = A x^2 + B y^2, by trace = 2 (A + B) and determinant = 4 A B of its second
// derivatives [1/m, 1/m^2]:
//
//   force = E* scale depth^1.5,  scale = 4/3 (A + B)^-0.5 exp(f(s)),  s = ln((A + B)^2 / (4 A B))
//
// with f from the elliptic integrals of Johnson, Contact Mechanics (1985), eq. 4.26; f(0) = 0 is
// the sphere. The energy is stationary in the ellipse, so its slopes are those of the pressure's
// second moments: d ln(scale) / dA = -a^2 / (2 depth), and the half axes follow from the slope of
// f.
struct Hertz {
  double scale;  // [m^0.5]
  double slope;  // f'(s)

  Hertz(double trace, double determinant);
};

// What a contact's stiffness and patch depend on, and its depth, corrected for what the shell's
// elements leave of the surface that they were made from. The elastic energy is a function of depth
// and scale, which both depend on the sphere's center: so does all of it.
struct ContactShape {
  double depth = 0;                                   // [m]
  Eigen::Vector3d tilt = Eigen::Vector3d::Zero();     // depth falls along normal + tilt
  Eigen::Matrix3d tilt_by = Eigen::Matrix3d::Zero();  // its derivative, where asked for [1/m]
  double scale = 0;                                   // as of Hertz [m^0.5]
  Eigen::Vector3d gradient;                           // of scale by the sphere's center [m^-0.5]
  Eigen::Matrix3d second;                             // where asked for: its second derivatives
  double half_axis2[2] = {0, 0};                      // squares of the half axes over the depth [m]
  Eigen::Vector3d axis = Eigen::Vector3d::UnitX();    // unit, of the longer half axis
  double conformity = 0;  // radius of the sphere over that of a socket, -1 for the same ball

  // A disc of contact as large as the ellipse is that of one sphere of this radius on a plane [m].
  double disc_radius() const;
  // Half axes at a depth, the longer one first [m].
  Eigen::Vector2d half_axes(double depth) const;
};

// Of a gap with these second derivatives, a symmetric matrix in the plane of the unit `normal`
// [1/m]; without gradient. It is kept from closing: conformity counts up to kMostConformal.
ContactShape shape_of_gap(const Eigen::Matrix3d& gap, const Eigen::Vector3d& normal, double radius,
                          Eigen::Matrix3d* slope = nullptr);

// Sockets that conform more than this are taken as this: the ellipse is no longer small against
// them, and Hertz's theory ends.
constexpr double kMostConformal = 0.99;
// The longer half axis over the sphere's radius from which on Hertz's theory is in doubt.
constexpr double kLargestEllipse = 0.5;

}  // namespace sphshell
