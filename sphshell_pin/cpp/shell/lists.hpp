// What the standard library has from C++20 on, or lacks.
#pragma once

#include <algorithm>

namespace sphshell {

template <class List, class Is>
void erase_if(List& list, Is&& is) {
  list.erase(std::remove_if(list.begin(), list.end(), is), list.end());
}

// Sorts, and keeps each once.
template <class List>
void sort_unique(List& list) {
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

}  // namespace sphshell
