#include "contact/query/query.hpp"

#include <type_traits>

#include "contact/query/curved_query.hpp"
#include "contact/faces/rings.hpp"
#include "contact/query/flat_query.hpp"

namespace sphshell {
namespace {

// Whether a feature is on the border of an open sheet: no inside there.
bool is_on_rim(const Shell& shell, const Minimum& at) {
  if (at.contact.feature == Feature::Face) return false;
  const Topology& topology = shell.topology();
  const int h = shell.half_edge(3 * at.facet + at.index);
  if (at.contact.feature == Feature::Edge) return topology.edge_at(h).on_rim();
  return topology.vertex_on_rim[shell.vertex(h)];
}

// The pseudo-normal of the feature that a contact is on: the sum of the faces' normals weighted by
// their angles at a vertex, of both faces at an edge (Baerentzen and Aanaes, IEEE TVCG 11 (2005)
// 243): its sign tells inside from outside for a closest point.
Vec3 feature_normal(const Shell& shell, const Minimum& at) {
  const Topology& topology = shell.topology();
  const int h = shell.half_edge(3 * at.facet + at.index);
  if (at.contact.feature == Feature::Vertex) return topology.vertex_normal[shell.vertex(h)];
  if (at.contact.feature == Feature::Edge) return topology.edge_normal(topology.edge_at(h));
  return at.behind ? Vec3(-at.contact.normal) : at.contact.normal;
}

// Whether a feature faces what touches it. On a border there is no inside: such features face all.
template <class Probe>
bool faces(const Shell& shell, const Probe& probe, const Minimum& at) {
  const double sign = shell.side() == Side::Outside ? 1.0 : -1.0;
  if (at.contact.feature == Feature::Face) return at.behind == (sign < 0);
  return is_on_rim(shell, at) ||
         sign * feature_normal(shell, at).dot(probe.pull(at.contact.point)) >= 0;
}

// Of a plane the features that face it count.
void keep_one_side(const Shell& shell, const Plane& plane, std::vector<Minimum>& minima) {
  erase_if(minima, [&](const Minimum& at) { return !faces(shell, plane, at); });
}

// side = outside | inside: the nearest contact tells on which side the center is. On the right side
// count the contacts whose feature faces the center; on the wrong side the sphere is pushed back
// out through the nearest point.
void keep_one_side(const Shell& shell, const Sphere& sphere, std::vector<Minimum>& minima) {
  const double sign = shell.side() == Side::Outside ? 1.0 : -1.0;
  const auto faces_center = [&](const Minimum& at) { return faces(shell, sphere, at); };
  const auto nearest = std::max_element(
      minima.begin(), minima.end(),
      [](const Minimum& a, const Minimum& b) { return a.contact.depth < b.contact.depth; });
  if (!faces_center(*nearest)) {
    Minimum out = *nearest;
    out.contact.normal = -out.contact.normal;
    out.contact.dn_dc = -out.contact.dn_dc;
    out.contact.depth = 2 * sphere.radius - out.contact.depth;
    out.contact.group = -1;
    // On the wrong side the depth counts from the far side of the sphere: r + distance.
    minima.assign(1, out);
    return;
  }
  erase_if(minima, [&](const Minimum& at) { return !faces_center(at); });
  for (Minimum& at : minima)
    if (at.contact.depth == sphere.radius)
      // The center is on the surface, where its direction is undefined.
      at.contact.normal = sign * feature_normal(shell, at).normalized();
}

// The paper's sum: every element within reach counts, at its closest point.
void find_elements(const Shell& shell, const Sphere& sphere, BroadPhase& broad,
                   std::vector<Contact>& contacts) {
  const Vec3& center = sphere.center;
  const Topology& topology = shell.topology();
  const std::vector<int>& element = shell.element();
  const auto closest = [&](int t) {
    return closest_on_triangle(center, shell.corners(t).data(), topology.face_normal[t]);
  };
  const int last = static_cast<int>(element.size()) - 1;
  // Of the two triangles of a quad, neighbors in the list, the nearer one counts.
  const auto is_nearest_of_element = [&](int t, double d2) {
    for (int u : {t - 1, t + 1}) {
      if (u < 0 || u > last || element[u] != element[t]) continue;
      const double other2 = (center - closest(u).point).squaredNorm();
      if (other2 < d2 || (other2 == d2 && u < t)) return false;
    }
    return true;
  };
  broad.find(shell, shell.cones(), 0, sphere);
  for (int f : broad.overlapping) {
    const int t = shell.triangle_of_facet(f);
    const ClosestPoint at = closest(t);
    const double d2 = (center - at.point).squaredNorm();
    if (!sphere.reaches(at.point) || !is_nearest_of_element(t, d2)) continue;
    Feature feature = at.feature >= 4   ? Feature::Vertex
                      : at.feature >= 1 ? Feature::Edge
                                        : Feature::Face;
    if (feature == Feature::Edge && topology.edge_at(3 * t + at.feature - 1).inner)
      feature = Feature::Face;
    const Vec3& normal = topology.face_normal[t];
    const double height = normal.dot(center - at.point);
    if (shell.side() == Side::Outside && height < 0) continue;
    if (shell.side() == Side::Inside && height > 0) continue;
    contacts.push_back({at.point, direction(at.point, center, normal),
                        sphere.radius - std::sqrt(d2), element[t], feature});
  }
  std::sort(contacts.begin(), contacts.end(),
            [](const Contact& a, const Contact& b) { return a.element < b.element; });
}

}  // namespace

struct Query::Parts {
  explicit Parts(bool follow) : follow(follow), broad(follow) { minima.reserve(64); }

