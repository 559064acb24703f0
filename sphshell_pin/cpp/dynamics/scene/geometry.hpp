// What the sphere of a pair, or the shell of a plane, may touch on body j. Each kind of geometry
// answers the same questions, in the frame of body j: the rest of the scene does not ask which kind
// it is.
#pragma once

#include <pinocchio/spatial.hpp>
#include <variant>

#include "contact/laws/foundation.hpp"
#include "contact/query/query.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {

using SE3 = pinocchio::SE3;

// A user's own contact points: poses of both frames in, contacts (points and normals in the world,
// normals from j to i) out.
using ContactSource =
    std::function<void(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& contacts)>;

// Each kind has
// - kHasSphere: whether contacts follow the center of a sphere of known radius;
// - has_dn_dc: whether the derivative of a contact's normal is known;
// - find: the contacts of a sphere at a center, where pose_i() and pose_j are those of the frames;
// - find_near: weights and depths of the contacts of a sphere that is larger by the margin; the
//   depths are those of the sphere itself, negative where there is a gap;
// - overlap: the quadrature of an elastic foundation between sphere and body;
// - least_radius, disc_radius: see Pair;
// - curvature: of what it is made of, where that is the same everywhere [1/m];
// - smooth_shell: the shell whose curvature is to be looked up at each contact, or null;
// - nearest: where it is closest to a center, at any distance: the point, the normal there and the
//   depth, which is negative by the gap; an element of -1: there is nothing;
// - distance: a lower bound of the distance from a center to the body [m];
// - depth_behind: how deep a sphere is that touches nothing, but whose center is behind the
//   surface of a solid [m]; 0 elsewhere;
// - follow_size: moves a contact to where it is on a body of another size.

// What most kinds answer.
struct AnyGeometry {
  static constexpr bool kHasSphere = true;
  bool has_dn_dc() const { return true; }
  double least_radius(double radius) const { return radius; }
  double disc_radius(double radius) const { return radius; }
  double curvature() const { return 0; }
  const Shell* smooth_shell() const { return nullptr; }
  void find_near(const Vec3&, double, double, Query& query) const { query.contacts.clear(); }
  void overlap(Foundation&, const Vec3&, double, bool, bool) const {}
  double distance(const Vec3&) const { return 0; }
  double depth_behind(const Vec3&, double) const { return 0; }
  void follow_size(Contact&) const {}
};

// A surface of elements.
struct ShellSurface : AnyGeometry {
  std::shared_ptr<const Shell> shell;
  Method method = Method::Facets;

  bool has_dn_dc() const { return method != Method::Elements; }
  template <class Pose>
  void find(const Pose&, const SE3&, const Vec3& center, double radius, Query& query) const {
    query.find(*shell, center, radius, method);
  }
  void find_near(const Vec3& center, double radius, double margin, Query& query) const;
  Contact nearest(const SE3& pose_i, const SE3& pose_j, const Vec3& center, double radius,
                  Query& query) const;
  void overlap(Foundation& foundation, const Vec3& center, double radius, bool slopes,
               bool points) const {
    foundation.find(*shell, method, center, radius, slopes, points);
  }
  const Shell* smooth_shell() const { return method == Method::Smooth ? shell.get() : nullptr; }
  double distance(const Vec3& center) const;
  double depth_behind(const Vec3& center, double radius) const;
};

// A solid sphere about the origin of its frame.
struct Ball : AnyGeometry {
  double radius = 0;  // [m]

  template <class Pose>
  void find(const Pose&, const SE3&, const Vec3& center, double other, Query& query) const {
    find(center, other, query.contacts);
  }
  void find(const Vec3& center, double other, std::vector<Contact>& contacts) const;
  void find_near(const Vec3& center, double other, double margin, Query& query) const;
  Contact nearest(const SE3& pose_i, const SE3& pose_j, const Vec3& center, double other,
                  Query& query) const;
  void overlap(Foundation& foundation, const Vec3& center, double other, bool, bool points) const {
    foundation.find_on_ball(radius, center, other, points);
  }
  double least_radius(double other) const { return std::min(other, radius); }
  // 1 / r = 1 / r_1 + 1 / r_2.
  double disc_radius(double other) const { return other * (radius / (other + radius)); }
  double curvature() const { return 1 / radius; }
  double distance(const Vec3& center) const { return center.norm() - radius; }
  void follow_size(Contact& contact) const { contact.point = radius * contact.normal; }
};

// A plane with a solid below, z = 0 of its frame, that the shell of body i may touch: as points
// that keep their normal, and go to where the shell is lowest.
struct PlaneBelow : AnyGeometry {
  static constexpr bool kHasSphere = false;
  std::shared_ptr<const Shell> shell;

  // What the shell can lie on.
  const Flats& flats() const { return shell->curved()->flats(*shell); }

  bool has_dn_dc() const { return false; }
  template <class Pose>
  void find(const Pose& pose_i, const SE3& pose_j, const Vec3&, double, Query& query) const {
    find(pose_j.actInv(pose_i()), 0, query);
  }
  // Those of points up to a height above the plane as well, of a negative depth.
  void find(const SE3& plane_from_shell, double height, Query& query) const;
  Contact nearest(const SE3& pose_i, const SE3& pose_j, const Vec3& center, double radius,
                  Query& query) const;
};

// Points that a user's function finds, of whose geometry nothing else is known.
struct SourcePoints : AnyGeometry {
  static constexpr bool kHasSphere = false;
  ContactSource source;

  bool has_dn_dc() const { return false; }
  template <class Pose>
  void find(const Pose& pose_i, const SE3& pose_j, const Vec3&, double, Query& query) const {
    std::vector<Contact>& found = query.contacts;
    find(pose_i(), pose_j, found);
    erase_if(found, [](const Contact& one) { return !(one.depth > 0); });
  }
  // Those of no depth, too.
  void find(const SE3& pose_i, const SE3& pose_j, std::vector<Contact>& contacts) const;
  Contact nearest(const SE3& pose_i, const SE3& pose_j, const Vec3& center, double radius,
                  Query& query) const;
};

using Geometry = std::variant<ShellSurface, Ball, PlaneBelow, SourcePoints>;

}  // namespace sphshell
