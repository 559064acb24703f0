// Two bodies that may touch: the constant description.
#pragma once

#include "sphshell_pin/laws/friction.hpp"
#include "dynamics/scene/geometry.hpp"

namespace sphshell {

// Body i carries the sphere, body j what it may touch. `placement_i` holds the sphere's center,
// `placement_j` the geometry's frame; of a source both placements are those of its frames. Of a
// plane, body i carries the shell.
struct Pair {
  std::string name, group;  // group: of the pairs that were stated together, or empty
  int joint_i = 0, joint_j = 0;
  SE3 placement_i = SE3::Identity(), placement_j = SE3::Identity();
  double radius = 0;  // of the sphere; 0: of a source or a plane, which have none [m]
  Geometry geometry;
  NormalLaw law;
  FrictionLaw friction;
  double relaxation = 2e-5;  // time in which bristles give way beyond their limit [s]

  // What the kind of geometry answers.
  template <class Question>
  auto ask(Question&& question) const {
    return std::visit(std::forward<Question>(question), geometry);
  }
  // Whether contacts follow the center of a sphere: not those of a plane or a source.
  bool has_sphere() const {
    return ask([](const auto& one) { return std::decay_t<decltype(one)>::kHasSphere; });
  }
  bool on_plane() const { return std::holds_alternative<PlaneBelow>(geometry); }
  // Of the smaller of two spheres, else of the sphere [m].
  double least_radius() const {
    return ask([&](const auto& one) { return one.least_radius(radius); });
  }
  // That of Hertz's theory: a disc of contact at a depth is as large as that of one sphere of this
  // radius on a plane [m].
  double disc_radius() const {
    return ask([&](const auto& one) { return one.disc_radius(radius); });
  }
  // Whether the derivative of a contact's normal is known.
  bool has_dn_dc() const {
    return ask([](const auto& one) { return one.has_dn_dc(); });
  }

  bool needs_velocity() const { return law.needs_rate() || friction.active(); }
  // Whether the shape of the gap counts.
  bool needs_shape() const { return law.hertz() != nullptr; }
};

// A number for each pair, the same for neighbors of one group.
inline std::vector<int> group_numbers(const std::vector<Pair>& pairs) {
  std::vector<int> out;
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    const bool same = k > 0 && !pairs[k].group.empty() && pairs[k].group == pairs[k - 1].group;
    out.push_back(k == 0 ? 0 : out.back() + (same ? 0 : 1));
  }
  return out;
}

// A number of a pair by which forces are differentiated: one column of derivatives.
struct Parameter {
  // A field of law or friction, or something else that moves no body; the radius of the sphere, or
  // of the ball; a coordinate of the sphere's center, in its frame; of the shell's placement, a
  // coordinate of the twist that it is moved by, in its own axes, linear part first.
  enum class Kind : int { Field, Radius, Ball, Offset, Placement };

  int pair;
  Kind kind;
  int axis = 0;  // of Offset and Placement
  // Of the others: the pair with the number less and more a step. What follows from it through the
  // law's own formulas is differenced, what follows through the motion of the contact is not.
  Pair less = {}, more = {};
  double step = 0;
  double scale = 1;  // size of the number

  // The pair changed by a step of this sign, and that step: `move` where the parameter moves
  // something [m or rad].
  std::pair<Pair, double> changed(const Pair& pair, double sign, double move) const {
    if (kind != Kind::Offset && kind != Kind::Placement) return {sign > 0 ? more : less, step};
    Pair out = pair;
    if (kind == Kind::Offset) {
      out.placement_i.translation() += sign * move * pair.placement_i.rotation().col(axis);
    } else {
      pinocchio::Motion twist = pinocchio::Motion::Zero();
      twist.toVector()[axis] = sign * move;
      out.placement_j = pair.placement_j * exp_of(twist);
    }
    return {out, move};
  }

 private:
  // Of a twist along or about one axis.
  static SE3 exp_of(const pinocchio::Motion& twist) {
    const double angle = twist.angular().norm();
    if (angle == 0) return SE3(Eigen::Matrix3d::Identity(), twist.linear());
    return SE3(Eigen::AngleAxisd(angle, twist.angular() / angle).toRotationMatrix(), Vec3::Zero());
  }
};

}  // namespace sphshell
