#include "contact/faces/face_feet.hpp"

#include <type_traits>

#include "contact/query/closest_on_cell.hpp"
#include "contact/query/closest_on_side.hpp"

namespace sphshell {

// Nearer to an axis than this share of the radius, a center has no direction.
constexpr double kOnAxis = 1e-12;
constexpr int kMostRepeats = 20;
// Faces that cross at less than this (sine) overlap as if it were this: the gap times it is the
// rounding of a distance, below which its sign says nothing.
constexpr double kLeastSlope = 1e-7;

// The facets near the point are looked through; where it may be anywhere around an axis, those near
// the sphere, and towards each of them.
void FaceFeet::add_closest(const Search<Sphere>& search, int face) {
  const auto& [shell, sphere, want_dn_dc, minima] = search;
  const CurvedShell& surface = *shell.curved();
  const Region& region = surface.face_search()->of_face[face];
  const Primitive& shape = surface.faces().shapes[face];
  Vec3 normal;  // as the shape has it
  const double distance = shape.distance(sphere.center, normal);
  Vec3 point = sphere.center - distance * normal;
  if (!(std::abs(distance) < sphere.radius) || !(shape.radius_at(point) > 0)) return;
  const bool anywhere = shape.singular(sphere.center, kOnAxis);
  const double slack = surface.face_search()->slack;
  bool placed = !shape.has_parameters();
  Eigen::Vector2d place(0, 0);
  for (const int f : region.parts.find(anywhere ? sphere.center : point,
                                       anywhere ? sphere.radius : slack, room_)) {
    if (anywhere) {
      const NormalCone& cone = surface.cones()[f];
      const Vec3 middle = shell.origin() + Vec3(cone.middle[0], cone.middle[1], cone.middle[2]);
      shape.distance(sphere.center + 1e-6 * (middle - sphere.center), normal);
      point = sphere.center - distance * normal;
      placed = !shape.has_parameters();
      // The facet's ball excludes most facets before the exact test.
      const double reach = cone.reach + slack;
      if ((point - middle).squaredNorm() > reach * reach) continue;
    }
    const FaceCell& cell = surface.face_cells()[f];
    if (!placed) place = shape.parameters(point, shell.size()), placed = true;
    const Vec3 outward = cell.sign < 0 ? Vec3(-normal) : normal;
    if (!holds(shell, f, {point, outward, sphere.center, place}, sphere.tolerance + surface.gap()))
      continue;
    // Away from the face; where the center is on it, to the facet's side.
    const Vec3 away = distance == 0 ? outward : distance < 0 ? Vec3(-normal) : normal;
    Contact contact{point, away, sphere.radius - std::abs(distance), shell.facets()[f].element,
                    Feature::Face};
    // All around an axis the normal has no derivative.
    if (want_dn_dc && !anywhere)
      contact.dn_dc = (distance < 0 ? -1 : 1) * shape.hessian(sphere.center);
    minima.push_back({contact, f, 0, distance * cell.sign < 0});
    return;
  }
}

// Claims of earlier rounds do not count; cleared only for another surface, or where the counter
// wraps around.
void FaceFeet::clear(const CurvedShell& surface) {
  if (claimed_.size() == surface.faces().shapes.size() && of_ == &surface && ++round_ != 0) return;
  claimed_.assign(surface.faces().shapes.size(), 0);
  of_ = &surface;
  round_ = 1;
}

void FaceFeet::add_lowest(const Search<Plane>& search, int f) {
  const auto& [shell, plane, want_dx_dn, minima] = search;
  const CurvedShell& surface = *shell.curved();
  const FaceCell& cell = surface.face_cells()[f];
  const Primitive& shape = surface.faces().shapes[cell.face];
  const Vec3 &n = plane.normal, &axis = shape.axis;
  const bool torus = shape.kind == FaceKind::Torus;
  if (!torus && shape.kind != FaceKind::Sphere) return;
  if (claimed_[cell.face] == round_) return;
  const NormalCone& cone = surface.cones()[f];
  const Vec3 middle = shell.origin() + Vec3(cone.middle[0], cone.middle[1], cone.middle[2]);
  Vec3 down = axis.dot(n) * axis - n;  // of a torus: from the axis to where it is lowest
  const double slant = down.norm();
  // A level torus is as low all around: below every facet, which are then one.
  const bool anywhere = torus && slant < kOnAxis;
  if (anywhere) down = middle - shape.point - axis.dot(middle - shape.point) * axis;
  const Vec3 out = down.normalized();
  const Vec3 point = torus ? Vec3(shape.point + shape.radius * out - shape.second * n)
                           : Vec3(shape.point - shape.radius * n);
  const double reach = cone.reach + 1e-6 * shell.size();
  if (!plane.reaches(point) || (point - middle).squaredNorm() > reach * reach) return;
  const Vec3 outward = cell.sign < 0 ? n : Vec3(-n);
  const Eigen::Vector2d place =
      torus ? shape.parameters(point, shell.size()) : Eigen::Vector2d(0, 0);
  if (!holds(shell, f, {point, outward, point, place}, plane.tolerance + surface.gap())) return;
  if (!anywhere) claimed_[cell.face] = round_;
  Minimum lowest = search.at(f, 0, Feature::Face, point, outward, [&]() -> Mat3 {
    const Mat3 across = Mat3::Identity() - n * n.transpose();
    Mat3 by = -(torus ? shape.second : shape.radius) * across;
    if (torus && !anywhere)
      by -= shape.radius / slant * (Mat3::Identity() - out * out.transpose()) *
            (Mat3::Identity() - axis * axis.transpose()) * across;
    return by;
  });
  lowest.behind = cell.sign < 0;
  minima.push_back(lowest);
}

// Whether a point is on the inner side of what bounds a facet on its side k. Inner: facets of a
// face are divided by straight lines of its parameters, those of planes and spheres by the planes
// through their chords and the face's normals. Border: by what divides the joint's faces. Cubic: by
// the curve itself.
static bool is_inside(const Shell& shell, int f, int k, const FacePoint& at, double tolerance) {
  const CurvedShell& surface = *shell.curved();
  const FaceCell& cell = surface.face_cells()[f];
  const Facet& facet = shell.facets()[f];
  if (cell.side[k] == FaceCell::Side::Inner) {
    const auto [inside, overlap] = within_line(surface.faces().shapes[cell.face], cell, facet, k,
                                               at.point, at.place, tolerance);
    // The first is seldom decided late: the second takes a root.
    return inside >= 0 || !(inside < -overlap);
  }
  const Vec3 &p = facet.corner[k], &q = facet.corner[next_corner(k)], d = q - p;
  const Vec3 in = at.outward.cross(d);
  const double inside = in.dot(at.point - p), bulge = double(cell.bulge[k]);
  // Farther from the chord than the curve bulges: the curve need not be looked at.
  if (inside * inside > bulge * bulge * in.squaredNorm()) return inside > 0;
  if (cell.side[k] == FaceCell::Side::Border) {
    const FaceJoint& joint = surface.faces().joints[cell.joint[k]];
    const bool crossing = joint.kind == FaceJoint::Kind::Crossing;
    Vec3 towards;
    const double away = joint.divide(cell.face, crossing ? at.point : at.center, towards);
    // The overlap is along the face: where both are nearly tangent the other one hardly falls
    // there.
    const double slope = crossing ? std::max(towards.cross(at.outward).norm(), kLeastSlope) : 1.0;
    return !(cell.turn[k] * away < -tolerance * slope);
  }
  const CubicCurve side = surface.facets()[f].side(facet, k);
  const double t = nearest_on_side(side, at.point);
  return !(at.outward.cross(side.tangent(t)).normalized().dot(at.point - side.point(t)) <
           -tolerance);
}

bool holds(const Shell& shell, int f, const FacePoint& at, double tolerance) {
  const CurvedShell& surface = *shell.curved();
  const FaceCell& cell = surface.face_cells()[f];
  // Not on the other side of the axis.
  if (!(at.outward.dot(Vec3(cell.upright[0], cell.upright[1], cell.upright[2])) > 0)) return false;
  for (int k = 0; k < 3; ++k)
    if (!is_inside(shell, f, k, at, tolerance)) return false;
  // Beyond the corner of a needle both of its lines may be nearer than the tolerance.
  if (surface.faces().shapes[cell.face].kind == FaceKind::Plane)
    for (int k = 0; k < 3; ++k) {
      const Facet& facet = shell.facets()[f];
      const int before = previous_corner(k);
      if (cell.side[k] != FaceCell::Side::Inner || cell.side[before] != FaceCell::Side::Inner)
        continue;
      const Vec3 from = at.point - facet.corner[k], ahead = facet.side(k),
                 back = facet.corner[before] - facet.corner[k];
      if (from.dot(ahead) >= 0 && from.dot(back) >= 0) continue;
      if (from.dot(ahead.normalized() + back.normalized()) < -tolerance) return false;
    }
  // Borders of facets beside this one that bulge into it count along their own chord.
  for (int i = cell.intruder; i >= 0; i = surface.intruders()[i].second) {
    const int g = triangle_of(surface.intruders()[i].first);
    const int k = side_of(surface.intruders()[i].first);
    const Vec3 &p = shell.facets()[g].corner[k], &q = shell.facets()[g].corner[next_corner(k)];
    const double along = (at.point - p).dot(q - p);
    if (along > 0 && along < (q - p).squaredNorm() && !is_inside(shell, g, k, at, tolerance))
      return false;
  }
  return true;
}

namespace {

// Where a pull along a side turns from forward to backward, between low and high where it has both
// signs: by the rule of false position (Illinois).
template <class Pull>
void find_rest(const Pull& pull, double low, double high, double first, double last) {
  for (int i = 0, side = 0; i < 40; ++i) {
    const double t = low + first / (first - last) * (high - low);
    const double moved = std::min(t - low, high - t), here = pull(t);
    if (here == 0 || !(moved > 1e-9)) break;
    if (here > 0) {
      low = t, first = here;
      if (side > 0) last /= 2;
    } else {
      high = t, last = here;
      if (side < 0) first /= 2;
    }
    side = here > 0 ? 1 : -1;
  }
}

// On the line of a face's parameters that divides two facets of it. False if it has none.
template <class Probe>
bool nearest_on_line(const Shell& shell, int f, int k, const Probe& probe, SideFoot& out) {
  const CurvedShell& surface = *shell.curved();
  const FaceCell& cell = surface.face_cells()[f];
  if (!cell.closed || cell.side[k] != FaceCell::Side::Inner) return false;
  const Primitive& shape = surface.faces().shapes[cell.face];
  const double *p = cell.place[k], *q = cell.place[next_corner(k)];
  if (!shape.has_parameters() || std::isnan(p[0]) || std::isnan(q[0])) return false;
  const double du = q[0] - p[0], dv = q[1] - p[1];
  const auto pull = [&](double t) {
    Vec3 along[2];
    out.t = t;
    out.point = shape.at({p[0] + t * du, p[1] + t * dv}, shell.size(), along);
    out.tangent = du * along[0] + dv * along[1];
    return probe.pull(out.point).dot(out.tangent);
  };
  const double last = pull(1), at_last = probe.depth(out.point);
  const double first = pull(0), at_first = probe.depth(out.point);
  if (first > 0 && last < 0)
    find_rest(pull, 0, 1, first, last);
  else if (first > 0 || (!(last < 0) && at_last > at_first))  // over a ridge both ends are near
    pull(1);
  return true;
}

// On the crossing of two faces, whose points are found one by one from those of the chord; from the
// cubic's closest point on. False where it is not followed so.
template <class Probe>
bool nearest_on_crossing(const Shell& shell, int f, int k, const Probe& probe, SideFoot& out) {
  const CurvedShell& surface = *shell.curved();
  const Faces& faces = surface.faces();
  const FaceJoint& joint = faces.joints[surface.face_cells()[f].joint[k]];
  if (!joint.followed()) return false;
  const Vec3 &p = shell.facets()[f].corner[k], &q = shell.facets()[f].corner[next_corner(k)];
  const auto pull = [&](double t) {
    out.t = t, out.tangent = joint.tangent_at(faces.shapes, p, q, t, out.point);
    return probe.pull(out.point).dot(out.tangent);
  };
  // From an end, or from where its parabola ends.
  const double length = (q - p).norm();
  const FaceJoint::End* const ends[2] = {joint.end_near(p, surface.gap()),
                                         joint.end_near(q, surface.gap())};
  const auto beside = [&](const FaceJoint::End* end) {
    return end ? std::clamp(end->least / length, 1e-6, 0.1) : 0;
  };
  const double least = beside(ends[0]), most = 1 - beside(ends[1]);
  const double t = std::clamp(out.t, least, most), middle = pull(t);
  const bool ahead = middle > 0;
  const double end = ahead ? most : least;
  // The first rest that way: in steps that double, as there may be several.
  double from = t, to = t, last = middle, next = middle;
  for (double step = 1.0 / 64; next != 0 && (next > 0) == ahead && to != end; step *= 2) {
    from = to, last = next;
    to = ahead ? std::min(end, to + step) : std::max(end, to - step);
    next = pull(to);
  }
  if (next != 0 && (next > 0) == ahead) {
    const Vec3& x = ahead ? q : p;
    const FaceJoint::End* parabola = ends[ahead ? 1 : 0];
    // Regions of features overlap by the gap: no center is between two of them.
    if (!parabola || !(probe.pull(x).dot(parabola->along) > -surface.gap())) {
      if (parabola || !(std::abs(next) < surface.gap()))
        out.t = ahead ? 1 : 0, out.point = x;
      else
        out.t = std::clamp(out.t, 1e-6, 1 - 1e-6);
      return true;
    }
    const Vec3 from_end = probe.pull(x);
    const double slope = std::max(from_end.dot(parabola->along), 0.0),
                 far = beside(parabola) * length;
    const double bend = Probe::kMetric - from_end.dot(parabola->curvature);
    const double s = bend * far > slope ? slope / bend : far;
    out.point = x + s * (parabola->along + s / 2 * parabola->curvature);
    out.tangent = (ahead ? -1 : 1) * (parabola->along + s * parabola->curvature).normalized();
  } else if (ahead && next < 0) {
    find_rest(pull, from, to, last, next);
  } else if (next > 0) {
    find_rest(pull, to, from, next, last);
  }
  return true;
}

}  // namespace

template <class Probe>
SideFoot nearest_on_side(const Shell& shell, int f, int k, const Probe& probe) {
  const CurvedShell& surface = *shell.curved();
  SideFoot out;
  if (!surface.face_cells().empty() && nearest_on_line(shell, f, k, probe, out)) return out;
  const LargeArray<FaceCell>& cells = surface.face_cells();
  const bool border = !cells.empty() && cells[f].side[k] == FaceCell::Side::Border;
  const FaceJoint* known = border ? &surface.faces().joints[cells[f].joint[k]] : nullptr;
  // A line or circle has its closest point in closed form, but from the axis.
  constexpr bool sphere = std::is_same_v<Probe, Sphere>;
  bool closed = false;
  if constexpr (sphere) closed = border && known->has_one_nearest(probe.center);
  if (!closed) {
    const CubicCurve side = surface.facets()[f].side(shell.facets()[f], k);
    out.t = nearest_on_side(side, probe);
    out.point = side.point(out.t);
    out.tangent = side.tangent(out.t);
    if (!cells.empty() && cells[f].face >= 0 && cells[f].side[k] == FaceCell::Side::Inner &&
        out.t > 0 && out.t < 1)
      out.point = surface.faces().shapes[cells[f].face].onto(out.point);
    if (!border) return out;
  }
  const FaceJoint& joint = *known;
  if (!closed && nearest_on_crossing(shell, f, k, probe, out)) return out;
  const std::vector<Primitive>& shapes = surface.faces().shapes;
  const Vec3 &p = shell.facets()[f].corner[k], &q = shell.facets()[f].corner[next_corner(k)];
  const Vec3 chord = q - p;
  // Along the half-edge's direction.
  const auto tangent_at = [&](const Vec3& x) -> Vec3 {
    const auto [tangent, curvature, offset, sine] = joint.at(shapes, x);
    // An end where both are tangent: the cross product of equal normals is rounding, and only where
    // Newton's method went says whether the nearest point is beyond it.
    if (!(sine > kLeastAngle)) return Vec3::Zero();
    return tangent.dot(chord) < 0 ? Vec3(-tangent) : tangent;
  };
  const double most = chord.norm() / 2;
  Vec3 x = out.point;
  if constexpr (sphere)
    if (closed) x = joint.nearest(probe.center), out.t = 0.5;
  for (int i = 0; i < kMostRepeats && !closed; ++i) {
    const Intersection here = joint.at(shapes, x);
    const Vec3 from = -probe.pull(x);
    // Newton's method on the curve that is the intersection of two faces: a step along the tangent
    // by the second-order expansion of the distance, and back onto both faces by `offset`. Where
    // the distance is not convex the step is that of steepest descent.
    const double bend = Probe::kMetric + from.dot(here.curvature);
    const double step =
        std::clamp(-from.dot(here.tangent) / (bend > 1e-4 ? bend : 1.0), -most, most);
    const Vec3 moved = here.offset + step * (here.tangent + step / 2 * here.curvature);
    x += moved;
    if (moved.squaredNorm() < 1e-30 * from.squaredNorm()) break;
  }
  // Beyond an end that end is the nearest. Regions of features overlap by `gap`: no center is
  // between two of them.
  const double gap = surface.gap();
  const bool before =
      probe.pull(p).dot(tangent_at(p)) <= -gap || (x - p).dot(chord) <= -gap * chord.norm();
  const bool after =
      probe.pull(q).dot(tangent_at(q)) >= gap || (q - x).dot(chord) <= -gap * chord.norm();
  if (before && !(after && probe.depth(q) > probe.depth(p))) {
    out.t = 0, out.point = p;
  } else if (after) {
    out.t = 1, out.point = q;
  } else {
    if (out.t <= 0 || out.t >= 1) out.t = 0.5;
    out.point = x;
    const Vec3 along = tangent_at(x);
    out.tangent = along.isZero(0) ? chord : along;
  }
  return out;
}

// On the curve of two faces as on any curve: tangent tangent^T over the second derivative of half
// the square of the distance.
template <class Probe>
Mat3 dx_dc_of(const Shell& shell, int f, int k, const SideFoot& foot, const Probe& probe) {
  const CurvedShell& surface = *shell.curved();
  if (!surface.face_cells().empty() && surface.face_cells()[f].side[k] == FaceCell::Side::Border) {
    const Faces& faces = surface.faces();
    const Intersection at =
        faces.joints[surface.face_cells()[f].joint[k]].at(faces.shapes, foot.point);
    const double bend = Probe::kMetric - probe.pull(foot.point).dot(at.curvature);
    return bend == 0 ? Mat3(Mat3::Zero())
                     : Mat3(probe.follow() * at.tangent * at.tangent.transpose() / bend);
  }
  return dx_dc_of(surface.facets()[f].side(shell.facets()[f], k), foot.t, probe);
}

template SideFoot nearest_on_side(const Shell&, int, int, const Sphere&);
template SideFoot nearest_on_side(const Shell&, int, int, const Plane&);
template Mat3 dx_dc_of(const Shell&, int, int, const SideFoot&, const Sphere&);
template Mat3 dx_dc_of(const Shell&, int, int, const SideFoot&, const Plane&);

// Of a face of known shape from its normal, else from the cubic patch; made perpendicular to the
// side.
Vec3 inward(const Shell& shell, int h, double t, const Vec3& point, const Vec3& along) {
  const CurvedShell& surface = *shell.curved();
  const int f = triangle_of(h), k = side_of(h);
  const Facet& facet = shell.facets()[f];
  Vec3 in;
  if (const Primitive* face = surface.face_of(f)) {
    Vec3 n;
    face->distance(point, n);
    // The facet's own normal leans any way where its chords leave the tube of a torus.
    in = surface.face_cells()[f].sign * n.cross(along);
    if (along.dot(facet.side(k)) < 0) in = -in;
  } else {
    in = surface.facets()[f].patch(facet).inward(k, t);
  }
  return (in - in.dot(along) * along).normalized();
}

}  // namespace sphshell
