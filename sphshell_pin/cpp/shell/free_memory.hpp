// Memory that was freed goes back to the system.
#pragma once

#include <cstddef>

#ifdef __linux__
#include <malloc.h>
#endif

namespace sphshell {

// To be called where much was freed: glibc's malloc would keep most of it for later. `count` is the
// number of triangles: small shells are not worth it.
inline void give_back_freed_memory(std::size_t count) {
#ifdef __GLIBC__
  if (count > 10000) malloc_trim(0);
#else
  (void)count;
#endif
}

}  // namespace sphshell
