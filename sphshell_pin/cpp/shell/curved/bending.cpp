// Curved elements from the normals at their corners: their sides, then their middles.
#include <Eigen/Dense>

#include "shell/curved/creases.hpp"
#include "shell/curved/curved.hpp"
#include "shell/curved/limiter.hpp"
#include "shell/curved/vertex_normals.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {
namespace {

// A step in the parameters of an element after which the next would be rounding.
constexpr double kSettled = 1e-9;
// An edge whose tangents would lean more than this (cosine) from its chord stays straight.
constexpr double kMostLean = 0.6;

bool are_same(const Vec3& m, const Vec3& n) { return (m - n).norm() <= kSameNormal; }

// Appends n where no equal one is there; edges have few normals at an end.
void add_distinct(std::vector<Vec3>& normals, const Vec3& n) {
  for (const Vec3& other : normals)
    if ((n - other).squaredNorm() < kSameNormal * kSameNormal) return;
  normals.push_back(n);
}

// What is known of an edge at one of its ends: the normals there, and which way it goes.
struct EdgeEnd {
  const std::vector<Vec3>& normals;
  Vec3 direction;
  bool limited;  // a fan there was divided: no more lean than at the other end
};

// The unit vector nearest to the direction, forward along chord d, that is tangent to the planes of
// all normals: with one of them its projection, with two their common line. False where there is
// none.
bool tangent_of(const Vec3& d, const EdgeEnd& end, Vec3& out) {
  const std::vector<Vec3>& normals = end.normals;
  if (normals.size() > 2) return false;
  // A border passes the vertex along its circle; other edges have their chord for a direction.
  const Vec3 direction = end.direction.isZero(0) || end.direction.dot(d) == 0 ? d : end.direction;
  out = direction - direction.dot(normals[0]) * normals[0];
  if (normals.size() == 2) out = normals[0].cross(normals[1]);
  out.normalize();
  if (out.dot(d) < 0) out = -out;
  if (normals.size() == 2 && end.limited) {
    // Normals that differ by little do not determine their common line: where it leans more than
    // twice as much as for their mean, that is used.
    const Vec3 mean = (normals[0] + normals[1]).normalized();
    const Vec3 level = (d - d.dot(mean) * mean).normalized();
    if (!(angle_between(out, d) <= 2 * angle_between(level, d))) out = level;
  }
  return out.dot(d) >= kMostLean * d.norm();
}

// A cubic between tangents that lean by a and b from its chord has no inflection unless one leans
// more than twice as much as the other. The unit tangent that leans no more than twice as much as
// `other`.
Vec3 limited_lean(const Vec3& tangent, const Vec3& other, const Vec3& forward) {
  if (angle_between(tangent, forward) <= 2 * angle_between(other, forward)) return tangent;
  // Within the plane of chord and tangent, turned back to twice the other's lean.
  const Vec3 aside = (tangent - tangent.dot(forward) * forward).normalized();
  const double along = other.dot(forward), off = forward.cross(other).norm();
  return (along * along - off * off) * forward + 2 * along * off * aside;  // twice the angle
}

// Offsets of the two control points of an edge with chord d from the chord, tangent to the planes
// of all normals at its ends. The handles are those that make a circular arc of a circle's tangents
// (Goldapp, CAGD 8 (1991) 227): order 4 on any curve.
std::array<Vec3, 2> control_offsets(const Vec3& d, const EdgeEnd& first, const EdgeEnd& last) {
  const std::array<Vec3, 2> straight = {Vec3::Zero(), Vec3::Zero()};
  const double length = d.norm();
  const auto steepest = [&](const std::vector<Vec3>& normals) {
    double most = 0;
    for (const Vec3& n : normals) most = std::max(most, std::abs(n.dot(d)) / length);
    return most;
  };
  // The sine of the angle by which the chord leaves the tangent planes.
  const double at_first = steepest(first.normals), at_last = steepest(last.normals);
  if (std::max(at_first, at_last) <= 1e-14) return straight;
  // Flat at one end and not at the other: the edge leads from a plane into a bend, or to a groove.
  if (std::min(at_first, at_last) <= 1e-9 * std::max(at_first, at_last)) return straight;
  Vec3 begin, end;
  if (!tangent_of(d, first, begin) || !tangent_of(d, last, end)) return straight;
  if (first.limited || last.limited) {
    const Vec3 forward = d / length, before = begin;
    begin = limited_lean(begin, end, forward);
    end = limited_lean(end, before, forward);
  }
  // Of a circular arc of half-angle a: handle length 2 L / (3 (1 + cos a)). The offset is what
  // remains beside a third of the chord.
  const auto handle = [&](const Vec3& tangent) -> Vec3 {
    return 2 * length / (3 * (1 + tangent.dot(d) / length)) * tangent - d / 3;
  };
  return {handle(begin), -handle(end)};
}

// Per vertex the direction of a border that passes through it, zero where it has a corner there or
// ends: along the circle through three vertices.
std::vector<Vec3> border_directions(const Shell& shell) {
  const std::vector<Vec3>& p = shell.vertices();
  std::vector<Vec3> sum(p.size(), Vec3::Zero()), one(p.size(), Vec3::Zero());
  std::vector<int> count(p.size(), 0);
  std::vector<char> corner(p.size(), 0);
  for (const Edge& edge : shell.topology().edges) {
    if (edge.kind != EdgeClass::Boundary) continue;
    const Vec3 d = p[edge.last_vertex] - p[edge.first_vertex];
    for (int v : {edge.first_vertex, edge.last_vertex}) {
      const Vec3 away = v == edge.first_vertex ? d : Vec3(-d);
      if (++count[v] == 1) {
        one[v] = away;
      } else {
        // The tangent at the middle one of three points on a circle: the difference of the chords
        // that leave it, each over the square of its length.
        sum[v] = away / away.squaredNorm() - one[v] / one[v].squaredNorm();
        // A border with a corner beyond the crease angle has no direction there.
        const double cosine = -away.dot(one[v]) / (away.norm() * one[v].norm());
        corner[v] = count[v] > 2 || cosine < std::cos(shell.crease_angle());
      }
    }
  }
  for (std::size_t v = 0; v < p.size(); ++v)
    if (corner[v]) sum[v].setZero();
  return sum;
}

// Where a patch, continued beyond its sides, misses a vertex q with its normal n, opposite side k,
// and what lifting its middle by `a` along the facet's normal would do about it: added to the
// normal equation square * a = along. Height and slope of the patch at the vertex both count;
// slopes are weighted with the mean square of the sides, so that all are lengths.
void add_beyond(const Facet& facet, const CubicPatch& patch, int k, const Vec3& q, const Vec3& n,
                double& along, double& square) {
  const Vec3& up = facet.normal;
  const double upright = n.dot(up);
  if (upright < 0.5) return;
  const FacetAxes axes(facet);
  const auto level = [&](const Vec3& d) { return Eigen::Vector2d(d.dot(axes.x), d.dot(axes.y)); };
  const auto tangents = [&](const Eigen::Vector2d& at) {
    Eigen::Matrix2d out;
    out << level(patch.along_u(at.x(), at.y())), level(patch.along_v(at.x(), at.y()));
    return out;
  };
  // The parameters of the vertex's projection, which raising the center does not change, from those
  // of the corner opposite a side, mirrored: where it is if both elements make a parallelogram.
  static constexpr double kU[3] = {1, -1, 1}, kV[3] = {-1, 1, 1};
  Eigen::Vector2d at(kU[k], kV[k]);
  for (int i = 0; i < 6; ++i) {
    const Eigen::Vector2d step = tangents(at).inverse() * level(q - patch.point(at.x(), at.y()));
    at += step;
    // Of a share of the element; what is left is its square.
    if (step.squaredNorm() < kSettled * kSettled) break;
  }
  if (!(at.cwiseAbs().maxCoeff() < 4)) return;
  // 6 u v w is the polynomial that the middle control point moves: zero on all sides.
  const double u = at.x(), v = at.y(), w = 1 - u - v;
  const Eigen::Matrix2d to_slope = tangents(at).transpose().inverse();
  const Eigen::Vector2d slope =
      to_slope * Eigen::Vector2d(patch.along_u(u, v).dot(up), patch.along_v(u, v).dot(up));
  // The slope of the plane with normal n over the facet's plane.
  const Eigen::Vector2d wanted = -level(n) / upright;
  const Eigen::Vector2d gain = to_slope * Eigen::Vector2d(6 * v * (w - u), 6 * u * (w - v));
  double length2 = 0;
  for (int i = 0; i < 3; ++i) length2 += facet.side(i).squaredNorm();
  const double rise = 6 * u * v * w;
  along += rise * up.dot(q - patch.point(u, v)) + length2 / 3 * gain.dot(wanted - slope);
  square += rise * rise + length2 / 3 * gain.squaredNorm();
}

}  // namespace

