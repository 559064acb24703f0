// std::vector whose memory sits on large pages where the system lends them: a query touches a few
// lines far apart in hundreds of megabytes, and would pay for as many page-table walks.
#pragma once

#include <cstddef>
#include <cstdlib>
#include <new>
#include <vector>

#ifdef __linux__
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
    const std::size_t bytes = n * sizeof(T);
    const std::size_t alignment = bytes >= kPage ? kPage : kLine;
    const std::size_t size = (bytes + alignment - 1) / alignment * alignment;
    void* memory = std::aligned_alloc(alignment, size);
    if (memory == nullptr) throw std::bad_alloc();
#ifdef __linux__
    if (alignment == kPage) madvise(memory, size, MADV_HUGEPAGE);  // advice: may be refused
#endif
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, std::size_t) { std::free(memory); }

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

}  // namespace sphshell
