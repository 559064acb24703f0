#include "contact/faces/rings.hpp"

#include "contact/query/broad_phase.hpp"
#include "shell/curved/curved.hpp"

namespace sphshell {
namespace {

// Nearer to the axis than this share of the circle's radius, and rounding, a center is on it.
constexpr double kOnRing = 1e-9, kRounding = 1e-11;

// 0 within rounding of the axis, 1 where the circle no longer counts.
double share_of(double off) { return std::max(0.0, off - kRounding) / kOnRing; }

// A circle about an axis, and how far off that axis a center is, as a share of kOnRing.
struct Circle {
  Vec3 axis, middle;
  double radius, off;
};

// The parallel circle of a surface of revolution through the closest point.
bool circle_of_face(const Primitive& shape, const Vec3& foot, const Vec3& center, Circle& out) {
  if (shape.kind == FaceKind::Plane || shape.kind == FaceKind::Sphere) return false;
  const auto beside = [&](const Vec3& x) -> Vec3 {
    const Vec3 y = x - shape.point;
    return y - y.dot(shape.axis) * shape.axis;
  };
  const Vec3 off = beside(foot);
  out.radius = off.norm();
  out.off = share_of(beside(center).norm() / out.radius);
  if (!(out.off < 1)) return false;
  out.axis = shape.axis;
  out.middle = foot - off;
  return true;
}

// Whether the circle is on the face all around: no border cuts it.
bool is_whole(const Shell& shell, int face, const Circle& circle, const Sphere& sphere,
              const Vec3& foot, const Vec3& normal) {
  const CurvedShell& surface = *shell.curved();
  BroadPhase near(false);
  near.find(shell, surface.cones(), surface.bulge(), sphere);
  // In the half-plane through the axis: the normal, and the tangent across the circle.
  const Vec3 outward = (foot - circle.middle) / circle.radius;
  const double n_off = normal.dot(outward), n_along = normal.dot(circle.axis);
  // Returns the place of x along the tangent across the circle; `away`: along the normal.
  const auto across = [&](const Vec3& x, double& away) {
    const Vec3 y = x - circle.middle;
    const double along = y.dot(circle.axis), off = (y - along * circle.axis).norm();
    away = n_off * (off - circle.radius) + n_along * along;
    return n_off * along - n_along * (off - circle.radius);
  };
  for (const int f : near.candidates) {
    const FaceCell& cell = surface.face_cells()[f];
    if (cell.face != face) continue;
    for (int k = 0; k < 3; ++k) {
      if (cell.side[k] == FaceCell::Side::Inner) continue;
      double away[2];
      const double begin = across(shell.facets()[f].corner[k], away[0]);
      const double end = across(shell.facets()[f].corner[next_corner(k)], away[1]);
      // The other side of a torus' tube is another circle.
      if (std::max(std::abs(away[0]), std::abs(away[1])) > circle.radius) continue;
      // A side that is parallel to the circle cuts it only if it is the circle.
      const bool level = std::abs(begin - end) <= surface.gap();
      const double reach = level ? 0 : surface.gap() + double(cell.bulge[k]);
      if (std::min(begin, end) < reach && std::max(begin, end) > -reach &&
          !(level && std::abs(begin) <= surface.gap()))
        return false;
    }
  }
  return true;
}

// The osculating circle of the curve in which two faces meet: a center on its axis is as far from
// all of it. That is where 1 + (foot - center) . curvature, the second derivative of half the
// square of the distance along the curve, vanishes.
bool circle_of_border(const Shell& shell, const Minimum& at, const Vec3& center, Circle& out) {
  const CurvedShell& surface = *shell.curved();
  const FaceCell& cell = surface.face_cells()[at.facet];
  if (cell.face < 0 || cell.side[at.index] != FaceCell::Side::Border) return false;
  const Vec3& foot = at.contact.point;
  const Faces& faces = surface.faces();
  const Intersection here = faces.joints[cell.joint[at.index]].at(faces.shapes, foot);
  out.off = share_of(std::abs(1 + (foot - center).dot(here.curvature)));
  const double bend = here.curvature.norm();
  if (!(out.off < 1) || !(bend > 0)) return false;
  out.radius = 1 / bend;
  out.middle = foot + here.curvature / (bend * bend);
  out.axis = here.tangent.cross(here.curvature) / bend;
  return true;
}

// The angle [rad] of a side about the axis of its circle, accurate up to half a turn.
double angle_of(const Shell& shell, const Minimum& at, const Circle& circle) {
  const Facet& facet = shell.facets()[at.facet];
  const Vec3 p = facet.corner[at.index] - circle.middle;
  const Vec3 q = facet.corner[next_corner(at.index)] - circle.middle;
  return std::atan2(std::abs(p.cross(q).dot(circle.axis)), p.dot(q));
}

// The rest of the query reads these two.
void mark(Minimum& minimum, const Circle& circle) {
  minimum.axis = circle.axis, minimum.off_axis = circle.off;
}

}  // namespace

void find_rings(const Shell& shell, const Sphere& sphere, std::vector<Minimum>& minima) {
  // Faces of revolution by their own axis; borders by the circle that their sides share.
  constexpr double kTurn = 6.283185307179586;
  const CurvedShell& surface = *shell.curved();
  const auto is_border = [](const Minimum& at) { return at.contact.feature == Feature::Edge; };
  Circle circle;
  for (Minimum& at : minima) {
    const Vec3& foot = at.contact.point;
    const FaceCell& cell = surface.face_cells()[at.facet];
    if (at.contact.feature == Feature::Face && cell.closed &&
        circle_of_face(surface.faces().shapes[cell.face], foot, sphere.center, circle) &&
        is_whole(shell, cell.face, circle, sphere, foot, at.contact.normal))
      mark(at, circle);
    if (!is_border(at) || at.off_axis < 1) continue;
    if (!circle_of_border(shell, at, sphere.center, circle)) continue;
    // Sides are of one circle if its middle and radius agree.
    const double same = 1e-6 * circle.radius;
    const auto on_circle = [&](const Minimum& other) {
      Circle its;
      return is_border(other) && circle_of_border(shell, other, sphere.center, its) &&
             (its.middle - circle.middle).norm() < same &&
             std::abs(its.radius - circle.radius) < same;
    };
    // The sides must make a full turn: else it is an arc with ends, whose corners count.
    double turn = 0;
    for (const Minimum& other : minima)
      if (on_circle(other)) turn += angle_of(shell, other, circle);
    if (!(turn > (1 - 1e-6) * kTurn)) continue;
    const auto is_corner_of_it = [&](const Minimum& other) {
      const Vec3 from = other.contact.point - circle.middle;
      return other.contact.feature == Feature::Vertex &&
             std::abs(from.norm() - circle.radius) < surface.gap() &&
             std::abs(from.dot(circle.axis)) < surface.gap();
    };
    for (Minimum& other : minima)
      if (on_circle(other) || is_corner_of_it(other)) mark(other, circle);
  }
}

// The component of the normal across the axis fades with the distance from the axis.
Contact ring_of(const Minimum& minimum, const Sphere& sphere) {
  Contact out = minimum.contact;
  const Vec3 level = out.normal.dot(minimum.axis) * minimum.axis;
  out.normal = level + minimum.off_axis * (out.normal - level);
  out.point = sphere.center - (sphere.radius - out.depth) * out.normal;
  out.feature = Feature::Ring;
  out.dn_dc.setZero();
  return out;
}

}  // namespace sphshell
