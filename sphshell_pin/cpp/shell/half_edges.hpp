// Half-edges grouped by the edge they belong to.
#pragma once

#include <algorithm>
#include <numeric>

#include "shell/large_array.hpp"

namespace sphshell {

// Calls edge(low, high, first, last) for every pair of vertices that half-edges join, pairs in
// ascending order; *first .. *last hold the pair's half-edges in ascending order, in the low half
// of each word. ends(h) gives the two vertices of half-edge h; one that leads nowhere is left out.
template <class Ends, class Visit>
void for_each_edge(std::size_t half_edges, std::size_t vertices, Ends&& ends, Visit&& edge) {
  // Counting sort by the lower vertex; what shares it is sorted as one word, higher vertex first.
  LargeArray<std::uint32_t> start(vertices + 2, 0);
  for (std::size_t h = 0; h < half_edges; ++h) {
    const auto [a, b] = ends(h);
    if (a != b) ++start[static_cast<std::size_t>(std::min(a, b)) + 2];
  }
  std::partial_sum(start.begin(), start.end(), start.begin());
  LargeArray<std::uint64_t> words(start.back());
  // start[v + 1] runs from the beginning of the bucket of v to its end.
  for (std::size_t h = 0; h < half_edges; ++h) {
    const auto [a, b] = ends(h);
    if (a == b) continue;
    words[start[static_cast<std::size_t>(std::min(a, b)) + 1]++] =
        std::uint64_t(static_cast<std::uint32_t>(std::max(a, b))) << 32 | std::uint32_t(h);
  }
  for (std::size_t v = 0; v < vertices; ++v) {
    std::uint64_t* const begin = words.data() + start[v];
    std::uint64_t* const end = words.data() + start[v + 1];
    std::sort(begin, end);
    for (std::uint64_t *first = begin, *last; first != end; first = last) {
      for (last = first + 1; last != end && *last >> 32 == *first >> 32;) ++last;
      edge(static_cast<int>(v), static_cast<int>(*first >> 32), first, last);
    }
  }
}

}  // namespace sphshell
