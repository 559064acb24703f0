#include "shell/curved/curved.hpp"

#include "shell/curved/creases.hpp"
#include "shell/curved/limiter.hpp"
#include "shell/curved/vertex_normals.hpp"

namespace sphshell {

// Coordinates are known to this share of the box at best: single precision, with a margin.
constexpr double kSinglePrecision = 2e-7;
// And vertices are moved by sqrt(3) times the rounding of their coordinates at most.
constexpr double kOfRounding = 1.8;
// Vertices are moved onto faces that were recognized by so many tolerances, within which they are
// found there.
constexpr double kMostMoved = 3;
// Systems write CAD files whose edges are off the faces by this share of the size.
constexpr double kFileTolerance = 1e-4;

static double tolerance_of(const Shell& shell, const CurveOptions& options) {
  return std::max(kSinglePrecision * shell.size(), kOfRounding * options.rounding);
}

std::shared_ptr<Shell> curve(const std::shared_ptr<Shell>& shell, CurveOptions options) {
  const double tolerance = tolerance_of(*shell, options);
  std::shared_ptr<Shell> out = shell;
  bool recognized = false;
  // Means of facet normals are no information: better ones are estimated.
  options.estimate =
      !options.exact && !options.normals.empty() && estimated_elsewhere(*shell, options.normals);
  if (options.faces && !options.known && !options.exact && shell->crease_angle() > 0) {
    options.regions = std::make_shared<const CoplanarRegions>(*shell, tolerance);
    Faces faces = recognize_faces(*shell, *options.regions, tolerance);
    // Nothing is moved onto faces that are given up.
    if (!options.normals.empty() && !options.estimate)
      settle_given_normals(*shell, options.normals, faces);
    if (!faces.of.empty()) options.known = std::make_shared<const Faces>(std::move(faces));
    recognized = true;
  }
  // Vertices are off the faces by the rounding of their coordinates, or the tolerance of a file.
  const double most = recognized ? kMostMoved * tolerance : kFileTolerance * shell->size();
  std::vector<Vec3> moved;
  if (options.known) moved = snapped_vertices(*shell, *options.known, most);
  if (!moved.empty()) {
    options.regions = nullptr;
    out = std::make_shared<Shell>(std::move(moved), shell->triangles(), shell->element(),
                                  shell->crease_angle(), shell->side());
  }
  out->curve(std::move(options));
  return out;
}

CurvedShell::CurvedShell(const Shell& shell, CurveOptions options) {
  const bool given = !options.normals.empty();
  normals_ = std::move(options.normals);
  std::vector<Trust> trust;
  std::shared_ptr<const CoplanarRegions> regions = options.regions;
  exact_ = given;
  if (options.known) faces_ = *options.known;
  divided_.assign(3 * shell.triangles().size(), 0);
  if (!options.exact) {
    if (!regions)
      regions = std::make_shared<const CoplanarRegions>(shell, tolerance_of(shell, options));
    // Normals that were given are kept but where faces are known; else they are estimated. Then
    // fans are divided at the creases that the elements show.
    EstimatedNormals settled = given && !options.estimate
                                   ? settle_given_normals(shell, normals_, faces_)
                                   : estimate_normals(shell, *regions, faces_);
    trust = std::move(settled.trust);
    CornerNormals found =
        divide_at_creases(shell, std::move(settled.normals), settled.given, faces_);
    divided_ = std::move(found.set_aside);
    creases_ = found.creases;
    for (std::size_t c = 0; c < normals_.size(); ++c)
      divided_[c] = divided_[c] || (normals_[c] - found.normals[c]).norm() > kSameNormal;
    normals_ = std::move(found.normals);
  }
  give_back_freed_memory(shell.triangles().size());
  // Sides first, as neighbors share them; then the middles, which each element has for itself.
  bend_edges(shell, options.straight, regions.get(), trust);
  std::vector<Trust>().swap(trust);
  raise_centers(shell);
  std::vector<Vec3>().swap(normals_);
  face_cells_ = make_face_cells(shell, faces_, facets_);
  if (!face_cells().empty()) gap_ = kMostGap * shell.size();
  build_cones(shell);
  bound_cells(shell);
  if (!face_cells().empty()) face_search_ = std::make_unique<FaceSearch>(shell, *this);
}

// Why an element is flat: its normals were set aside at a crease, or do not lean.
Bending CurvedShell::bending(const Shell& shell, int triangle) const {
  if (!facets_[triangle_of(shell.facet_half_edge(3 * triangle))].flat) return Bending::Curved;
  const char* corner = &divided_[3 * triangle];
  return corner[0] || corner[1] || corner[2] ? Bending::Crease : Bending::Planar;
}

// Per triangle [m], from the turns of the flat elements at sides over which the curved ones are
// smooth.
std::vector<double> CurvedShell::chord_errors(const Shell& shell) const {
  const Topology& topology = shell.topology();
  const auto normal_at = [&](int corner) {
    const int f = triangle_of(shell.facet_half_edge(3 * triangle_of(corner)));
    static constexpr double kU[3] = {0, 1, 0}, kV[3] = {0, 0, 1};
    const double u = kU[side_of(corner)], v = kV[side_of(corner)];
    const CubicPatch patch = facets_[f].patch(shell.facets()[f]);
    return patch.along_u(u, v).cross(patch.along_v(u, v)).normalized();
  };
  const CoplanarRegions regions(shell, kSinglePrecision * shell.size());
  const SagittaWitness witness(shell, regions, [&](const Edge& edge) {
    const auto [h, g] = topology.half_edges(edge);
    return (normal_at(h) - normal_at(corner_after(g))).norm() <= 10 * kSameNormal &&
           (normal_at(corner_after(h)) - normal_at(g)).norm() <= 10 * kSameNormal;
  });
  std::vector<double> out;
  for (int t = 0; t < static_cast<int>(facets_.size()); ++t) {
    out.push_back(witness.of(t));
    for (int k = 0; k < 3; ++k) {
      const Edge& edge = topology.edge_at(3 * t + k);
      for (const int h : topology.around(edge))
        out.back() = std::max(out.back(), witness.of(triangle_of(h)));
    }
  }
  return out;
}

}  // namespace sphshell
