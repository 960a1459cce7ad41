// SPDX-License-Identifier: MIT
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <map>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace trephine::bench {

/// Calls work(i) for i < count, on every core, and says on standard error how many seconds each name_of(i) took.
template <class Work, class Name>
void on_all_cores(std::size_t count, const char* program, const Work& work, const Name& name_of) {
  using Clock = std::chrono::steady_clock;
  std::atomic<std::size_t> next{0};
  std::mutex mutex;
  std::map<std::string, double> seconds;
  const auto take = [&] {
    for (std::size_t i = next++; i < count; i = next++) {
      const auto began = Clock::now();
      work(i);
      const std::lock_guard lock(mutex);
      seconds[name_of(i)] += std::chrono::duration<double>(Clock::now() - began).count();
      if (i % 20 == 0) std::fprintf(stderr, "\r%s: %zu of %zu", program, i, count);
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 1; t < std::max(1U, std::thread::hardware_concurrency()); ++t) threads.emplace_back(take);
  take();
  for (auto& t : threads) t.join();
  std::fprintf(stderr, "\n");
  for (const auto& [name, s] : seconds) std::fprintf(stderr, "%s: %s: %.1f s of processor\n", program, name.c_str(), s);
}

}  // namespace trephine::bench
