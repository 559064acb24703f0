// How far estimated normals may bend the elements: a slope limiter.
//
// Where a surface turns by an angle t between two facets of heights h and g over their common side,
// its distance from one of them is at least about t min(h, g) / 16: the turn is real, but only the
// lower facet can hold it. Estimates that take a share of the turn for the higher facet bulge it by
// t h / 8 instead. As in schemes for conservation laws (van Leer, J. Comput. Phys. 23 (1977) 276;
// ENO: Harten et al., J. Comput. Phys. 71 (1987) 231) the smaller of two slopes limits both.
#pragma once

#include "shell/faces/coplanar.hpp"
#include "shell/curved/fans.hpp"

namespace sphshell {

// The long side of a turn does not bend: in a fan the facets that are not much lower than one
// beside them give the normal.
class Dominance {
 public:
  Dominance(const Shell& shell, const CoplanarRegions& regions);
  // False where no facet of the fan is much higher than another; else by how much one is.
  bool normal(Span fan, Vec3& normal, double& ratio) const;

 private:
  const Shell& shell_;
  const CoplanarRegions& regions_;
  std::vector<char> uneven_;  // per edge: one of its two facets is much higher than the other
};

// The largest sagitta that the turns around each coplanar region account for: a lower bound, within
// a factor of two, of what the flat elements are off the surface there. And that of most of the
// surface: who meshed it made its errors alike.
class SagittaWitness {
 public:
  // is_smooth(edge): whether the surface goes on across an edge of two triangles.
  template <class IsSmooth>
  SagittaWitness(const Shell& shell, const CoplanarRegions& regions, IsSmooth&& is_smooth)
      : regions_(regions), sagitta_(static_cast<std::size_t>(regions.size()), 0) {
    sides_.reserve(shell.topology().edges.size());
    for (const Edge& edge : shell.topology().edges)
      if (edge.count == 2 && is_smooth(edge)) add(shell, edge);
    find_usual();
  }

  double of(int triangle) const { return sagitta_[regions_.of(triangle)]; }  // [m]
  // Most that a curved edge may leave its chord [m]. smooth: the surface goes on across it; fitted:
  // its normals are those of a surface that fits the vertices around.
  double most(const Shell& shell, const Edge& edge, bool smooth, bool fitted) const;

 private:
  // Counts the turn over an edge; and what is usual once all are counted.
  void add(const Shell& shell, const Edge& edge);
  void find_usual();

  const CoplanarRegions& regions_;
  std::vector<float> sagitta_;                  // per region [m]
  std::vector<std::pair<float, float>> sides_;  // sagitta, length [m]
  double usual_ = 0;                            // [m]
};

}  // namespace sphshell
