// Contacts with curved elements: each minimum of the distance to a smooth patch once.
#include <algorithm>
#include <cmath>
#include <limits>

#include "contact/query.hpp"
#include "contact/regions.hpp"
#include "shell/curved.hpp"

namespace sphshell {
namespace {

// Newton's iterations end with the step after one below this, in units of the element: errors
// square.
constexpr double kSettled = 1e-7;
constexpr int kMostIterations = 20;
// A foot point counts this far outside its element; what two elements claim is then told apart.
constexpr double kOverlap = 1e-9;
// In Query::carrier_face_, in place of the planar face that carries a contact.
constexpr int kSharp = -2, kCurved = -1;

struct PatchPoint {
  double u, v;
  Vec3 point;
};

// The foot of x on the curved element, by Newton's method on |x - p(u, v)|^2 / 2 from the foot on
// the flat one. False where it lies outside, or is no minimum.
bool foot_on_patch(const Facet& facet, const CubicPatch& patch, const Vec3& x, PatchPoint& out) {
  const Vec3 e1 = facet.corner[1] - facet.corner[0], e2 = facet.corner[2] - facet.corner[0];
  const Vec3 d = x - facet.corner[0];
  const double a = e1.dot(e1), b = e1.dot(e2), c = e2.dot(e2), p = d.dot(e1), q = d.dot(e2);
  const double area2 = a * c - b * b;
  double u = (c * p - b * q) / area2, v = (a * q - b * p) / area2;
  // Start inside: far from the element the cubic says nothing about the surface.
  u = std::clamp(u, 0.0, 1.0);
  v = std::clamp(v, 0.0, 1.0 - u);
  bool settled = false, convex = false;
  for (int i = 0; i < kMostIterations && !settled; ++i) {
    const Vec3 xu = patch.along_u(u, v), xv = patch.along_v(u, v);
    const Vec3 r = patch.point(u, v) - x;
    const double gu = r.dot(xu), gv = r.dot(xv);
    double huu = xu.dot(xu), huv = xu.dot(xv), hvv = xv.dot(xv);
    const double fuu = huu + r.dot(patch.along_uu(u, v));
    const double fuv = huv + r.dot(patch.along_uv(u, v));
    const double fvv = hvv + r.dot(patch.along_vv(u, v));
    // Where the distance is not convex, its first-order part is: it leads downhill all the same.
    convex = fuu > 0 && fuu * fvv - fuv * fuv > 1e-9 * huu * hvv;
    if (convex) huu = fuu, huv = fuv, hvv = fvv;
    const double determinant = huu * hvv - huv * huv;
    double du = -(hvv * gu - huv * gv) / determinant;
    double dv = -(huu * gv - huv * gu) / determinant;
    const double length = std::max(std::abs(du), std::abs(dv));
    if (length > 0.5) du *= 0.5 / length, dv *= 0.5 / length;
    u += du, v += dv;
    settled = length < kSettled;
    if (std::max({-u, -v, u + v - 1}) > 1) return false;
  }
  if (!settled || !convex || std::max({-u, -v, u + v - 1}) > kOverlap) return false;
  out = {u, v, patch.point(u, v)};
  return true;
}

// The parameter of the point nearest to x on a side; false where it lies beyond the side's ends.
bool foot_on_side(const CubicCurve& side, const Vec3& x, double& t) {
  const Vec3 d = side.point(1) - side.c0;
  t = std::clamp((x - side.c0).dot(d) / d.squaredNorm(), 0.0, 1.0);
  for (int i = 0; i < kMostIterations; ++i) {
    const Vec3 tangent = side.tangent(t);
    const Vec3 r = side.point(t) - x;
    const double first = tangent.squaredNorm();
    const double full = first + r.dot(side.second(t));
    double step = -r.dot(tangent) / (full > 1e-3 * first ? full : first);
    step = std::clamp(step, -0.5, 0.5);
    t += step;
    if (std::abs(step) < kSettled) break;
    if (t < -1 || t > 2) return false;
  }
  if (t < -kOverlap || t > 1 + kOverlap) return false;
  t = std::clamp(t, 0.0, 1.0);
  return true;
}

// True where the distance from x to half-edge h's facet does not fall when one leaves its side at
// `point` (the side's parameter t) inward.
bool leaves_no_lower(const Shell& shell, int h, double t, const Vec3& point, const Vec3& x,
                     double tolerance) {
  const int f = triangle_of(h), k = side_of(h);
  const Vec3 inward = shell.curved()->facets()[f].patch(shell.facets()[f]).inward(k, t);
  return (x - point).dot(inward) <= tolerance * inward.norm();
}

}  // namespace

void Query::find_smooth(const Shell& shell, const Vec3& centre, double radius) {
  const double tolerance = kTolerance * (shell.size() + radius);
  carriers_.clear();
  carrier_face_.clear();
  claim_on_patches(shell, centre, radius, tolerance);
  if (contacts.empty()) return;
  if (contacts.size() > 1) keep_one_per_minimum(shell, radius);
  if (shell.side() != Side::Both) keep_one_side(shell, centre, radius);
}

void Query::claim_on_patches(const Shell& shell, const Vec3& centre, double radius,
                             double tolerance) {
  const CurvedShell& surface = *shell.curved();
  const Topology& topology = shell.topology();
  const double reach2 = radius * radius, tolerance2 = tolerance * tolerance;
  const bool one_sided = shell.side() != Side::Both;
  const auto add = [&](const Vec3& point, const Vec3& normal, int element, Feature feature,
                       bool sharp, const Vec3& outward, bool rim) {
    contacts.push_back({point, normal, radius - (centre - point).norm(), element, feature});
    carrier_face_.push_back(sharp ? kSharp : kCurved);
    if (one_sided) carriers_.push_back({outward, rim});
  };
  gather(shell, surface.cones(), surface.bulge(), centre, radius);
  over_.clear();
  for (int f : near_) {
    const Facet& facet = shell.facets()[f];
    // The centre stands over a contact along a normal that leans at most by the opening of the
    // facet's cone, so its shadow falls within `lean` of the feature that holds the contact.
    Shadow shadow;
    shadow.facet = f;
    shadow.height = facet.normal.dot(centre - facet.corner[0]);
    const double opening = surface.cones()[f].tan_opening;
    shadow.lean =
        opening >= kAnyOpening
            ? std::numeric_limits<double>::infinity()
            : surface.bulge() + tolerance + (std::abs(shadow.height) + surface.bulge()) * opening;
    for (int k = 0; k < 3; ++k) {
      const Vec3 edge = facet.corner[next_corner(k)] - facet.corner[k];
      const double inward = facet.normal.dot(edge.cross(centre - facet.corner[k]));
      shadow.outside[k] = -inward / edge.norm();
    }
    if (std::max({shadow.outside[0], shadow.outside[1], shadow.outside[2]}) > shadow.lean) continue;
    prefetch(&surface.facets()[f]);
    prefetch(reinterpret_cast<const char*>(&surface.facets()[f]) + 64);
    over_.push_back(shadow);
  }
  for (const Shadow& shadow : over_) {
    const int f = shadow.facet;
    const double height = shadow.height, lean = shadow.lean;
    const double* outside = shadow.outside;
    const Facet& facet = shell.facets()[f];
    const CurvedFacet& curved = surface.facets()[f];
    const int triangle = shell.triangle_of_facet(f);
    if (curved.flat) {
      SideTest side[3];
      for (int k = 0; k < 3; ++k) side[k] = test_side(facet, k, centre, tolerance2);
      if (!side[0].beyond && !side[1].beyond && !side[2].beyond && height * height < reach2) {
        contacts.push_back({centre - height * facet.normal,
                            height < 0 ? Vec3(-facet.normal) : facet.normal,
                            radius - std::abs(height), facet.element, Feature::Face});
        carrier_face_.push_back(facet.planar_face);
        if (one_sided) carriers_.push_back({facet.normal, false});
      }
    } else {
      PatchPoint foot;
      const CubicPatch patch = curved.patch(facet);
      if (foot_on_patch(facet, patch, centre, foot) &&
          (centre - foot.point).squaredNorm() < reach2) {
        const Vec3 outward = patch.along_u(foot.u, foot.v).cross(patch.along_v(foot.u, foot.v));
        add(foot.point, direction(foot.point, centre, outward.normalized()), facet.element,
            Feature::Face, false, outward, false);
      }
    }
    for (int k = 0; k < 3; ++k) {
      const int code = curved.owned.twin[k];
      double t = 0;
      if (code != kNotMine && outside[k] >= -lean &&
          foot_on_side(curved.side(facet, k), centre, t)) {
        const Vec3 point = curved.side(facet, k).point(t);
        const auto holds = [&](int h) {
          const Facet& other = shell.facets()[triangle_of(h)];
          const bool same_way = other.corner[side_of(h)] == facet.corner[k];
          return leaves_no_lower(shell, h, same_way ? t : 1 - t, point, centre, tolerance);
        };
        bool minimum = (centre - point).squaredNorm() < reach2 && holds(3 * f + k);
        if (minimum && code >= 0) minimum = holds(code);
        if (minimum && code <= kManifold) {
          const std::vector<int>& all = shell.half_edges_of(kManifold - code);
          minimum = std::all_of(all.begin(), all.end(), holds);
        }
        if (minimum) {
          const Edge& edge = topology.edges[topology.edge_of[3 * triangle + k]];
          add(point, direction(point, centre, facet.normal), facet.element, Feature::Edge,
              edge.kind != EdgeClass::Smooth, topology.edge_normal(edge), edge.on_rim());
        }
      }
      const int vertex = curved.owned.vertex[k];
      if (vertex < 0 || outside[k] < -lean || outside[previous_corner(k)] < -lean ||
          (centre - facet.corner[k]).squaredNorm() >= reach2)
        continue;
      const Vec3 from = centre - facet.corner[k];
      bool minimum = true;
      for (int i = topology.neighbour_begin[vertex];
           minimum && i < topology.neighbour_begin[vertex + 1]; ++i)
        minimum = from.dot(surface.tangents()[i]) <= tolerance * surface.tangents()[i].norm();
      if (minimum)
        add(facet.corner[k], direction(facet.corner[k], centre, facet.normal), facet.element,
            Feature::Vertex, bool(topology.vertex_sharp[vertex]), topology.vertex_normal[vertex],
            bool(topology.vertex_on_rim[vertex]));
    }
  }
}

// Deepest first; then one contact per place, and on a smooth patch one per minimum: elements meet
// there at angles that vanish with refinement, and what they hold within one contact disc (radius
// sqrt(r^2 - distance^2)) is one minimum of the surface they stand for. Two flat faces in a shallow
// groove stand for themselves.
void Query::keep_one_per_minimum(const Shell& shell, double radius) {
  by_x_.resize(contacts.size());
  for (std::size_t i = 0; i < by_x_.size(); ++i) by_x_[i] = static_cast<int>(i);
  std::sort(by_x_.begin(), by_x_.end(), [&](int i, int j) {
    const Contact &a = contacts[i], &b = contacts[j];
    return a.depth != b.depth ? a.depth > b.depth : a.element < b.element;
  });
  const double same = 1e-8 * radius;
  const std::vector<int>& patch = shell.topology().patch;
  std::vector<int>& kept = at_point_;
  kept.clear();
  for (int i : by_x_) {
    const Contact& contact = contacts[i];
    const bool covered = std::any_of(kept.begin(), kept.end(), [&](int j) {
      const Contact& deeper = contacts[j];
      const double apart2 = (deeper.point - contact.point).squaredNorm();
      if (apart2 <= same * same) return true;
      const double distance = radius - deeper.depth;
      const int a = carrier_face_[i], b = carrier_face_[j];
      const bool one_surface = a != kSharp && b != kSharp && (a == b || std::min(a, b) == kCurved);
      return one_surface && patch[deeper.element] == patch[contact.element] &&
             apart2 < radius * radius - distance * distance;
    });
    if (!covered) kept.push_back(i);
  }
  std::vector<Contact>& sorted = sorted_;
  sorted.clear();
  for (int i : kept) sorted.push_back(contacts[i]);
  if (!carriers_.empty()) {
    sorted_carriers_.clear();
    for (int i : kept) sorted_carriers_.push_back(carriers_[i]);
    carriers_.swap(sorted_carriers_);
  }
  contacts.swap(sorted);
}

}  // namespace sphshell
