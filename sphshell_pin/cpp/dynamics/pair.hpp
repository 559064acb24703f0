// Two bodies that may touch: the constant description.
#pragma once

#include <functional>
#include <memory>
#include <pinocchio/spatial.hpp>
#include <string>
#include <vector>

#include "contact/friction.hpp"
#include "contact/query.hpp"

namespace sphshell {

using SE3 = pinocchio::SE3;

// A user's own contact points: poses of both frames in, contacts (points and normals in the world,
// normals from j to i) out.
using ContactSource =
    std::function<void(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& contacts)>;

// Body i carries the sphere, body j the shell. With a source, both placements are those of its
// frames; else `placement_i` holds the sphere's center and `placement_j` the shell.
struct Pair {
  std::string name;
  int joint_i = 0, joint_j = 0;
  SE3 placement_i = SE3::Identity(), placement_j = SE3::Identity();
  double radius = 0;
  std::shared_ptr<const Shell> shell;
  ContactSource source;
  Method method = Method::Facets;
  NormalLaw law;
  FrictionLaw friction;
  double relaxation = 2e-5;  // time in which bristles give way beyond their limit [s]

  bool needs_velocity() const { return law.needs_rate() || friction.active(); }
  // Whether the derivative of a contact's normal is known.
  bool has_dn_dc() const { return !source && method != Method::Elements; }
};

}  // namespace sphshell
