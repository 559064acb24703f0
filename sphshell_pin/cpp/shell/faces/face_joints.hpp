// Where two faces meet: one record for the whole border between them, read from both sides.
#pragma once

#include <optional>

#include "shell/faces/primitive.hpp"

namespace sphshell {

// A face gives closest points where it holds its vertices, and its borders, to this share of the
// size: so much the potential may jump there.
constexpr double kMostGap = 4e-9;
// Faces that meet at less than this angle (its sine) do not determine where by Newton's method.
constexpr double kLeastAngle = 0.003;
// Of the size, so near to an end at which both are tangent.
constexpr double kBesideEnd = 1e-7;

// The border of two faces. Lines and circles follow from both shapes in closed form, whatever their
// angle; of others the shapes are all that is known, and they must cross.
struct FaceJoint {
  enum class Kind : std::uint8_t { Line, Circle, Crossing };

  Kind kind = Kind::Crossing;
  int face[2] = {-1, -1};     // in Faces::shapes
  bool tangent = false;       // both faces have one normal here, and one shape divides them
  Vec3 point = Vec3::Zero();  // of a line; the center of a circle
  Vec3 axis = Vec3::UnitZ();  // along a line; of a circle. Unit
  double radius = 0;          // of a circle [m]
  // Per face the shape that its normals on the border span: a center is on one side of it where its
  // closest point on the face is on that side of the border. Of crossings the other face, or the
  // plane that the curve lies in.
  Primitive across[2];
  // Of crossings of cylinders and cones with quadrics, per face: which of the two points of its
  // rulings on the other face the curve has; 0: the rulings do not tell.
  std::int8_t branch[2] = {0, 0};
  // An end of a crossing at which both faces are tangent: another branch of it goes through there.
  // The unit tangents of both, and the curvature of this one, across the faces.
  struct End {
    Vec3 at = Vec3::Zero(), along = Vec3::Zero(), other = Vec3::Zero(), curvature = Vec3::Zero();
    // Within `reach` the branches are told apart by their tangents; nearer than `least` the curve
    // is a parabola, as rounding decides where the faces cross [m].
    double reach = 0, least = 0;
    double grows[2] = {1, 1};  // per face the sign of the other's distance on it, towards `other`
  };
  End ends[2];
  int num_ends = 0;

  int which(int of_face) const { return of_face == face[0] ? 0 : 1; }
  const Primitive& across_of(int of_face) const { return across[tangent ? 0 : which(of_face)]; }
  // Whether it is a line, or a circle on whose axis x is not.
  bool has_one_nearest(const Vec3& x) const {
    const double near_axis = 1e-6 * radius;  // nearer to the axis nothing has a direction
    return kind != Kind::Crossing && axis.cross(x - point).squaredNorm() > near_axis * near_axis;
  }
  // The point of a line or circle nearest to x.
  Vec3 nearest(const Vec3& x) const {
    const Vec3 y = x - point, along = y.dot(axis) * axis;
    if (kind == Kind::Line) return point + along;
    const Vec3 beside = y - along;
    return point + radius / std::max(beside.norm(), 1e-300) * beside;
  }
  // The tangent end that is nearer to x than `most`; null: none.
  const End* end_near(const Vec3& x, double most) const;
  // Whether another crossing of the faces has its tangent ends at the same places, to `gap`, and
  // the same branches.
  bool branches_as(const FaceJoint& other, double gap) const;
  // How far a center (of crossings: a point of the face) is on one side of the border of a face,
  // and about towards where.
  double divide(int of_face, const Vec3& x, Vec3& away) const;
  // Whether a crossing's points are found one by one: closest points on it need not be unique.
  bool followed() const { return num_ends > 0 || branch[0] != 0 || branch[1] != 0; }
  // Moves the point at a share of the chord from p to q onto the curve between them, and returns
  // its unit tangent there.
  Vec3 tangent_at(const std::vector<Primitive>& shapes, const Vec3& p, const Vec3& q, double share,
                  Vec3& x) const;
  // How the border goes next to x.
  Intersection at(const std::vector<Primitive>& shapes, const Vec3& x) const;
};

// The line or circle from p to q in which two shapes meet, if they do: it is on both all along to
// `gap` [m]. That it is one follows from their kinds and places and is never fitted.
std::optional<FaceJoint> find_joint(const std::vector<Primitive>& shapes, int one, int other,
                                    const Vec3& p, const Vec3& q, double gap);

// Finds the tangent ends of a crossing, and what the rulings tell of it, by its points from one end
// to the other.
void find_branches(const std::vector<Primitive>& shapes, const std::vector<Vec3>& points,
                   double size, FaceJoint& joint);

// The point next to x where both shapes are zero. False where they do not cross there.
bool onto_both(const Primitive& one, const Primitive& other, Vec3& x);

}  // namespace sphshell
