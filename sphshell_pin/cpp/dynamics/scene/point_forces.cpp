#include "dynamics/scene/patch.hpp"
#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

void PointForces::complete(const SceneData& scene, ActiveContact& active) const {
  const Pair& pair = scene.pair_of(active);
  const ContactForce<double>& f = active.force;
  const ContactKinematics<double>& m = active.kinematics;
  const double weight = active.contact.weight;
  // The weight of several as one is the length of the sum of their normals.
  const double share = weight > 0 ? 1 : weight;
  active.damping = weight * damping_power(f, m);
  active.sliding = weight * friction_power(f, m);
  active.elastic = share * pair.law.energy(m.depth, m.scale);
  // Contacts that come or go are events, and so is a force that begins or ends.
  active.pieces = weight > 0 ? 1 : -1;
  active.clamped = f.normal == 0;
}

PatchRow PointForces::patch(SceneData& scene, const ActiveContact& active,
                            const ContactRow& row) const {
  const Pair& pair = scene.pair_of(active);
  if (!pair.has_sphere()) return unknown_patch(row.depth);
  const ContactShape gap =
      active.shape < 0 ? scene.shape_of(active.pair, pair, active.contact) : *scene.shape(active);
  return hertz_patch(gap, scene.state_of(active).world_from_j.rotation(), row.depth,
                     row.normal_force);
}

void PointForces::slopes(const SceneData& scene, const ActiveContact& active,
                         const ContactSite& site, ContactSlopes& out) const {
  const Pair& pair = scene.pair_of(active);
  contact_slopes(pair.law, pair.friction, scene.relaxation(pair), site, out);
}

// At the same depth, so that only the laws, and where the contact is on the bodies, have changed.
bool PointForces::changed(SceneData& scene, const Pair& pair, const ActiveContact& active,
                          const ContactSite& site, ContactSlopes& out) const {
  ContactSite other = site;
  ContactShape shape;
  other.disc_radius = pair.disc_radius();
  if (site.shape) {
    shape = scene.shape_of(active.pair, pair, site.contact);
    // A radius makes the contact deeper as well, and the shape follows: next to joints.
    const double deeper = pair.radius - site.radius, step = 1e-3 * site.contact.depth;
    for (int way : {1, -1}) {
      if (deeper == 0 || !(step > 0)) break;
      Contact moved = site.contact;
      moved.depth += way * step;
      const ContactShape there = scene.shape_of(active.pair, scene.pair_of(active), moved);
      const double share = way * deeper / (2 * step);
      shape.scale += share * there.scale;
      shape.gradient += share * there.gradient;
      shape.tilt += share * there.tilt;
    }
    shape.depth = site.shape->depth;
    other.shape = &shape;
    other.disc_radius = shape.disc_radius();
  }
  pair.ask([&](const auto& one) { one.follow_size(other.contact); });
  contact_slopes(pair.law, pair.friction, scene.relaxation(pair), other, out);
  return true;
}

}  // namespace sphshell
