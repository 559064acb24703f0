// A curve, and how a target moves along it.
#pragma once

#include "shell/topology.hpp"

namespace sphshell {

// Vectors in rows, as NumPy's arrays have them.
using PathPoints = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// The curve by points, and the place along it by phases of constant jerk.
struct PathSettings {
  std::vector<double> along;          // arc length at the points, increasing from 0 [m]
  PathPoints points;                  // [m]
  PathPoints tangents;                // d point / d arc length; none: straight pieces
  PathPoints normals;                 // of a surface, else zero
  std::vector<double> times;          // at which a phase of constant jerk begins [s]
  std::vector<double> places;         // arc length there [m]
  std::vector<double> speeds;         // [m/s]
  std::vector<double> accelerations;  // [m/s2]
  std::vector<double> jerks;          // [m/s3]
  std::vector<double> kinks;          // times at which the velocity bends or jumps [s]
};

// Cubic Hermite pieces through the points, or straight ones; a phase lasts until the next begins,
// the first from ever, the last for ever. With one point, or one phase, the target stands still.
class TargetPath {
 public:
  struct Target {
    Vec3 point, velocity, acceleration, normal;
  };

  explicit TargetPath(PathSettings settings) : s_(std::move(settings)) {}

  // On the path at time t [s].
  Target at(double t);
  bool moves() const { return s_.times.size() > 1; }
  bool same_curve(const TargetPath& other) const { return s_.along == other.s_.along; }
  // The next time after t at which the motion is not smooth; infinite without one.
  double next_kink(double t) const;
  // When the target sets out.
  double begin() const { return s_.times.front(); }
  // The arc length at time t, and the first time at which it is `place`.
  double place_at(double t) const;
  double time_of(double place) const;

 private:
  struct Place {
    double place, speed, acceleration;
  };
  Place in_phase(std::size_t phase, double t) const;

  PathSettings s_;
  std::size_t phase_ = 0, piece_ = 0;
};

}  // namespace sphshell
