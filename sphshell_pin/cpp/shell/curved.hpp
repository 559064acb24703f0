// Curved elements over the triangles of a shell: quadratic patches that meet the vertex normals.
#pragma once

#include <vector>

#include "shell/shell.hpp"

namespace sphshell {

// x(b) = b0 p0 + b1 p1 + b2 p2 - b0 b1 c0 - b1 b2 c1 - b2 b0 c2, with barycentric coordinates b,
// corners p and the bend c_k of side k (Nagata, CAGD 22 (2005) 327, in symmetric form).
struct CurvedFacet {
  Vec3 bend[3];
  Owned owned;  // as Facet::owned, where coplanar neighbours may still be curved
  bool flat;    // no bends: the exact flat facet

  Vec3 point(const Facet& f, double u, double v) const {
    const double w = 1 - u - v;
    return w * f.corner[0] + u * f.corner[1] + v * f.corner[2] - w * u * bend[0] - u * v * bend[1] -
           v * w * bend[2];
  }
  // Derivatives with respect to u = b1 and v = b2.
  Vec3 along_u(const Facet& f, double u, double v) const {
    return f.corner[1] - f.corner[0] - (1 - 2 * u - v) * bend[0] - v * bend[1] + v * bend[2];
  }
  Vec3 along_v(const Facet& f, double u, double v) const {
    return f.corner[2] - f.corner[0] + u * bend[0] - u * bend[1] - (1 - u - 2 * v) * bend[2];
  }
  Vec3 along_uu() const { return 2 * bend[0]; }
  Vec3 along_uv() const { return bend[0] - bend[1] + bend[2]; }
  Vec3 along_vv() const { return 2 * bend[2]; }

  // Side k as a curve from its corner at t = 0 to the next at t = 1, and its derivative.
  Vec3 side(const Facet& f, int k, double t) const {
    const Vec3& a = f.corner[k];
    return a + t * (f.corner[next_corner(k)] - a) - t * (1 - t) * bend[k];
  }
  Vec3 side_tangent(const Facet& f, int k, double t) const {
    return f.corner[next_corner(k)] - f.corner[k] - (1 - 2 * t) * bend[k];
  }
  // A direction that leaves side k at t into the facet, tangent to it.
  Vec3 inward(const Facet& f, int k, double t) const;
};

class CurvedShell {
 public:
  // normals: unit, per triangle corner (3 per triangle); empty: estimated within smooth patches
  // (Max, J. Graphics Tools 4 (1999) 1). They are wound like the triangles.
  CurvedShell(const Shell& shell, std::vector<Vec3> normals);

  const LargeArray<CurvedFacet>& facets() const { return facets_; }  // in the order of the tree
  const LargeArray<NormalCone>& cones() const { return cones_; }
  double bulge() const { return bulge_; }  // farthest from the flat triangles [m]
  // Tangents of the edges that leave vertex i, beside Topology::neighbours.
  const std::vector<Vec3>& tangents() const { return tangents_; }
  std::size_t bytes() const {
    return facets_.size() * (sizeof(CurvedFacet) + sizeof(NormalCone)) +
           (tangents_.size() + normals_.size()) * sizeof(Vec3);
  }

 private:
  void estimate_normals(const Shell& shell);
  void bend_edges(const Shell& shell);
  void build_cones(const Shell& shell);

  std::vector<Vec3> normals_;
  LargeArray<CurvedFacet> facets_;
  LargeArray<NormalCone> cones_;
  std::vector<Vec3> tangents_;
  double bulge_ = 0;
};

}  // namespace sphshell
