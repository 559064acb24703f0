// std::vector whose memory sits on large pages where the system lends them: a query touches a few
// lines far apart in hundreds of megabytes, and would pay for as many page-table walks.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <malloc.h>
#include <sys/mman.h>
#endif

namespace sphshell {

template <class T>
struct LargePageAllocator {
  using value_type = T;
  static constexpr std::size_t kPage = std::size_t(1) << 21;
  static constexpr std::size_t kLine = 64;

  LargePageAllocator() = default;
  template <class U>
  explicit LargePageAllocator(const LargePageAllocator<U>&) {}

  T* allocate(std::size_t n) {
    const std::size_t bytes = n * sizeof(T), unit = bytes >= kPage ? kPage : kLine;
    void* memory = std::aligned_alloc(unit, (bytes + unit - 1) / unit * unit);
    if (memory == nullptr) throw std::bad_alloc();
#ifdef __linux__
    if (bytes >= kPage) madvise(memory, bytes, MADV_HUGEPAGE);  // advice: may be refused
#endif
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, std::size_t) { std::free(memory); }

  // Elements that nothing was said about are left as the type's default constructor leaves them:
  // what is about to be filled need not be cleared first.
  template <class U>
  void construct(U* place) {
    ::new (static_cast<void*>(place)) U;
  }
  template <class U, class... Args>
  void construct(U* place, Args&&... args) {
    ::new (static_cast<void*>(place)) U(std::forward<Args>(args)...);
  }

  template <class U>
  bool operator==(const LargePageAllocator<U>&) const {
    return true;
  }
  template <class U>
  bool operator!=(const LargePageAllocator<U>&) const {
    return false;
  }
};

template <class T>
using LargeArray = std::vector<T, LargePageAllocator<T>>;

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
