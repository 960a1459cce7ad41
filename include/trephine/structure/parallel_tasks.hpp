// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/throwing.hpp>
#include <trephine/structure/label_volume.hpp>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Share of a build, [from, to] of 1, that a set of tasks advances.
struct ProgressShare {
  BuildProgress* progress;
  float from, to;
};

/// Number of threads for a wish of `threads`; 0: as many as the machine has.
[[nodiscard]] inline int thread_count(int threads) noexcept {
  return threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

/// Calls `work(task, thread)` once for each task in [0, tasks), on `threads` threads, of which the caller is one.
/// Returns false if the build was cancelled; some tasks then did not run. Rethrows the first exception of a task.
template <class Work>
[[nodiscard]] bool run_tasks(std::size_t tasks, int threads, const ProgressShare& share, const Work& work) {
  std::atomic<std::size_t> next{0}, finished{0};
  std::atomic<bool> failed{false};
  std::exception_ptr failure;
  std::mutex failure_mutex;
  const auto cancelled = [&] {
    return share.progress != nullptr && share.progress->cancel.load(std::memory_order_relaxed);
  };
  const auto report = [&](std::size_t count) {
    if (share.progress == nullptr) return;
    const float now = share.from + (share.to - share.from) * static_cast<float>(count) / static_cast<float>(tasks);
    float before = share.progress->done.load(std::memory_order_relaxed);
    while (before < now && !share.progress->done.compare_exchange_weak(before, now, std::memory_order_relaxed)) {
    }
  };
  const auto loop = [&](int thread) {
    const auto work_on = [&] {
      while (!cancelled() && !failed.load(std::memory_order_relaxed)) {
        const std::size_t task = next.fetch_add(1, std::memory_order_relaxed);
        if (task >= tasks) return;
        work(task, thread);
        report(finished.fetch_add(1, std::memory_order_relaxed) + 1);
      }
    };
    catch_all(work_on, [&] {
      const std::lock_guard lock(failure_mutex);
      if (!failed.exchange(true)) failure = std::current_exception();
    });
  };
  std::vector<std::thread> others;
  const auto join = [&] {
    for (std::thread& t : others) t.join();
  };
  const auto start = [&] {
    for (int t = 1; t < threads; ++t) others.emplace_back(loop, t);
  };
  catch_all(start, [] {});  // no thread to be had: those that there are do the work
  loop(0);
  join();
  if (failure) std::rethrow_exception(failure);
  return !cancelled();
}

}  // namespace trephine::detail
