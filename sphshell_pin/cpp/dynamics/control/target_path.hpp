// A curve, and how a target moves along it.
#pragma once

#include "dynamics/control/fields.hpp"

namespace sphshell {

// The curve by points, and the place along it by phases of constant jerk.
struct PathSettings : Fields {
  explicit PathSettings(const Fields& fields) : Fields(fields) {}

  std::vector<double> along = list("along");     // arc length at the points, rising from 0 [m]
  PathPoints points = Fields::points("points");  // [m]
  // d point / d arc length, none: straight pieces; of a surface, else zero.
  PathPoints tangents = Fields::points("tangents"), normals = Fields::points("normals");
  std::vector<double> times = list("times");    // at which a phase of constant jerk begins [s]
  std::vector<double> places = list("places");  // arc length there [m], and its derivatives
  std::vector<double> speeds = list("speeds"), accelerations = list("accelerations"),
                      jerks = list("jerks");
  std::vector<double> kinks = list("kinks");  // times at which the velocity bends or jumps [s]
};

// Cubic Hermite pieces through the points, or straight ones; a phase lasts until the next begins,
// the first from ever, the last for ever. With one point, or one phase, the target stands still.
class TargetPath {
 public:
  struct Target {
    Vec3 point, velocity, acceleration, normal;
  };

  // In the frame of the path.
  explicit TargetPath(const Fields& fields) : s_(fields) {}

  // On the path at time t [s].
  Target at(double t) {
    // Time may also step back: the inner stages of a step.
    while (phase_ + 1 < s_.times.size() && t >= s_.times[phase_ + 1]) ++phase_;
    while (phase_ > 0 && t < s_.times[phase_]) --phase_;
    const auto [place, speed, rate] = in_phase(phase_, t);
    const std::vector<double>& along = s_.along;
    while (piece_ + 2 < along.size() && place >= along[piece_ + 1]) ++piece_;
    while (piece_ > 0 && place < along[piece_]) --piece_;
    const std::size_t i = piece_, j = std::min(i + 1, along.size() - 1);
    const double length = along[j] - along[i];
    // Share of the piece of the path, in arc length.
    const double u = length > 0 ? std::clamp((place - along[i]) / length, 0.0, 1.0) : 0.0;
    const Vec3 point = s_.points.row(i), chord = s_.points.row(j) - s_.points.row(i);
    Target target;
    target.normal = s_.normals.row(i) + u * (s_.normals.row(j) - s_.normals.row(i));
    if (length <= 0) {
      target.point = point;
      target.velocity.setZero();
      target.acceleration.setZero();
    } else if (s_.tangents.rows() == 0) {
      target.point = point + u * chord;
      target.velocity = speed * (chord / length);
      target.acceleration = rate * (chord / length);
    } else {
      // The chord's line, plus what the tangents at both ends add to it.
      const Vec3 from = length * s_.tangents.row(i).transpose() - chord;
      const Vec3 to = length * s_.tangents.row(j).transpose() - chord;
      const double w = 1 - u;
      target.point = point + u * (chord + w * (w * from - u * to));
      const Vec3 tangent = (chord + w * (w - 2 * u) * from + u * (u - 2 * w) * to) / length;
      const Vec3 bend = ((2 * u - 4 * w) * from + (4 * u - 2 * w) * to) / (length * length);
      target.velocity = speed * tangent;
      target.acceleration = rate * tangent + speed * speed * bend;
    }
    return target;
  }
  bool moves() const { return s_.times.size() > 1; }
  bool same_curve(const TargetPath& other) const { return s_.along == other.s_.along; }
  // The next time after t at which the motion is not smooth; infinite without one.
  double next_kink(double t) const {
    const auto next = std::upper_bound(s_.kinks.begin(), s_.kinks.end(), t);
    return next == s_.kinks.end() ? std::numeric_limits<double>::infinity() : *next;
  }
  // When the target sets out.
  double begin() const { return s_.times.front(); }
  // The arc length at time t, and the first time at which it is `place`.
  double place_at(double t) const {
    const auto next = std::upper_bound(s_.times.begin() + 1, s_.times.end(), t);
    return in_phase(static_cast<std::size_t>(next - s_.times.begin()) - 1, t).place;
  }
  double time_of(double place) const {
    const auto next = std::lower_bound(s_.places.begin(), s_.places.end(), place);
    if (next == s_.places.begin() || next == s_.places.end()) return s_.times.back();
    const auto phase = static_cast<std::size_t>(next - s_.places.begin()) - 1;
    // The place grows over a phase: halve it until the doubles between are used up.
    double from = s_.times[phase], to = s_.times[phase + 1];
    for (double middle = (from + to) / 2; from < middle && middle < to; middle = (from + to) / 2)
      (in_phase(phase, middle).place < place ? from : to) = middle;
    return to;
  }

 private:
  struct Place {
    double place, speed, acceleration;
  };
  Place in_phase(std::size_t phase, double t) const {
    if (phase + 1 == s_.times.size()) return {s_.places[phase], 0.0, 0.0};
    // Constant jerk over a phase.
    const double x = t - s_.times[phase], v = s_.speeds[phase];
    const double a = s_.accelerations[phase], j = s_.jerks[phase];
    if (t < s_.times[phase]) return {s_.places[phase], 0.0, 0.0};
    return {s_.places[phase] + x * (v + x * (a / 2 + x * j / 6)), v + x * (a + x * j / 2),
            a + x * j};
  }

  PathSettings s_;
  std::size_t phase_ = 0, piece_ = 0;
};

}  // namespace sphshell
