// Where a sphere touches another one.
#pragma once

#include <vector>

#include "contact/query/contact.hpp"

namespace sphshell {

// The contact with a solid ball about the origin: the point of the ball that is closest to the
// center of the sphere.
inline void find_on_ball(double ball, const Vec3& center, double radius,
                         std::vector<Contact>& contacts) {
  contacts.clear();
  const double distance = center.norm();
  const double depth = radius + ball - distance;
  if (!(depth > 0)) return;
  // Of two spheres with one center any normal will do.
  const Vec3 normal = distance > 0 ? Vec3(center / distance) : Vec3::UnitZ();
  Contact& contact = contacts.emplace_back(Contact{ball * normal, normal, depth, 0, Feature::Face});
  if (distance > 0) contact.dn_dc = (Mat3::Identity() - normal * normal.transpose()) / distance;
  // A sphere that is pressed through the ball's center comes out behind: it has no sides.
  contact.rim = true;
}

}  // namespace sphshell
