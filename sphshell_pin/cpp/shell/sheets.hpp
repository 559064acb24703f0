// Connected, oriented pieces of a surface and their rims.
#pragma once

#include <cstdint>
#include <vector>

namespace sphshell {

struct Topology;

// Triangles that are connected through edges of two half-edges wound alike form a sheet: it has an
// orientation. What is left are its rims: borders, and edges of three or more triangles.
struct Sheets {
  std::vector<int> sheet;         // per triangle
  std::vector<std::uint8_t> rim;  // per triangle, bit k: its side k is on a rim
  std::vector<char> closed;       // per sheet: it has no rim

  explicit Sheets(const Topology& topology);
};

}  // namespace sphshell
