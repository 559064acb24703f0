// Two bodies that may touch: the constant description.
#pragma once

#include <algorithm>
#include <functional>
#include <memory>
#include <pinocchio/spatial.hpp>
#include <string>
#include <vector>

#include "contact/laws/friction.hpp"
#include "contact/query/query.hpp"

namespace sphshell {

using SE3 = pinocchio::SE3;

// A user's own contact points: poses of both frames in, contacts (points and normals in the world,
// normals from j to i) out.
using ContactSource =
    std::function<void(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& contacts)>;

// Body i carries the sphere, body j the shell or another sphere, the ball. With a source, both
// placements are those of its frames; else `placement_i` holds the sphere's center and
// `placement_j` the shell or the ball's center.
struct Pair {
  std::string name, group;  // group: of the pairs that were stated together, or empty
  int joint_i = 0, joint_j = 0;
  SE3 placement_i = SE3::Identity(), placement_j = SE3::Identity();
  double radius = 0;
  double ball = 0;  // radius of the sphere on body j [m]; 0: it carries none
  std::shared_ptr<const Shell> shell;
  ContactSource source;
  Method method = Method::Facets;
  NormalLaw law;
  FrictionLaw friction;
  double relaxation = 2e-5;  // time in which bristles give way beyond their limit [s]

  bool needs_velocity() const { return law.needs_rate() || friction.active(); }
  // Of the smaller of two spheres, else of the sphere [m].
  double least_radius() const { return ball > 0 ? std::min(radius, ball) : radius; }
  // That of Hertz's theory: a disc of contact at a depth is as large as that of one sphere of this
  // radius on a plane [m].
  double disc_radius() const { return ball > 0 ? radius * (ball / (radius + ball)) : radius; }
  // Whether the shape of the gap counts.
  bool needs_shape() const { return law.hertz() != nullptr; }
  // Whether the derivative of a contact's normal is known.
  bool has_dn_dc() const { return !source && method != Method::Elements; }
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

}  // namespace sphshell
