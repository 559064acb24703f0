// Loops whose rounds do not depend on each other, over threads.
#pragma once

#include <algorithm>
#include <cstddef>
#include <future>
#include <thread>
#include <vector>

namespace sphshell {

constexpr int kAllCores = 1 << 10;
constexpr std::size_t kGrain = 4096;  // rounds: below, a thread costs more than it saves

// Splits 0..n over threads: work(begin, end), at least `grain` rounds for each. Each round writes
// only to places of its own, so results do not depend on the threads. Rethrows what work() throws,
// once all threads are done.
template <class Work>
void in_parallel(std::size_t n, int threads, std::size_t grain, Work&& work) {
  const int cores = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1u));
  const std::size_t wanted = static_cast<std::size_t>(std::clamp(threads, 1, cores));
  const std::size_t workers = std::clamp<std::size_t>(wanted, 1, n / grain + 1);
  std::vector<std::future<void>> pool;
  for (std::size_t w = 1; w < workers; ++w)
    pool.push_back(
        std::async(std::launch::async, [&, w] { work(n * w / workers, n * (w + 1) / workers); }));
  work(0, n / workers);
  for (std::future<void>& worker : pool) worker.get();
}

// One round after the other, over all cores: building a large shell.
template <class Round>
void for_each_in_parallel(std::size_t n, Round&& round) {
  in_parallel(n, kAllCores, kGrain, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) round(i);
  });
}

}  // namespace sphshell
