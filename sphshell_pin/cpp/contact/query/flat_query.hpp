// The exact polyhedron: one contact at every local minimum of the distance over the surface.
#pragma once

#include "contact/query/broad_phase.hpp"
#include "contact/query/minimum.hpp"

namespace sphshell {

// Minima of the distance on flat facets. Keeps its memory.
class FlatQuery {
 public:
  FlatQuery();

  void find(const Shell& shell, const Sphere& sphere, BroadPhase& broad, bool want_dn_dc,
            std::vector<Minimum>& minima);

 private:
  // The features whose normal cone holds the center; and those that a simpler one makes
  // superfluous.
  void find_features(const Shell& shell, const Sphere& sphere, const std::vector<int>& candidates);
  void drop_neighbors(const Shell& shell);
  void add_minima(const Shell& shell, const Sphere& sphere, bool want_dn_dc,
                  std::vector<Minimum>& minima);
  void merge_equal_points(double tolerance, std::vector<Minimum>& minima);
  void drop_crossed(const Shell& shell, const Sphere& sphere, const std::vector<int>& overlapping,
                    double tolerance, std::vector<Minimum>& minima);
  void remove_dropped(std::vector<Minimum>& minima) const;
  void find_pinched(const Shell& shell, const Sphere& sphere, const std::vector<int>& overlapping,
                    double tolerance, const std::vector<Minimum>& minima);
  void add_pinched(const Shell& shell, const Sphere& sphere, bool want_dn_dc, double tolerance,
                   std::vector<Minimum>& minima) const;

  // A pinched vertex inside the sphere. The fans there that have a minimum, each by itself; and how
  // many saddles are between them.
  struct Pinched {
    const Pinch* at;
    double depth;
    std::vector<const std::vector<int>*> fans;
    int saddles;
  };

  std::vector<int> faces_;             // facets that the center projects into
  std::vector<int> edges_, vertices_;  // 3 facet + k: those that may hold the closest point
  std::vector<int> taken_edges_, taken_vertices_, by_x_, at_point_;
  std::vector<char> dropped_;
  std::vector<Pinched> pinched_;
};

}  // namespace sphshell
