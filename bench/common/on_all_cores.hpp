// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdio>
#include <thread>
#include <vector>

namespace trephine::bench {

/// Calls work(i) for i < count, on every core, and says on standard error how far it is.
template <class Work>
void on_all_cores(std::size_t count, const char* program, const Work& work) {
  std::atomic<std::size_t> next{0};
  const auto take = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      work(i);
      if (i % 20 == 0) std::fprintf(stderr, "\r%s: %zu of %zu", program, i, count);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 1; t < std::max(1U, std::thread::hardware_concurrency()); ++t) threads.emplace_back(take);
  take();
  for (auto& t : threads) t.join();
  std::fprintf(stderr, "\n");
}

}  // namespace trephine::bench