  bool follow, want_dn_dc = false;
  BroadPhase broad;
  FlatQuery flat;
  CurvedQuery curved;
  std::vector<Minimum> minima;
};

Query::Query(bool follow) : parts_(std::make_unique<Parts>(follow)) { contacts.reserve(64); }

Query::Query(const Query& other) : Query(other.parts_->follow) {
  parts_->want_dn_dc = other.parts_->want_dn_dc;
  contacts = other.contacts;
}

Query& Query::operator=(const Query& other) {
  Query copy(other);
  parts_.swap(copy.parts_);
  contacts.swap(copy.contacts);
  return *this;
}

Query::~Query() = default;

void Query::want_dn_dc() { parts_->want_dn_dc = true; }

const std::vector<Contact>& Query::find(const Shell& shell, const Vec3& center, double radius,
                                        Method method, bool rings) {
  contacts.clear();
  // Round-off grows with the coordinates, which are of the size of shell and sphere.
  const Sphere sphere{center, radius, kRoundOff * (shell.size() + radius)};
  if (method == Method::Elements) {
    find_elements(shell, sphere, parts_->broad, contacts);
    return contacts;
  }
  parts_->minima.clear();
  const Search<Sphere> search{shell, sphere, parts_->want_dn_dc, parts_->minima};
  if (method == Method::Smooth)
    parts_->curved.find(search, parts_->broad);
  else
    parts_->flat.find(search, parts_->broad);
  return list(shell, sphere, rings);
}

const std::vector<Contact>& Query::find_below(const Shell& shell, const Vec3& normal,
                                              double offset) {
  contacts.clear();
  parts_->minima.clear();
  const Plane plane{normal, offset, shell.size(), kRoundOff * shell.size()};
  parts_->curved.find(Search<Plane>{shell, plane, parts_->want_dn_dc, parts_->minima},
                      parts_->broad);
  return list(shell, plane, false);
}

// The contacts of the minima that were found.
template <class Probe>
const std::vector<Contact>& Query::list(const Shell& shell, const Probe& probe, bool rings) {
  std::vector<Minimum>& minima = parts_->minima;
  if (minima.empty()) return contacts;
  if (shell.side() != Side::Both) keep_one_side(shell, probe, minima);
  for (const Minimum& minimum : minima) {
    Contact& contact = contacts.emplace_back(minimum.contact);
    contact.rim = is_on_rim(shell, minimum);
    if constexpr (std::is_same_v<Probe, Sphere>)
      if (rings && minimum.off_axis < 1) contact = ring_of(minimum, probe);
    contact.facet = minimum.facet, contact.index = minimum.index;
  }
  // Deepest first, saddles last: the order must not depend on the numbering of the elements.
  if (contacts.size() > 1)
    std::sort(contacts.begin(), contacts.end(), [](const Contact& a, const Contact& b) {
      return a.weight != b.weight ? a.weight > b.weight
             : a.depth != b.depth ? a.depth > b.depth
                                  : a.element < b.element;
    });
  return contacts;
}

bool leads(const std::vector<Contact>& contacts, std::size_t i) {
  if (contacts[i].group < 0) return true;
  for (std::size_t j = 0; j < i; ++j)
    if (contacts[j].group == contacts[i].group) return false;
  return true;
}

Contact whole_of(const std::vector<Contact>& contacts, std::size_t i, const Vec3& center,
                 double radius) {
  Contact whole = contacts[i];
  if (whole.group < 0) return whole;
  whole.normal.setZero(), whole.dn_dc.setZero(), whole.point.setZero();
  whole.depth = 0;
  for (const Contact& c : contacts) {
    if (c.group != whole.group) continue;
    whole.depth += c.weight * c.depth;
    whole.normal += c.weight * c.normal;
    whole.dn_dc += c.dn_dc;
    whole.point += c.weight * c.point;
  }
  whole.normal.normalize();
  // As one contact its weight is 1, wherever the sphere is.
  whole.dn_dc -= (whole.normal * (whole.normal.transpose() * whole.dn_dc)).eval();
  // On the sphere's normal at the common depth, which need not be a point of the shell.
  if (radius > 0) whole.point = center - (radius - whole.depth) * whole.normal;
  return whole;
}

void merge_groups(const std::vector<Contact>& contacts, const Vec3& center, double radius,
                  std::vector<Contact>& shown) {
  shown.clear();
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (leads(contacts, i)) shown.push_back(whole_of(contacts, i, center, radius));
}

SurfacePoint on_curved(const Shell& shell, const Vec3& point, SurfacePoint at, Query& query) {
  // The curved surface is no farther from the flat one than the bulge: a sphere of this radius
  // reaches it.
  const double reach = std::abs(at.distance) + 1.01 * shell.curved()->bulge();
  const auto& found = query.find(shell, point, reach + 1e-9 * shell.size(), Method::Smooth, false);
  if (found.empty()) return at;
  const Contact& nearest = found.front();
  // Around an axis it may be far from the flat surface's closest point, and face the other way.
  if (nearest.feature == Feature::Face)
    at.normal = shell.topology().face_normal[shell.triangle_of_facet(nearest.facet)];
  const Vec3 from = point - nearest.point;
  at.normal = nearest.normal.dot(at.normal) < 0 ? Vec3(-nearest.normal) : nearest.normal;
  at.point = nearest.point;
  at.distance = from.dot(at.normal) < 0 ? -from.norm() : from.norm();
  at.element = nearest.element;
  return at;
}

}  // namespace sphshell