// One curve per edge, from the normals of all facets that meet there, so that they share it.
void CurvedShell::bend_edges(const Shell& shell, const std::vector<std::uint8_t>& straight,
                             const CoplanarRegions* regions, const std::vector<Trust>& trust) {
  const Topology& topology = shell.topology();
  const std::vector<Vec3>& p = shell.vertices();
  facets_.resize(shell.triangles().size());
  tangents_.flat_ = &shell.facets();
  tangents_.curved_ = &facets_;
  tangents_.spoke_.resize(topology.neighbors.size());
  LargeArray<int> fill(topology.neighbor_begin.begin(), topology.neighbor_begin.end() - 1);
  const std::vector<Vec3> borders = border_directions(shell);
  // The surface is smooth over an edge where both elements have the same normals at both its ends.
  const auto goes_on = [&](const Edge& edge) {
    const int h = topology.incidence[edge.begin],
              g = topology.incidence[edge.begin + edge.count - 1];
    const bool opposed = shell.opposed(h, g);
    const int h1 = corner_after(h), g1 = corner_after(g);
    return edge.count == 2 && are_same(normals_[h], normals_[opposed ? g1 : g]) &&
           are_same(normals_[h1], normals_[opposed ? g : g1]);
  };
  std::optional<SagittaWitness> witness;
  if (regions) witness.emplace(shell, *regions, goes_on);
  std::vector<Vec3> first, last;
  for (const Edge& edge : topology.edges) {
    first.clear();
    last.clear();
    bool limited = false;
    const auto forward = [&](int h) { return shell.vertex(h) == edge.first_vertex; };
    for (const int h : topology.around(edge)) {
      const Vec3& here = normals_[h];
      const Vec3& there = normals_[corner_after(h)];
      add_distinct(first, forward(h) ? here : there);
      add_distinct(last, forward(h) ? there : here);
      limited = limited || divided_[h] || divided_[corner_after(h)];
    }
    const Vec3 d = p[edge.last_vertex] - p[edge.first_vertex];
    const bool border = edge.kind == EdgeClass::Boundary;
    std::array<Vec3, 2> offset =
        control_offsets(d, {first, border ? borders[edge.first_vertex] : d, limited},
                        {last, border ? borders[edge.last_vertex] : d, limited});
    if (witness) {
      Trust least = Trust::Own, most = Trust::Facet;
      for (const int h : topology.around(edge))
        for (int c : {h, corner_after(h)}) {
          least = std::min(least, divided_[c] ? Trust::Facet : trust[c]);
          most = std::max(most, trust[c]);
        }
      const double bulge = 0.75 * std::max(offset[0].norm(), offset[1].norm());
      const bool smooth = goes_on(edge);
      const double limit = (smooth ? most : least) == Trust::Own
                               ? bulge
                               : witness->most(shell, edge, smooth, least >= Trust::Fitted);
      if (bulge > limit)
        for (Vec3& one : offset) one *= limit / bulge;
    }
    settle_on_faces(shell, edge, faces_, p[edge.first_vertex], d, offset);
    for (const int h : topology.around(edge))
      if (!straight.empty() && straight[h]) offset = {Vec3::Zero(), Vec3::Zero()};
    for (const int h : topology.around(edge)) {
      const int g = shell.facet_half_edge(h);
      facets_[triangle_of(g)].set_side(side_of(g), offset[forward(h) ? 0 : 1],
                                       offset[forward(h) ? 1 : 0]);
    }
    // Beside Topology::neighbors, which was filled in the same order.
    const int h = topology.incidence[edge.begin], spoke = 2 * shell.facet_half_edge(h);
    tangents_.spoke_[fill[edge.first_vertex]++] = spoke + (forward(h) ? 0 : 1);
    tangents_.spoke_[fill[edge.last_vertex]++] = spoke + (forward(h) ? 1 : 0);
  }
}

