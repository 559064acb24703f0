// Planes, cylinders, cones, spheres and tori in closed form, and how they are fitted to points.
#pragma once

#include "shell/topology.hpp"

namespace sphshell {

enum class FaceKind : int { Plane = 0, Cylinder = 1, Cone = 2, Sphere = 3, Torus = 4 };

// A surface with a closest point in closed form. Lengths in meters, angles in radians.
struct Primitive {
  FaceKind kind = FaceKind::Plane;
  Vec3 point = Vec3::Zero();  // on the axis; the center of a sphere or torus; on a plane
  Vec3 axis = Vec3::UnitZ();  // unit; the normal of a plane
  double radius = 0;          // [m]; of a cone: at `point`; of a torus: of the circle of centers
  double second = 0;          // of a cone: its half-angle [rad]; of a torus: the minor radius [m]

  // Signed distance of x [m] and its gradient, which points away from the axis (sphere: center,
  // torus: circle of centers).
  double distance(const Vec3& x, Vec3& normal) const {
    if (kind != FaceKind::Plane) return distance_of_curved(x, normal);
    normal = axis;
    return (x - point).dot(axis);
  }
  double distance(const Vec3& x) const {
    Vec3 normal;
    return distance(x, normal);
  }
  // Of a cone: beside a point of it, negative beyond its tip; of others the radius, which is
  // positive.
  double radius_at(const Vec3& x) const {
    if (kind == FaceKind::Plane) return 1;
    return kind == FaceKind::Cone ? radius + (x - point).dot(axis) * std::tan(second) : radius;
  }
  // The point next to x where it is zero.
  Vec3 onto(const Vec3& x) const {
    Vec3 normal;
    const double off = distance(x, normal);
    return x - off * normal;
  }
  // Of cylinders, cones and tori: the angle about the axis [rad], and the height along it as a
  // share of `size`, or the angle of the tube. Right-handed about the normal; the first is not
  // finite on the axis.
  Eigen::Vector2d parameters(const Vec3& x, double size) const;
  // The point of given parameters, and how it moves with each.
  Vec3 at(const Eigen::Vector2d& place, double size, Vec3* along = nullptr) const;
  bool has_parameters() const { return kind != FaceKind::Plane && kind != FaceKind::Sphere; }
  // The second derivatives of the distance at x [1/m]: how its gradient turns.
  Mat3 hessian(const Vec3& x) const;
  // Whether x is so near the axis or the center, to this share of the radius, that the gradient has
  // no direction there.
  bool singular(const Vec3& x, double share) const;

 private:
  double distance_of_curved(const Vec3& x, Vec3& normal) const;
};

// How the curve goes on which two shapes are zero, at a point next to it: the derivatives of the
// distances along the curve vanish, n . k = -t . H t for both.
struct Intersection {
  Vec3 tangent, curvature;  // t, unit; k, its derivative along the curve [1/m]
  Vec3 offset;              // from the point onto both [m]
  double sine;              // of the angle between the shapes
};
// At a point that need not be on it yet.
Intersection intersection_at(const Primitive& one, const Primitive& other, const Vec3& x);

// The eigenvectors of a symmetric matrix, that of the smallest eigenvalue first.
Mat3 eigenvectors(const Mat3& symmetric);

// How many numbers describe a primitive of a kind.
int num_parameters(FaceKind kind);

// What is known of some facets of a surface, to guess a primitive from.
struct FacetSample {
  std::vector<Vec3> vertices;
  std::vector<Vec3> centroids, normals;  // of the facets, unit
  std::vector<double> areas;
};

// Primitives of a kind (none of them a plane) that come near the facets.
std::vector<Primitive> guess_primitives(FaceKind kind, const FacetSample& facets);

// Gauss-Newton on the distances of the points. False unless all of them come within `tolerance`.
bool fit_primitive(const std::vector<Vec3>& points, double tolerance, Primitive& primitive);

}  // namespace sphshell
