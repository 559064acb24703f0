// Minima of the distance as the queries find them, before a shell's side is looked at.
#pragma once

#include <numeric>

#include "contact/query/contact.hpp"
#include "contact/query/tolerances.hpp"
#include "shell/shell.hpp"

namespace sphshell {

// A contact, and where on the shell it is.
struct Minimum {
  Contact contact;
  int facet;    // that holds it
  int index;    // its side or corner, of an edge or a vertex
  bool behind;  // of a face: the center is on its inner side
  // Of a ring: its axis, unit, and how far off it the center is, below 1 (see ring_of()).
  Vec3 axis = Vec3::Zero();
  double off_axis = 1;
};

// From a point of the shell to the center, unit; `if_equal` where both are one.
inline Vec3 direction(const Vec3& point, const Vec3& center, const Vec3& if_equal) {
  const Vec3 d = center - point;
  const double length = d.norm();
  return length > 0 ? Vec3(d / length) : if_equal;
}

// The contact at a point of the shell; `outward`: there, where the center is as good as at it.
inline Contact contact_at(const Vec3& point, const Vec3& outward, const Sphere& sphere, int element,
                          Feature feature) {
  const Vec3 from = sphere.center - point;
  const double distance = from.norm();
  const Vec3 normal = distance > kAtSurface * sphere.radius ? Vec3(from / distance)
                      : from.dot(outward) < 0               ? Vec3(-outward)
                                                            : outward;
  return {point, normal, sphere.radius - distance, element, feature};
}

inline Contact contact_at(const Vec3& point, const Vec3&, const Plane& plane, int element,
                          Feature feature) {
  return {point, plane.normal, plane.depth(point), element, feature};
}

// What a contact keeps of how its point follows the probe: how the normal changes with the center,
// where the contact point follows it by dx_dc (3, 3); of a plane that itself.
inline Mat3 slopes_of(const Contact& contact, const Sphere& sphere, const Mat3& dx_dc) {
  const double distance = sphere.radius - contact.depth;
  if (!(distance > 0)) return Mat3::Zero();
  const Vec3& n = contact.normal;
  // n = (c - x) / d: dn = (I - n n^T)(dc - dx) / d, and dx is tangential already.
  return (Mat3::Identity() - n * n.transpose() - dx_dc) / distance;
}

inline Mat3 slopes_of(const Contact&, const Plane&, const Mat3& dx_dn) { return dx_dn; }

// What a query looks for, on which shell, and what it has found.
template <class Probe>
struct Search {
  const Shell& shell;
  const Probe& probe;
  bool want_dn_dc;
  std::vector<Minimum>& minima;

  // The minimum at a point of a facet; `index`: of its side or corner, dx_dc(): how the point
  // follows the probe (3, 3).
  template <class Follow>
  Minimum at(int facet, int index, Feature feature, const Vec3& point, const Vec3& outward,
             const Follow& dx_dc) const {
    Contact contact = contact_at(point, outward, probe, shell.facets()[facet].element, feature);
    if (want_dn_dc) contact.dn_dc = slopes_of(contact, probe, dx_dc());
    return {contact, facet, index, probe.pull(point).dot(outward) < 0};
  }

  // At a corner, which does not move with the probe.
  Minimum at_corner(int facet, int corner) const {
    const Facet& at_facet = shell.facets()[facet];
    return at(facet, corner, Feature::Vertex, at_facet.corner[corner], at_facet.normal,
              []() -> Mat3 { return Mat3::Zero(); });
  }
};

// The minimum within a flat facet, over which the center is at a height.
inline Minimum over_facet(int f, const Facet& facet, double height, const Sphere& sphere) {
  const Vec3 away = height < 0 ? Vec3(-facet.normal) : facet.normal;
  return {{sphere.center - height * facet.normal, away, sphere.radius - std::abs(height),
           facet.element, Feature::Face},
          f,
          0,
          height < 0};
}

// Calls visit(i, j), i < j, for minima that are no farther apart than `tolerance`; by_x: scratch.
// Sorted along x only neighbors are compared.
template <class Visit>
void for_each_near(const std::vector<Minimum>& minima, double tolerance, std::vector<int>& by_x,
                   Visit&& visit) {
  const auto point = [&](int i) -> const Vec3& { return minima[i].contact.point; };
  by_x.resize(minima.size());
  std::iota(by_x.begin(), by_x.end(), 0);
  std::sort(by_x.begin(), by_x.end(), [&](int i, int j) { return point(i).x() < point(j).x(); });
  for (std::size_t a = 0; a < by_x.size(); ++a)
    for (std::size_t b = a + 1; b < by_x.size(); ++b) {
      const Vec3 apart = point(by_x[b]) - point(by_x[a]);
      if (apart.x() > tolerance) break;
      if (apart.squaredNorm() > tolerance * tolerance) continue;
      const auto [first, second] = std::minmax(by_x[a], by_x[b]);
      visit(first, second);
    }
}

}  // namespace sphshell
