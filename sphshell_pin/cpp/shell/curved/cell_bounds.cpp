#include "shell/curved/curved.hpp"
#include "shell/in_parallel.hpp"

namespace sphshell {

constexpr double kAny = std::numeric_limits<double>::infinity();

// The ten control points of a patch, [i][j] with i steps from corner 0 to 1 and j to corner 2.
using Net = std::array<std::array<Vec3, 4>, 4>;

static Net control_points(const Facet& f, const CurvedFacet& curved) {
  Net net;
  for (int i = 0; i < 4; ++i)
    for (int j = 0; i + j < 4; ++j)
      // Of the flat facet: evenly spread.
      net[i][j] = ((3 - i - j) * f.corner[0] + i * f.corner[1] + j * f.corner[2]) / 3;
  const auto offset = [&](int k, int i) { return curved.control_offset(k, i); };
  net[1][0] += offset(0, 0), net[2][0] += offset(0, 1);
  net[2][1] += offset(1, 0), net[1][2] += offset(1, 1);
  net[0][2] += offset(2, 0), net[0][1] += offset(2, 1);
  net[1][1] += curved.middle(f);
  return net;
}

// Bound on the tangent of the angle between `axis` and any normal of the patch: its normal field
// lies in the hull of products of the tangents' control vectors.
static double tan_opening_of(const Net& net, const Vec3& axis) {
  std::array<Vec3, 6> a, b;  // the last coordinate along the axis
  const Vec3 east = axis.unitOrthogonal(), north = axis.cross(east);
  const auto seen = [&](const Vec3& d) { return Vec3(east.dot(d), north.dot(d), axis.dot(d)); };
  int n = 0;
  for (int i = 0; i < 3; ++i)
    for (int j = 0; i + j < 3; ++j, ++n) {
      // Control vectors of the derivatives by u and v, both of degree 2.
      a[n] = seen(net[i + 1][j] - net[i][j]);
      b[n] = seen(net[i][j + 1] - net[i][j]);
    }
  double most = 0, beside = 1;  // of the widest: squares of what is across the axis, and along it
  for (int i = 0; i < 6; ++i)
    for (int j = i; j < 6; ++j) {
      // x_u x x_v has degree 4; its control vectors are positive sums of these symmetric products.
      const Vec3 normal = a[i].cross(b[j]) + a[j].cross(b[i]);
      if (!(normal.z() > 0)) return kAny;
      const double across2 = normal.head<2>().squaredNorm(), along2 = normal.z() * normal.z();
      if (across2 * beside > most * along2) most = across2, beside = along2;
    }
  return std::sqrt(most / beside);
}

CellBounds bounds_of(const Facet& facet, const CubicPatch& patch, double bulge) {
  const FacetAxes axes(facet);
  const Vec3& n = facet.normal;
  static constexpr double kCorner[3][2] = {{0, 0}, {1, 0}, {0, 1}};
  double low = std::numeric_limits<double>::infinity(), high = -low, sway = 0;
  // Second derivatives of a cubic are linear: between those at the corners.
  for (const auto& [u, v] : kCorner) {
    Vec3 xx = patch.along_uu(u, v), xy = patch.along_uv(u, v), yy = patch.along_vv(u, v);
    axes.second(xx, xy, yy);
    // The second fundamental form over the facet's plane, without normalization.
    const Eigenvalues bend(n.dot(xx), n.dot(xy), n.dot(yy));
    low = std::min(low, bend.low), high = std::max(high, bend.high);
    const auto flat = [&](const Vec3& d) { return d.squaredNorm() - n.dot(d) * n.dot(d); };
    sway = std::max(sway, flat(xx) + 2 * flat(xy) + flat(yy));
  }
  // First derivatives are quadratic: in the hull of their control points, which are the values at
  // the corners and, on the sides, twice those in the middle less the mean of those at the ends.
  Vec3 along[6][2];
  for (int i = 0; i < 6; ++i) {
    const double* p = kCorner[i % 3];
    const double* q = kCorner[(i + (i < 3 ? 0 : 1)) % 3];
    const double u = (p[0] + q[0]) / 2, v = (p[1] + q[1]) / 2;
    along[i][0] = patch.along_u(u, v), along[i][1] = patch.along_v(u, v);
  }
  double stretch2 = 0, slope2 = 0;
  for (int i = 0; i < 6; ++i) {
    Vec3 d[2];
    for (int k = 0; k < 2; ++k)
      d[k] = i < 3 ? along[i][k]
                   : Vec3(2 * along[i][k] - (along[i % 3][k] + along[(i + 1) % 3][k]) / 2);
    axes.first(d[0], d[1]);
    const double up[2] = {n.dot(d[0]), n.dot(d[1])};
    slope2 = std::max(slope2, up[0] * up[0] + up[1] * up[1]);
    // x' less the identity, in the plane.
    const double xx = axes.x.dot(d[0]) - 1, yx = axes.y.dot(d[0]);
    const double xy = axes.x.dot(d[1]), yy = axes.y.dot(d[1]) - 1;
    stretch2 = std::max(stretch2, xx * xx + yx * yx + (xy * xy + yy * yy));
  }
  constexpr double kThird = 1.0 / 3;
  Vec3 x = patch.along_u(kThird, kThird), y = patch.along_v(kThird, kThird);
  axes.first(x, y);
  // The gradient of the height over the plane, in the middle.
  const Vec3 lean = n.dot(x) * axes.x + n.dot(y) * axes.y;
  const Vec3 offset = patch.point(kThird, kThird) - facet.middle();
  // Rounded outward to single precision, so that what is certain in double precision stays certain.
  const auto up = [](double value) { return static_cast<float>(value + 1e-6 * std::abs(value)); };
  CellBounds out{-up(-low),
                 up(high),
                 up(std::sqrt(std::max(0.0, sway))),
                 up(std::sqrt(stretch2)) + 1e-12f,
                 up(std::sqrt(slope2)),
                 up(bulge),
                 {},
                 {},
                 {}};
  for (int k = 0; k < 3; ++k) {
    out.offset[k] = static_cast<float>(offset[k]);
    out.lean[k] = static_cast<float>(lean[k]);
  }
  return out;
}

// Bounds from Bezier control points: the patch lies in their hull.
void CurvedShell::build_cones(const Shell& shell) {
  const LargeArray<Facet>& flat = shell.facets();
  const Topology& topology = shell.topology();
  const auto is_flat = [&](int t) {
    return facets_[triangle_of(shell.facet_half_edge(3 * t))].flat;
  };
  // The tip of a cone is one of its vertices that counts.
  const auto at_tip = [&](int t, const Primitive& shape) {
    return shape.kind == FaceKind::Cone &&
           std::any_of(shell.triangles()[t].begin(), shell.triangles()[t].end(), [&](int v) {
             const Vec3 y = shell.vertices()[v] - shape.point;
             return y.cross(shape.axis).norm() <= 1e-6 * shell.size();
           });
  };
  // Two elements of one face, or coplanar flat ones, have no feature between them: nobody owns it.
  const std::vector<Owned> owned = shell.assign_owners([&](int t, int u) {
    const int face = faces_.of_triangle(t);
    const auto closed = [&](int one) {
      return face_of(triangle_of(shell.facet_half_edge(3 * one))) != nullptr;
    };
    if (face >= 0 && face == faces_.of_triangle(u) && closed(t) && closed(u))
      return !at_tip(t, faces_.shapes[face]) && !at_tip(u, faces_.shapes[face]);
    return topology.planar_face[t] == topology.planar_face[u] && is_flat(t) && is_flat(u);
  });
  for (std::size_t f = 0; f < facets_.size(); ++f) facets_[f].owned = owned[f];
  if (!face_cells().empty()) leave_joints_whole(shell);
  cones_ = shell.cones();
  for_each_in_parallel(cones_.size(), [&](std::size_t f) {
    const Facet& facet = flat[f];
    const Vec3& axis = facet.normal;
    const Net net = control_points(facet, facets_[f]);
    // A cone must hold the normals of the element, and of the sides and corners that it owns: there
    // those of the neighbors.
    double tangent = std::max(tan_opening_of(net, axis),
                              shell.opening_of(facet, facets_[f].owned, &tangents_, [&](int g) {
                                return tan_opening_of(control_points(flat[g], facets_[g]), axis);
                              }));
    const Primitive* face = face_of(static_cast<int>(f));
    const FaceCell* cell = face == nullptr ? nullptr : &face_cells()[f];
    // The face's own normals at corners and at the middles of sides, a little wider for what is
    // between.
    double sagitta = 0;
    std::array<Vec3, 4> middles;
    if (face != nullptr) middles = middles_of(*face, *cell, facet, shell.size());
    for (int i = 0; face != nullptr && i < 7; ++i) {
      const Vec3* corner = facet.corner;
      const Vec3 chord = i < 3   ? Vec3((corner[i] + corner[next_corner(i)]) / 2)
                         : i < 4 ? facet.middle()
                                 : corner[i - 4];
      const Vec3 x = i < 4 ? middles[i] : chord;
      Vec3 n;
      face->distance(x, n);
      sagitta = std::max(sagitta, kBulgeMargin * (x - chord).norm());
      const double along = cell->sign * n.dot(axis), across = n.cross(axis).norm();
      tangent = std::max(tangent, along > 0 ? 1.001 * across / along + 1e-6 : kAny);
    }
    // Borders of a closed cell bulge beyond its chords, in a flat one, too.
    for (int k = 0; k < 3 && face != nullptr; ++k)
      sagitta = std::max<double>(sagitta, cell->bulge[k]);
    NormalCone& cone = cones_[f];
    const Vec3 middle = facet.middle();
    double reach = cone.reach;
    for (int i = 0; i < 4; ++i)
      for (int j = 0; i + j < 4; ++j)
        reach = std::max(reach, (net[i][j] - middle).norm() + 1e-6 * shell.size());
    cone.reach = static_cast<float>(reach + sagitta);
    cone.tan_opening = widened_opening(tangent);
    // The offset points weigh 1 - b0^3 - b1^3 - b2^3 <= 8/9 in all.
    const double largest = std::max(facets_[f].middle(facet).norm(), facets_[f].largest_offset());
    facets_[f].bulge = static_cast<float>(std::max(largest * (8.0 / 9 + 1e-6), sagitta));
  });
  for (const CurvedFacet& curved : facets_) bulge_ = std::max<double>(bulge_, curved.bulge);
}

// A vertex where a line or circle passes through is no corner: its closest point is that of the
// joint, if anything.
void CurvedShell::leave_joints_whole(const Shell& shell) {
  constexpr int kCorner = -1, kNone = -2;
  std::vector<int> joint_at(shell.vertices().size(), kNone);
  std::vector<char> sides(shell.vertices().size(), 0);
  for (int f = 0; f < static_cast<int>(facets_.size()); ++f)
    for (int k = 0; k < 3; ++k) {
      if (facets_[f].owned.twin[k] == kNotOwned) continue;
      const int joint = is_on_joint(*this, f, k) ? face_cells()[f].joint[k] : kCorner;
      const int h = shell.half_edge(3 * f + k);
      for (const int v : {shell.vertex(h), shell.vertex(corner_after(h))}) {
        if (joint_at[v] == kNone) joint_at[v] = joint;
        if (joint_at[v] != joint || ++sides[v] > 2) joint_at[v] = kCorner;
      }
    }
  for (CurvedFacet& facet : facets_)
    for (int& v : facet.owned.vertex)
      if (v >= 0 && joint_at[v] >= 0 && sides[v] == 2) v = kNotOwned;
}

// Bounds of each element, and what lies beyond its sides.
void CurvedShell::bound_cells(const Shell& shell) {
  const Topology& topology = shell.topology();
  cells_.resize(facets_.size());
  for_each_in_parallel(facets_.size(), [&](std::size_t f) {
    const Facet& facet = shell.facets()[f];
    cells_[f] = facets_[f].flat ? CellBounds{}
                                : bounds_of(facet, facets_[f].patch(facet), facets_[f].bulge);
    cells_[f].bulge = facets_[f].bulge;
    for (int k = 0; k < 3; ++k) {
      const int h = shell.half_edge(static_cast<int>(3 * f) + k);
      const Edge& edge = topology.edge_at(h);
      cells_[f].beyond[k] = edge.count == 1  ? kBoundary
                            : edge.count > 2 ? kNotOwned
                                             : shell.facet_half_edge(topology.other_half_edge(h));
    }
  });
}

}  // namespace sphshell
