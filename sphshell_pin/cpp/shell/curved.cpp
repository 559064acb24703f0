#include "shell/curved.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "shell/disjoint_sets.hpp"

namespace sphshell {
namespace {

constexpr double kAny = std::numeric_limits<double>::infinity();

// The bend of an edge with direction d whose curve is to be tangent to the planes of all `first`
// normals at its first end and of all `last` normals at its last: the shortest c with
// n.(d - c) = 0 there and n.(d + c) = 0 here. Zero where the normals contradict each other (an
// S-shaped edge) or would bend it beyond reason.
Vec3 bend_of(const Vec3& d, const std::vector<Vec3>& first, const std::vector<Vec3>& last) {
  Eigen::Matrix<double, Eigen::Dynamic, 3> rows(first.size() + last.size(), 3);
  Eigen::VectorXd sides(rows.rows());
  Eigen::Index i = 0;
  for (const Vec3& n : first) rows.row(i) = n.transpose(), sides[i++] = n.dot(d);
  for (const Vec3& n : last) rows.row(i) = n.transpose(), sides[i++] = -n.dot(d);
  const double length = d.norm();
  // Flat at one end and not at the other: the edge leads from a plane into a bend, or to a groove.
  const auto steepest = [&](Eigen::Index begin, std::size_t count) {
    return sides.segment(begin, static_cast<Eigen::Index>(count)).cwiseAbs().maxCoeff();
  };
  const double at_first = steepest(0, first.size());
  const double at_last = steepest(static_cast<Eigen::Index>(first.size()), last.size());
  if (std::min(at_first, at_last) <= 1e-9 * std::max(at_first, at_last)) return Vec3::Zero();
  if (sides.cwiseAbs().maxCoeff() <= 1e-14 * length) return Vec3::Zero();
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeThinU | Eigen::ComputeThinV);
  // Two nearly parallel normals give one condition; what they disagree about is noise.
  svd.setThreshold(1e-7);
  const Vec3 c = svd.solve(sides);
  const double miss = (rows * c - sides).cwiseAbs().maxCoeff();
  const bool contradicts = miss > 0.5 * sides.cwiseAbs().maxCoeff();
  return contradicts || c.norm() > 0.5 * length ? Vec3(Vec3::Zero()) : c;
}

void add_distinct(std::vector<Vec3>& normals, const Vec3& n) {
  for (const Vec3& other : normals)
    if ((n - other).squaredNorm() < 1e-20) return;
  normals.push_back(n);
}

}  // namespace

Vec3 CurvedFacet::inward(const Facet& f, int k, double t) const {
  switch (k) {
    case 0:
      return along_v(f, t, 0) - t * along_u(f, t, 0);
    case 1:
      // From side 1 (w = 0) towards corner 0: minus u and v in proportion to where one stands.
      return -((1 - t) * along_u(f, 1 - t, t) + t * along_v(f, 1 - t, t));
    default:
      return along_u(f, 0, 1 - t) - (1 - t) * along_v(f, 0, 1 - t);
  }
}

CurvedShell::CurvedShell(const Shell& shell, std::vector<Vec3> normals)
    : normals_(std::move(normals)) {
  if (normals_.empty()) estimate_normals(shell);
  bend_edges(shell);
  build_cones(shell);
}

// One normal per vertex and fan of triangles that smooth edges join there. A fan whose triangles
// spread more than its creases may (a cone's tip) keeps each triangle's own.
void CurvedShell::estimate_normals(const Shell& shell) {
  const std::vector<Triangle>& triangles = shell.triangles();
  const std::vector<Vec3>& p = shell.vertices();
  const Topology& topology = shell.topology();
  const std::size_t corners = 3 * triangles.size();
  DisjointSets fans(corners);
  for (const Edge& edge : topology.edges) {
    if (edge.count != 2 || !(edge.inner || edge.kind == EdgeClass::Smooth)) continue;
    const int h = topology.incidence[edge.begin], g = topology.incidence[edge.begin + 1];
    const int h0 = h, h1 = 3 * triangle_of(h) + next_corner(side_of(h));
    const int g0 = g, g1 = 3 * triangle_of(g) + next_corner(side_of(g));
    const auto vertex = [&](int c) { return triangles[c / 3][c % 3]; };
    const bool opposed = vertex(h0) == vertex(g1);
    fans.join(h0, opposed ? g1 : g0);
    fans.join(h1, opposed ? g0 : g1);
  }
  std::vector<Vec3> sum(corners, Vec3::Zero());
  for (std::size_t c = 0; c < corners; ++c) {
    const Triangle& t = triangles[c / 3];
    const int k = static_cast<int>(c % 3);
    const Vec3 a = p[t[next_corner(k)]] - p[t[k]], b = p[t[previous_corner(k)]] - p[t[k]];
    const double weight = 1 / (a.squaredNorm() * b.squaredNorm());
    sum[fans.find(static_cast<int>(c))] += weight * a.cross(b).norm() * topology.face_normal[c / 3];
  }
  std::vector<double> widest(corners, 1);  // cosine
  for (std::size_t c = 0; c < corners; ++c) {
    const int fan = fans.find(static_cast<int>(c));
    widest[fan] = std::min(widest[fan], sum[fan].normalized().dot(topology.face_normal[c / 3]));
  }
  const double limit = std::cos(shell.crease_angle());
  normals_.resize(corners);
  for (std::size_t c = 0; c < corners; ++c) {
    const int fan = fans.find(static_cast<int>(c));
    normals_[c] = widest[fan] < limit ? topology.face_normal[c / 3] : Vec3(sum[fan].normalized());
  }
}

