#include "dynamics/scene/geometry.hpp"

namespace sphshell {

static bool is_closed(const Shell& shell) {
  const std::vector<Edge>& edges = shell.topology().edges;
  return std::none_of(edges.begin(), edges.end(), [](const Edge& edge) { return edge.count == 1; });
}

void ShellSurface::find_near(const Vec3& center, double radius, double margin, Query& query) const {
  query.find(*shell, center, radius + margin, method);
  for (Contact& contact : query.contacts) contact.depth -= margin;
}

Contact ShellSurface::nearest(const SE3&, const SE3&, const Vec3& center, double radius,
                              Query& query) const {
  SurfacePoint at = shell->closest_point(center);
  if (method == Method::Smooth) at = on_curved(*shell, center, at, query);
  const double outside = shell->side() == Side::Both      ? std::abs(at.distance)
                         : shell->side() == Side::Outside ? at.distance
                                                          : -at.distance;
  const Vec3 away = center - at.point;
  const double length = away.norm();
  return {at.point, length > 0 ? Vec3(away / length) : at.normal, radius - outside, at.element,
          Feature::Face};
}

// A curved element is off its flat one by the bulge at most.
double ShellSurface::distance(const Vec3& center) const {
  const double distance = std::abs(shell->closest_point(center).distance);
  const bool is_curved = method == Method::Smooth && shell->curved() != nullptr;
  return is_curved ? distance - shell->curved()->bulge() : distance;
}

// Of a shell with one side that encloses a volume: elsewhere there is no inside.
double ShellSurface::depth_behind(const Vec3& center, double radius) const {
  if (shell->side() == Side::Both) return 0;
  const double distance = shell->closest_point(center).distance;
  const double outside = shell->side() == Side::Outside ? distance : -distance;
  return outside < 0 && is_closed(*shell) ? radius - outside : 0;
}

void PlaneBelow::find(const SE3& plane_from_shell, double height, Query& query) const {
  const Mat3& turn = plane_from_shell.rotation();
  const Vec3 up = turn.row(2);
  const double offset = -plane_from_shell.translation().z();
  query.find_below(*shell, up, offset + height);
  for (Contact& contact : query.contacts) {
    if (height > 0) contact.depth = offset - up.dot(contact.point);
    // In the plane, over the lowest point: friction acts in the surface of the solid.
    contact.point = plane_from_shell.act(contact.point);
    contact.point.z() = 0;
    contact.normal = Vec3::UnitZ();
    contact.dn_dc = (turn * contact.dn_dc * turn.transpose()).eval();
  }
}

// At the point of the ball that is closest to the center of the other one. Of two spheres with one
// center any normal will do; one that is pressed through the ball's center comes out behind: it has
// no sides.
void Ball::find(const Vec3& center, double other, std::vector<Contact>& contacts) const {
  contacts.clear();
  const double distance = center.norm(), depth = other + radius - distance;
  if (!(depth > 0)) return;
  const Vec3 normal = distance > 0 ? Vec3(center / distance) : Vec3::UnitZ();
  Contact& contact =
      contacts.emplace_back(Contact{radius * normal, normal, depth, 0, Feature::Face});
  if (distance > 0) contact.dn_dc = (Mat3::Identity() - normal * normal.transpose()) / distance;
  contact.rim = true;
}

// At any distance, so that the depth can be followed through zero.
void Ball::find_near(const Vec3& center, double other, double, Query& query) const {
  const double depth = other + radius - center.norm();
  query.contacts.assign(1, Contact{Vec3::Zero(), Vec3::Zero(), depth, 0, Feature::Face});
}

Contact Ball::nearest(const SE3&, const SE3&, const Vec3& center, double other, Query&) const {
  const double length = center.norm();
  const Vec3 normal = length > 0 ? Vec3(center / length) : Vec3(Vec3::UnitZ());
  return {radius * normal, normal, other + radius - length, 0, Feature::Face};
}

Contact PlaneBelow::nearest(const SE3& pose_i, const SE3& pose_j, const Vec3&, double,
                            Query&) const {
  const SE3 plane_from_shell = pose_j.actInv(pose_i);
  const Vec3 up = plane_from_shell.rotation().row(2);
  const std::vector<Vec3>& vertices = shell->vertices();
  const auto lowest =
      std::min_element(vertices.begin(), vertices.end(),
                       [&](const Vec3& a, const Vec3& b) { return up.dot(a) < up.dot(b); });
  const Vec3 point = plane_from_shell.act(*lowest);
  return {point, Vec3::UnitZ(), -point.z(), 0, Feature::Face};
}

void SourcePoints::find(const SE3& pose_i, const SE3& pose_j,
                        std::vector<Contact>& contacts) const {
  contacts.clear();
  source(pose_i, pose_j, contacts);
  for (Contact& contact : contacts) {
    contact.point = pose_j.actInv(contact.point);
    contact.normal = pose_j.rotation().transpose() * contact.normal;
  }
}

Contact SourcePoints::nearest(const SE3& pose_i, const SE3& pose_j, const Vec3&, double,
                              Query& query) const {
  std::vector<Contact>& contacts = query.contacts;
  find(pose_i, pose_j, contacts);
  const auto deepest =
      std::max_element(contacts.begin(), contacts.end(),
                       [](const Contact& a, const Contact& b) { return a.depth < b.depth; });
  return deepest == contacts.end() ? Contact{Vec3::Zero(), Vec3::Zero(), 0, -1, Feature::Face}
                                   : *deepest;
}

}  // namespace sphshell
