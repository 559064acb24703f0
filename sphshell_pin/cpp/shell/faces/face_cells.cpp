#include "shell/faces/face_cells.hpp"

#include <algorithm>
#include <cmath>

#include "shell/curved/curved.hpp"

namespace sphshell {
namespace {

// What is measured at a few places may be larger between them.
constexpr double kMargin = 1.5;
constexpr int kMostRepeats = 12;
constexpr int kMostHalvings = 150;

}  // namespace

// Newton's method on both distances; quadratic where the faces cross at an angle.
bool onto_both(const Primitive& one, const Primitive& other, Vec3& x) {
  for (int i = 0; i < kMostRepeats; ++i) {
    const Intersection here = intersection_at(one, other, x);
    if (!(here.sine > kLeastAngle)) return false;
    x += here.offset;
    if (here.offset.squaredNorm() < 1e-30 * x.squaredNorm()) break;
  }
  return x.allFinite();
}

// The triple product chord . (n x m): zero where both normals are one along the chord, with a sign
// to either side.
double turn_between(const std::vector<Primitive>& shapes, int face, int other, const Vec3& chord,
                    const Vec3& x) {
  Vec3 n, m;
  shapes[face].distance(x, n), shapes[other].distance(x, m);
  return chord.dot(n.cross(m));
}

// The most that a face is off a facet of it, by its middle and those of its sides.
double sagitta_of(const Facet& facet, const Primitive& shape) {
  const Vec3* p = facet.corner;
  double most = std::abs(shape.distance((p[0] + p[1] + p[2]) / 3));
  for (int k = 0; k < 3; ++k)
    most = std::max(most, std::abs(shape.distance((p[k] + p[next_corner(k)]) / 2)));
  return kMargin * most;
}

namespace {

// A plane or a cylinder through three points of a line or circle that is upright on a face with
// normal n there.
Primitive cutting(const Vec3& p, const Vec3& middle, const Vec3& q, const Vec3& n) {
  // On a straight line: the plane through it and the normal. On a circle: its own plane where that
  // is steep, else the cylinder over it.
  const Vec3 d = q - p, up = (middle - p).cross(q - middle);
  Primitive out{FaceKind::Plane, p, d.cross(n).normalized(), 0, 0};
  if (!(up.norm() > 1e-7 * d.squaredNorm())) return out;
  // The center of the circle, from the middle of its chord.
  const Vec3 axis = up.normalized(), toward = axis.cross(d).normalized();
  const double half = d.norm() / 2, rise = (middle - (p + q) / 2).dot(toward);
  // Of the chord theorem: rise (2 r - rise) = half^2.
  const double away = (rise * rise - half * half) / (2 * rise);
  const Vec3 center = (p + q) / 2 + away * toward;
  if (std::abs(n.dot(axis)) < 0.7) return {FaceKind::Plane, center, axis, 0, 0};
  return {FaceKind::Cylinder, center, axis, (p - center).norm(), 0};
}

// The middle of the border between two faces that are tangent along it, next to that of a chord: by
// bisection and the secant, across the chord on one of them. False if their normals are parallel
// nowhere within the chord's length.
bool middle_of_tangents(const std::vector<Primitive>& shapes, int face, int other, const Vec3& p,
                        const Vec3& q, const Vec3& across, Vec3& x) {
  const Vec3 chord = q - p, start = (p + q) / 2;
  const double length = chord.norm();
  const auto at = [&](double u) { return shapes[face].onto(start + u * across); };
  const auto turn = [&](double u) { return turn_between(shapes, face, other, chord, at(u)); };
  double a = 0, turn_a = turn(a), b = 0, turn_b = turn_a;
  for (double u = 1e-6 * length; turn_a * turn_b > 0; u *= 2) {
    if (!(u < length / 2)) return false;
    b = u, turn_b = turn(u);
    if (turn_a * turn_b > 0) b = -u, turn_b = turn(-u);
  }
  for (int i = 0; i < kMostHalvings && turn_a != 0 && turn_b != 0; ++i) {
    double u = b - turn_b * (b - a) / (turn_b - turn_a);
    // In every third step the interval is halved, whatever the slope does.
    if (i % 3 == 2 || !(std::min(a, b) < u && u < std::max(a, b))) u = (a + b) / 2;
    const double here = turn(u);
    (here * turn_a > 0 ? a : b) = u, (here * turn_a > 0 ? turn_a : turn_b) = here;
    if (std::abs(b - a) < 1e-15 * length) break;
  }
  x = at(std::abs(turn_a) < std::abs(turn_b) ? a : b);
  return x.allFinite();
}

// The shape that cuts both faces along the border between two vertices, if they touch there all
// along it: decided once for the facets on both sides. Sets how far the border is from its chord.
bool is_tangent(const Shell& shell, std::vector<Primitive>& shapes, int face, int other,
                const Facet& facet, int k, Vec3& middle, double& bulge, Primitive& cut) {
  const Vec3 &p = facet.corner[k], &q = facet.corner[next_corner(k)];
  const double gap = kMostGap * shell.size();
  const auto on_both = [&](const Vec3& x) {
    return std::abs(shapes[face].distance(x)) <= gap && std::abs(shapes[other].distance(x)) <= gap;
  };
  if (!on_both(p) || !on_both(q)) return false;
  // On a plane the turn grows evenly, and the search is the surest.
  if (shapes[other].kind == FaceKind::Plane) std::swap(face, other);
  const Vec3 across = facet.normal.cross(q - p).normalized();
  Vec3 n;
  if (!middle_of_tangents(shapes, face, other, p, q, across, middle) || !on_both(middle))
    return false;
  shapes[face].distance(middle, n);
  cut = cutting(p, middle, q, n);
  const Vec3 rise = middle - (p + q) / 2;
  bulge = rise.norm();
  // A circle is between its chord and twice the parabola through its middle.
  for (const double s : {0.15, 0.3, 0.7, 0.85}) {
    Vec3 x = p + s * (q - p) + 4 * s * (1 - s) * rise;
    if (!onto_both(shapes[face], cut, x) || !on_both(x)) return false;
    bulge = std::max(bulge, (x - p - s * (q - p)).norm());
  }
  return bulge < (q - p).norm();
}

}  // namespace

LargeArray<FaceCell> make_face_cells(const Shell& shell, Faces& faces,
                                     const LargeArray<CurvedFacet>& facets) {
  LargeArray<FaceCell> out;
  if (faces.of.empty()) return out;
  const Topology& topology = shell.topology();
  out.resize(facets.size());
  for (std::size_t f = 0; f < out.size(); ++f) {
    out[f] = FaceCell();
    out[f].face = faces.of_triangle(shell.triangle_of_facet(static_cast<int>(f)));
  }
  // What is bent, or has borders that ought to be.
  // Flat facets of planes far from anything round stay as they are.
  std::vector<char> bent(out.size(), 0);
  const auto is_round = [&](int face) {
    return face >= 0 && faces.shapes[face].kind != FaceKind::Plane;
  };
  for (std::size_t f = 0; f < out.size(); ++f) {
    if (out[f].face < 0) continue;
    bent[f] = is_round(out[f].face) || !facets[f].flat;
    const int t = shell.triangle_of_facet(static_cast<int>(f));
    for (int k = 0; k < 3; ++k) {
      const int g = topology.other_half_edge(3 * t + k);
      if (g >= 0 && is_round(faces.of_triangle(triangle_of(g)))) bent[f] = 1;
    }
  }
  // open: faces that do not hold their own facets exactly, and are left to the cubics.
  std::vector<char> open(faces.shapes.size(), 0);
  std::vector<float> off(3 * out.size(), 0);  // of a cubic side from the face [m]
  // One decision and one cutting shape for both facets of a side: each closest point is on one side
  // of it, so that neither misses what the other leaves.
  const auto touch = [&](int h, int beyond, const Vec3& middle, double bulge,
                         const Primitive& cut) {
    const int k = side_of(h);
    FaceCell& cell = out[triangle_of(h)];
    const Facet& facet = shell.facets()[triangle_of(h)];
    Vec3 n, away;
    faces.shapes[cell.face].distance(middle, n);
    cut.distance(middle, away);
    const Vec3 in = n.cross(facet.corner[next_corner(k)] - facet.corner[k]);
    cell.side[k] = FaceCell::Side::Tangent;
    cell.beyond[k] = beyond;
    cell.across[k] = static_cast<int>(faces.shapes.size());
    cell.turn[k] = (in.dot(away) < 0) != (n.dot(facet.normal) < 0) ? -1 : 1;
    cell.bulge[k] = static_cast<float>(kMargin * bulge + kMostGap * shell.size());
  };
  for (std::size_t f = 0; f < out.size(); ++f) {
    const Facet& facet = shell.facets()[f];
    const int t = shell.triangle_of_facet(static_cast<int>(f));
    FaceCell& cell = out[f];
    if (cell.face < 0) continue;
    const Primitive shape = faces.shapes[cell.face];
    Vec3 n;
    shape.distance((facet.corner[0] + facet.corner[1] + facet.corner[2]) / 3, n);
    cell.sign = n.dot(facet.normal) < 0 ? -1 : 1;
    for (int i = 0; i < 3; ++i) cell.upright[i] = static_cast<float>(cell.sign * n[i]);
    for (const Vec3& p : facet.corner)
      if (!(std::abs(shape.distance(p)) <= kMostGap * shell.size())) open[cell.face] = 1;
    for (int k = 0; k < 3; ++k) {
      const int g = topology.other_half_edge(3 * t + k);
      const bool wound =
          g >= 0 && shell.triangles()[t][k] != shell.triangles()[triangle_of(g)][side_of(g)];
      const int h = wound ? shell.facet_half_edge(g) : -1, beyond = h < 0 ? -1 : triangle_of(h);
      const int other = beyond >= 0 ? out[beyond].face : -1;
      if (other == cell.face) cell.side[k] = FaceCell::Side::Inner;
      if (other == cell.face || !(bent[f] || (beyond >= 0 && bent[beyond]))) continue;
      if (cell.side[k] == FaceCell::Side::Tangent) continue;  // decided from beyond it
      const Vec3 one = facets[f].control_offset(k, 0), two = facets[f].control_offset(k, 1);
      double bulge = std::max(one.norm(), two.norm()), apart = 0;
      Vec3 middle;
      Primitive cut;
      bool shared = other >= 0;
      const CubicCurve side = facets[f].side(facet, k);
      for (const Vec3& end : {facet.corner[k], facet.corner[next_corner(k)]})
        shared = shared && std::abs(faces.shapes[other].distance(end)) <= kMostGap * shell.size();
      for (const double s : {0.15, 0.3, 0.5, 0.7, 0.85}) {
        // Where both hold at the ends, in which they may be tangent, and cut each other between.
        const Vec3 x = side.point(s);
        Vec3 both = x;
        shared = shared && onto_both(shape, faces.shapes[other], both);
        bulge = std::max(bulge, (both - x).norm() + std::max(one.norm(), two.norm()));
        apart = std::max(apart, std::abs(shape.distance(x)));
      }
      const double length = (facet.corner[next_corner(k)] - facet.corner[k]).norm();
      off[3 * f + k] = static_cast<float>(apart);
      if (shared && bulge < length) {
        cell.side[k] = FaceCell::Side::Shared;
        cell.beyond[k] = cell.across[k] = other;
      } else if (other >= 0 && h > 3 * static_cast<int>(f) + k &&
                 is_tangent(shell, faces.shapes, cell.face, other, facet, k, middle, bulge, cut)) {
        touch(3 * static_cast<int>(f) + k, other, middle, bulge, cut);
        touch(h, cell.face, middle, bulge, cut);
        faces.shapes.push_back(cut);
        continue;
      } else if (apart > kMostGap * shell.size()) {
        open[cell.face] = 1;
      }
      cell.bulge[k] = static_cast<float>(kMargin * bulge + kMostGap * shell.size());
    }
  }
  // A side is what it is for the sake of faces that give closest points.
  const auto gives = [&](int face) { return face >= 0 && !open[face]; };
  // Giving up one face changes the sides of its neighbors, until nothing changes.
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t f = 0; f < out.size(); ++f)
      for (int k = 0; k < 3; ++k) {
        FaceCell& cell = out[f];
        const bool here = gives(cell.face), there = gives(cell.beyond[k]);
        const bool tangent = cell.side[k] == FaceCell::Side::Tangent;
        if (tangent ? here && there : here || there) continue;
        cell.side[k] = FaceCell::Side::Cubic;
        if (here && off[3 * f + k] > kMostGap * shell.size()) open[cell.face] = changed = true;
      }
  }
  for (std::size_t f = 0; f < out.size(); ++f) {
    FaceCell& cell = out[f];
    if (cell.face < 0) continue;
    const auto curved = [&](int face) { return is_round(face) && gives(face); };
    // A face is asked for closest points where it, its elements or a neighbor is curved.
    const bool needed =
        is_round(cell.face) || !facets[f].flat || std::any_of(cell.beyond, cell.beyond + 3, curved);
    cell.exact = !needed || gives(cell.face);
    cell.closed = needed && gives(cell.face);
    for (int k = 0; k < 3 && !cell.closed; ++k) cell.side[k] = FaceCell::Side::Cubic;
  }
  return out;
}

}  // namespace sphshell