// One bend per edge, from the normals of all facets that meet there, so that they share the curve.
void CurvedShell::bend_edges(const Shell& shell) {
  const Topology& topology = shell.topology();
  const std::vector<Triangle>& triangles = shell.triangles();
  const std::vector<Vec3>& p = shell.vertices();
  std::vector<Vec3> bend(3 * triangles.size());
  tangents_.assign(topology.neighbours.size(), Vec3::Zero());
  std::vector<int> fill(topology.neighbour_begin.begin(), topology.neighbour_begin.end() - 1);
  std::vector<Vec3> first, last;
  for (const Edge& edge : topology.edges) {
    first.clear();
    last.clear();
    for (int i = 0; i < edge.count; ++i) {
      const int h = topology.incidence[edge.begin + i], t = triangle_of(h);
      const int k = side_of(h), next = next_corner(k);
      const bool forward = triangles[t][k] == edge.first_vertex;
      add_distinct(forward ? first : last, normals_[3 * t + k]);
      add_distinct(forward ? last : first, normals_[3 * t + next]);
    }
    const Vec3 d = p[edge.last_vertex] - p[edge.first_vertex];
    const Vec3 c = bend_of(d, first, last);
    for (int i = 0; i < edge.count; ++i) bend[topology.incidence[edge.begin + i]] = c;
    // Beside Topology::neighbours, which was filled in the same order.
    tangents_[fill[edge.first_vertex]++] = d - c;
    tangents_[fill[edge.last_vertex]++] = -(d + c);
  }
  facets_.resize(triangles.size());
  for (std::size_t f = 0; f < facets_.size(); ++f) {
    const int t = shell.triangle_of_facet(static_cast<int>(f));
    double largest = 0;
    for (int k = 0; k < 3; ++k) {
      facets_[f].bend[k] = bend[3 * t + k];
      largest = std::max(largest, bend[3 * t + k].norm());
    }
    facets_[f].flat = largest == 0;
    bulge_ = std::max(bulge_, largest / 3);  // b0 b1 + b1 b2 + b2 b0 <= 1/3
  }
}

// Bounds from Bezier control points: the patch lies in the hull of six points, its normal field in
// that of six vectors (products of the tangents' control vectors).
void CurvedShell::build_cones(const Shell& shell) {
  const LargeArray<Facet>& flat = shell.facets();
  const Topology& topology = shell.topology();
  const auto is_flat = [&](int t) {
    return facets_[triangle_of(shell.facet_half_edge(3 * t))].flat;
  };
  const std::vector<Owned> owned = shell.assign_owners([&](int t, int u) {
    return topology.planar_face[t] == topology.planar_face[u] && is_flat(t) && is_flat(u);
  });
  for (std::size_t f = 0; f < facets_.size(); ++f) facets_[f].owned = owned[f];
  const auto tan_patch = [&](std::size_t f, const Vec3& axis) {
    const Facet& facet = flat[f];
    const CurvedFacet& curved = facets_[f];
    static constexpr double kU[3] = {0, 1, 0}, kV[3] = {0, 0, 1};
    Vec3 a[3], b[3];
    for (int i = 0; i < 3; ++i) {
      a[i] = curved.along_u(facet, kU[i], kV[i]);
      b[i] = curved.along_v(facet, kU[i], kV[i]);
    }
    double widest = 0;
    for (int i = 0; i < 3; ++i)
      for (int j = i; j < 3; ++j) {
        const Vec3 n = a[i].cross(b[j]) + a[j].cross(b[i]);
        const double along = n.dot(axis);
        widest = std::max(widest, along > 0 ? n.cross(axis).norm() / along : kAny);
      }
    return widest;
  };
  cones_ = shell.cones();
  for (std::size_t f = 0; f < cones_.size(); ++f) {
    const Facet& facet = flat[f];
    const Vec3& axis = facet.normal;
    double tangent = tan_patch(f, axis);
    const Owned& mine = facets_[f].owned;
    for (int k = 0; k < 3; ++k) {
      if (mine.twin[k] >= 0) {
        const std::size_t g = static_cast<std::size_t>(triangle_of(mine.twin[k]));
        tangent =
            std::max(tangent, facet.normal.dot(flat[g].normal) > 0.05 ? tan_patch(g, axis) : kAny);
      } else if (mine.twin[k] != kNotMine) {
        tangent = kAny;
      }
      if (mine.vertex[k] >= 0)
        tangent = std::max(tangent, shell.tan_vertex_cone(mine.vertex[k], axis, tangents_.data()));
    }
    NormalCone& cone = cones_[f];
    const Vec3 middle = (facet.corner[0] + facet.corner[1] + facet.corner[2]) / 3;
    double reach = cone.reach;
    for (int k = 0; k < 3; ++k) {
      const Vec3 control =
          0.5 * (facet.corner[k] + facet.corner[next_corner(k)] - facets_[f].bend[k]);
      reach = std::max(reach, (control - middle).norm() + 1e-6 * shell.size());
    }
    cone.reach = static_cast<float>(reach);
    cone.tan_opening = widened_opening(tangent);
  }
}

}  // namespace sphshell
