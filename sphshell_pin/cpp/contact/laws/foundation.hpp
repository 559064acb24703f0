// An elastic foundation between a ball and a shell, or another ball: the pressure at a distance rho
// from the ball's center is kappa (R^2 - rho^2) / (2 rho), wherever the ball overlaps the body. Or
// between a plane and a shell: kappa times the depth below the plane.
#pragma once

#include "contact/query/broad_phase.hpp"
#include "contact/laws/foundation_flat.hpp"

namespace sphshell {

struct CubicCurve;

// A quadrature point, in the shell's frame. On a rim, where the area is zero, there is a force that
// no pressure makes.
struct FoundationPoint {
  Vec3 point, normal;     // normal: unit, where the pressure pushes the ball
  double area, pressure;  // [m^2]; per modulus / thickness [m]
  Vec3 force;             // on the ball, per modulus / thickness [m^3]
  int row;
};

// What one patch of the shell contributes: the potential depends on the ball's center alone, so
// the force acts at the center.
struct FoundationRow {
  int patch, sheet, element;
  double depth;              // of the patch's closest point [m]
  Vec3 center;               // of pressure, in the shell's frame
  FoundationSum sum;         // per modulus / thickness; the normals point where the pressure pushes
  Vec3 away = Vec3::Zero();  // unit, from the closest point: the depth falls along it
  Vec3 normal() const;       // direction of the force
};

// Scratch of one pair; no heap is used once it has grown.
class Foundation {
 public:
  Foundation();

  // Rows of the patches that the ball overlaps, in no order. Slopes of the force and quadrature
  // points only where asked for; the forces of the points add up to those of the rows. The
  // potential is
  //   V(c) = integral of p over the overlap of the ball and what is behind the shell,
  // the shell's sheets being oriented so that V is positive where `side` does not say it.
  void find(const Shell& shell, Method method, const Vec3& center, double radius, bool slopes,
            bool points);
  // The same for a solid ball about the origin.
  void find_on_ball(double ball, const Vec3& center, double radius, bool points);
  // The same for the plane z = 0, with a solid below, and a shell that `turn` and `shift` take to
  // its frame, in which the row and the points are. One row, as the pressure of every element is
  // along z: the force is that of the volume below the plane, and the center, in the plane, is on
  // its line of action. Points of a shell that is deeper than others over them pull, and their
  // areas are negative. All points are there, more of them for friction; of each the shell's area
  // vector, out of the body, is in areas(). The potential is that of the surface,
  //   V = integral of depth^2 / 2 over the area seen from below,
  // which a surface with a border has as well; the depth is not found here.
  void find_below(const Shell& shell, const Mat3& turn, const Vec3& shift, bool friction);

  const std::vector<FoundationRow>& rows() const { return rows_; }
  const std::vector<FoundationPoint>& points() const { return points_; }
  const std::vector<Vec3>& areas() const { return areas_; }

 private:
  // A curved facet that a row counts, and how near it may be [m].
  struct Counted {
    int facet, row;
    double nearest;
  };
  // The row of a patch, a new one where it had none.
  FoundationRow& row_of(int patch, int sheet, int element);
  // What the border of an open sheet adds.
  void add_rim(const CubicCurve& side, double radius, FoundationRow& row, bool points);
  // The depths of rows on curved facets; and what is done once all facets are counted.
  void find_depths(const Shell& shell, const Vec3& center, double radius);
  void finish(const Shell& shell, const Vec3& center, double radius);

  BroadPhase broad_;
  std::vector<FoundationRow> rows_;
  std::vector<FoundationPoint> points_;
  std::vector<Vec3> areas_;
  std::vector<int> below_;  // facets
  std::vector<Counted> counted_;
};

}  // namespace sphshell
