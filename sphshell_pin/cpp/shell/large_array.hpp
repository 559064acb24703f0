// std::vector whose memory sits on large pages where the system lends them: a query touches a few
// lines far apart in hundreds of megabytes, and would pay for as many page-table walks.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <utility>
#include <vector>

#ifdef __linux__
#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>
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
#ifdef __linux__
    if (bytes >= kPage) return static_cast<T*>(map(bytes));
#endif
    const std::size_t size = (bytes + kLine - 1) / kLine * kLine;
    void* memory = std::aligned_alloc(kLine, size);
    if (memory == nullptr) throw std::bad_alloc();
    return static_cast<T*>(memory);
  }

  void deallocate(T* memory, std::size_t n) {
#ifdef __linux__
    if (n * sizeof(T) >= kPage) {
      munmap(memory, n * sizeof(T));
      return;
    }
#else
    (void)n;
#endif
    std::free(memory);
  }

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

 private:
#ifdef __linux__
  // Memory of its own, which goes back to the system when it is freed; malloc would keep it. Begins
  // on a large page; the last, incomplete one stays in small pages.
  static void* map(std::size_t bytes) {
    void* const all =
        mmap(nullptr, bytes + kPage, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (all == MAP_FAILED) throw std::bad_alloc();
    const auto begin = reinterpret_cast<std::uintptr_t>(all);
    const std::uintptr_t first = (begin + kPage - 1) / kPage * kPage;
    const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
    const std::uintptr_t last = (first + bytes + page - 1) / page * page;
    if (first > begin) munmap(all, first - begin);
    if (begin + bytes + kPage > last)
      munmap(reinterpret_cast<void*>(last), begin + bytes + kPage - last);
    void* const memory = reinterpret_cast<void*>(first);
    madvise(memory, bytes, MADV_HUGEPAGE);  // advice: may be refused
    return memory;
  }
#endif
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
