// Regions of connected coplanar triangles: however a plane was divided, it is one facet.
#pragma once

#include "shell/shell.hpp"

namespace sphshell {

// Whether coordinates that are known to `tolerance` [m] are rounded hardly more coarsely than in
// single precision.
inline bool is_precise(const Shell& shell, double tolerance) {
  return tolerance < 3e-7 * shell.size();
}

// The moments of coplanar triangles, about a point near them against cancellation.
class Moments {
 public:
  explicit Moments(const Vec3& about = Vec3::Zero()) : about_(about) {}

  void add(double area, const std::array<Vec3, 3>& corners);
  Vec3 middle() const { return about_ + first_ / area_; }
  // About the middle, over the area [m^2].
  Mat3 second() const { return second_ / area_ - first_ / area_ * (first_ / area_).transpose(); }
  // Of the plane of least squares, on the side of `side`.
  Vec3 normal(const Vec3& side) const;

 private:
  Vec3 about_, first_ = Vec3::Zero();
  Mat3 second_ = Mat3::Zero();
  double area_ = 0;
};

// Connected triangles that lie in one plane within a tolerance, largest triangles first.
class CoplanarRegions {
 public:
  // Triangles within `tolerance` [m] of the plane of the largest of them.
  CoplanarRegions(const Shell& shell, double tolerance);

  int of(int triangle) const { return of_[triangle]; }
  int size() const { return static_cast<int>(regions_.size()); }
  int count(int region) const { return regions_[region].count; }
  // Whether its region has no other: most of a curved surface, known without a look at the region.
  bool is_alone(int triangle) const { return alone_[triangle] != 0; }
  double area(int region) const { return regions_[region].area; }
  const Vec3& normal(int region) const { return regions_[region].normal; }
  // How far the region of a half-edge (3 triangle + side) reaches from that side [m].
  double height(int half_edge) const { return heights_[half_edge]; }

 private:
  struct Region {
    Vec3 normal;  // unit, of its largest triangle
    double area;
    double extent;  // diagonal of its box
    int count;
  };
  LargeArray<int> of_;
  LargeArray<double> heights_;  // per half-edge
  LargeArray<Region> regions_;
  LargeArray<char> alone_;  // per triangle
};

}  // namespace sphshell
