#include "shell/sheets.hpp"

#include "shell/disjoint_sets.hpp"
#include "shell/topology.hpp"

namespace sphshell {

Sheets::Sheets(const Topology& topology) : rim(topology.face_normal.size(), 0) {
  DisjointSets sets(rim.size());
  for (const Edge& edge : topology.edges) {
    if (!edge.on_rim()) {
      sets.merge(triangle_of(topology.incidence[edge.begin]),
                 triangle_of(topology.incidence[edge.begin + 1]));
      continue;
    }
    for (int i = 0; i < edge.count; ++i) {
      const int h = topology.incidence[edge.begin + i];
      rim[triangle_of(h)] |= static_cast<std::uint8_t>(1 << side_of(h));
    }
  }
  // Triangles that edges connect which are no border.
  sheet = sets.labels();
  closed.assign(static_cast<std::size_t>(sets.count()), 1);
  for (std::size_t t = 0; t < rim.size(); ++t)
    // A sheet with any border edge is open.
    if (rim[t]) closed[static_cast<std::size_t>(sheet[t])] = 0;
}

}  // namespace sphshell
