#include "dynamics/scene/scene_data.hpp"

namespace sphshell {

// The friction that acts at each place: none where there is a bristle, which is the contact's.
static FrictionLaw friction_of_places(const Pair& pair) {
  return pair.friction.has_state() ? FrictionLaw() : pair.friction;
}

// The spread that a bristle's arm follows, whose root that is, and its derivative by the spread:
// less where that is small, as the root of a spread that begins grows without bound.
static std::pair<double, double> spread_of_arm(const Pair& pair, double spread) {
  constexpr double kSmall = 0.05;  // of the size
  const double size = kSmall * std::get<PlaneBelow>(pair.geometry).flats().size;
  const double share = spread / (spread + size * size);
  return {share * spread, share * (2 - share)};
}

void PointForces::find_shared(const PlaneBelow& plane, const SE3& plane_from_shell, Query& query) {
  const Flats& flats = plane.flats();
  plane.find(plane_from_shell, Crown::height(flats), query);
  std::vector<Contact>& contacts = query.contacts;
  for (Contact& contact : contacts) {
    if (contact.weight < 0) continue;
    if (num_shared_ == shared_.size()) shared_.emplace_back();
    SharedContact& out = shared_[num_shared_];
    if (!crown_.share(*plane.shell, flats, plane_from_shell.rotation(),
                      plane_from_shell.translation(), contact, out))
      continue;
    ++num_shared_;
    // In the plane.
    for (SharedContact::Place& place : out.places)
      place.point.z() = 0, place.point_by.row(2).setZero();
    out.point.z() = 0;
    contact.depth = out.depth, contact.point = out.point, contact.group = -1;
    contact.dn_dc.setZero();
  }
  erase_if(contacts, [](const Contact& one) { return !(one.depth > 0); });
}

const SharedContact* PointForces::shared(const Contact& contact) const {
  for (std::size_t i = 0; i < num_shared_; ++i)
    if (shared_[i].facet == contact.facet && shared_[i].index == contact.index &&
        contact.weight > 0)
      return &shared_[i];
  return nullptr;
}

void PointForces::complete(const SceneData& scene, ActiveContact& active) const {
  const Pair& pair = scene.pair_of(active);
  ContactForce<double>& f = active.force;
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
  const SharedContact* shared = this->shared(active.contact);
  if (!shared) return;
  const FrictionLaw friction = friction_of_places(pair);
  const SE3& world_from_j = scene.state_of(active).world_from_j;
  ContactForce<double> whole;
  whole.elastic = f.elastic, whole.slip = f.slip;
  active.damping = active.sliding = 0, active.moment.setZero();
  for (const SharedContact::Place& place : shared->places) {
    const Vec3 point = world_from_j.act(place.point);
    ContactKinematics<double> there = m;
    if (pair.needs_velocity()) there.relative = scene.relative_velocity(pair, point);
    const ContactForce<double> at = contact_force(pair.law, friction, 0, 0, there);
    whole.normal += place.share * at.normal;
    whole.friction += place.share * at.friction;
    active.moment += place.share * (point - active.point).cross(at.normal * m.normal + at.friction);
    active.damping += place.share * damping_power(at, there);
    active.sliding += place.share * friction_power(at, there);
  }
  active.clamped = whole.normal == 0;
  if (pair.friction.has_state()) {
    const double spread = spread_of_arm(pair, shared->spread()).first;
    const double disc = disc_of_spread(spread, m.depth);
    std::visit([&](const auto& one) { one.add(whole, m, disc, scene.relaxation(pair)); },
               pair.friction.law);
    active.sliding = friction_power(whole, m);
  }
  f = whole;
}

// The ellipse in which two bodies touch, by Hertz's geometry (Johnson, Contact Mechanics, 4.2).
PatchRow PointForces::patch(SceneData& scene, const ActiveContact& active,
                            const ContactRow& row) const {
  const Pair& pair = scene.pair_of(active);
  if (!pair.has_sphere()) return unknown_patch(row.depth);
  const ContactShape gap =
      active.shape < 0 ? scene.shape_of(active.pair, pair, active.contact) : *scene.shape(active);
  const Eigen::Vector2d half = gap.half_axes(row.depth);
  const Vec3 axis = scene.state_of(active).world_from_j.rotation() * gap.axis;
  const double mean = row.normal_force / (M_PI * half[0] * half[1]);
  PatchRow out{{half[0], half[1]}, {}, 1.5 * mean, mean, row.depth};
  std::copy_n(axis.data(), 3, out.axis);
  return out;
}

void PointForces::slopes(const SceneData& scene, const ActiveContact& active,
                         const ContactSite& site, ContactSlopes& out) const {
  const Pair& pair = scene.pair_of(active);
  if (const SharedContact* shared = this->shared(active.contact))
    return slopes(pair, scene.relaxation(pair), *shared, site, out);
  contact_slopes(pair.law, pair.friction, scene.relaxation(pair), site, out);
}

// In the frame of the plane: of each place the law's slopes, and how the place, its share and the
// common depth follow the shell.
void PointForces::slopes(const Pair& pair, double relaxation, const SharedContact& shared,
                         const ContactSite& site, ContactSlopes& out) const {
  static const Mat3 kCarried = Mat3::Identity();
  const FrictionLaw friction = friction_of_places(pair);
  Matrix6 by = Matrix6::Zero();
  const auto [wide, wide_by] = spread_of_arm(pair, shared.spread());
  SpreadSlopes spread{wide, Matrix36::Zero(), Row6::Zero()};
  ContactSlopes one;
  ContactSite at = site;
  at.point_by = &kCarried;
  out.wrench.setZero(), out.by_twist.setZero();
  for (const SharedContact::Place& place : shared.places) {
    at.contact.point = at.place = place.point;
    contact_slopes(pair.law, friction, relaxation, at, one);
    out.wrench += place.share * one.wrench;
    out.by_twist += place.share * one.by_twist;
    by += place.share * (one.by_place * place.point_by + one.by_depth * shared.depth_by) +
          one.wrench * place.share_by;
    const Vec3 from = place.point - shared.point;
    spread.point_by += place.share * place.point_by + place.point * place.share_by;
    spread.spread_by +=
        from.squaredNorm() * place.share_by + 2 * place.share * from.transpose() * place.point_by;
  }
  spread.spread_by *= wide_by;
  if (pair.friction.has_state())
    add_bristle(pair.friction, relaxation, site, out.wrench[2], spread, by, out);
  out.by_place = by.leftCols<3>(), out.by_turn = by.rightCols<3>();
  out.depth_by_place = shared.depth_by.leftCols<3>();
  out.depth_by_turn = shared.depth_by.rightCols<3>();
  out.normal_by_place.setZero();
}

// At the same depth, so that only the laws, and where the contact is on the bodies, have changed.
bool PointForces::changed(SceneData& scene, const Pair& pair, const ActiveContact& active,
                          const ContactSite& site, ContactSlopes& out) const {
  if (const SharedContact* shared = this->shared(active.contact)) {
    slopes(pair, scene.relaxation(pair), *shared, site, out);
    return true;
  }
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