// The inner control point: that of a PN triangle (Vlachos et al., I3D 2001), moved along the normal
// so that the patch, continued beyond its sides, comes nearest to the positions and normals of the
// vertices opposite. Corners alone do not determine how the curvature changes across an element.
void CurvedShell::raise_centers(const Shell& shell) {
  for (CurvedFacet& curved : facets_) {
    curved.rise = 0;
    curved.flat = curved.largest_offset() == 0;
  }
  for_each_in_parallel(facets_.size(), [&](std::size_t f) {
    if (facets_[f].flat) return;
    const Facet& facet = shell.facets()[f];
    const CubicPatch patch = facets_[f].patch(facet);
    const int t = shell.triangle_of_facet(static_cast<int>(f));
    double along = 0, square = 0;
    for (int k = 0; k < 3; ++k) {
      const int c = corner_beyond(shell, 3 * t + k);
      if (c < 0) continue;
      add_beyond(facet, patch, k, shell.point(c), normals_[c], along, square);
    }
    // The least-squares solution of all neighbors together, limited: those whose normals contradict
    // it must not pull an element away from its own sides.
    const double most = facets_[f].largest_offset();
    if (square > 0) facets_[f].rise = std::clamp(along / square, -most, most);
  });
}

// The corner (3 triangle + k) opposite half-edge h, where the surface goes on beyond it: not across
// a crease, nor into a flat element, where the curvature ends. Else -1.
int CurvedShell::corner_beyond(const Shell& shell, int h) const {
  const int g = shell.topology().other_half_edge(h);
  const bool goes_on = g >= 0 && shell.opposed(h, g) &&
                       !facets_[triangle_of(shell.facet_half_edge(g))].flat &&
                       are_same(normals_[h], normals_[corner_after(g)]) &&
                       are_same(normals_[corner_after(h)], normals_[g]);
  return goes_on ? corner_before(g) : -1;
}

}  // namespace sphshell
