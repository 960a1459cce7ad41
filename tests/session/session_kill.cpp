// SPDX-License-Identifier: MIT
// A process that is killed at any moment leaves a session that is read up to the last second. POSIX only.
#include "logged.hpp"
#include "posix.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstddef>
#include <filesystem>
#include <new>
#include <random>
#include <string>
#include <thread>
#include <vector>

#if defined(__unix__) || defined(__APPLE__)

namespace {

using namespace trephine;
using namespace std::chrono_literals;

/// Ticks that a child has logged, which the parent reads after the kill.
using Count = std::atomic<int>;
static_assert(Count::is_always_lock_free);

/// A process that logs a tick a millisecond until it is killed.
[[noreturn]] void drill_forever(const std::filesystem::path& path, Count& logged) {
  SessionLog log(path);
  auto due = std::chrono::steady_clock::now();
  for (int i = 0;; ++i) {
    log(test::numbered(i));
    logged.store(i + 1, std::memory_order_relaxed);
    due += 1ms;
    std::this_thread::sleep_until(due);
  }
}

TEST_CASE("session log: 100 processes killed at any moment lose less than a second each") {
  constexpr int kRounds = 10, kAtOnce = 10;
  constexpr int kSecond = 1000;  // [ticks]
  void* const memory =
      mmap(nullptr, sizeof(Count) * kAtOnce, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  REQUIRE(memory != MAP_FAILED);
  auto* const logged = static_cast<Count*>(memory);
  std::mt19937 random(3);
  int most_lost = 0, most_read = 0, with_lost_bytes = 0;
  for (int round = 0; round < kRounds; ++round) {
    std::array<pid_t, kAtOnce> children{};
    std::vector<std::filesystem::path> paths;
    for (std::size_t c = 0; c < kAtOnce; ++c) {
      paths.push_back(std::filesystem::temp_directory_path() /
                      ("trephine_kill_" + std::to_string(getpid()) + "_" + std::to_string(c)));
      std::filesystem::remove(paths[c]);
      new (&logged[c]) Count(0);
      children[c] = fork();
      REQUIRE(children[c] >= 0);
      if (children[c] == 0) drill_forever(paths[c], logged[c]);
    }
    // In half of the rounds soon after the start, where a file may have but its head or less.
    for (std::size_t c = 0; c < kAtOnce; ++c) {
      std::this_thread::sleep_for(std::chrono::microseconds(random() % (round % 2 == 0 ? 10000 : 300000)));
      kill(children[c], SIGKILL);
    }
    for (std::size_t c = 0; c < kAtOnce; ++c) {
      CAPTURE(round);
      CAPTURE(c);
      int status = 0;
      REQUIRE(waitpid(children[c], &status, 0) == children[c]);
      REQUIRE(WIFSIGNALED(status));
      const int made = logged[c].load(std::memory_order_relaxed);
      if (made == 0) {  // killed before its first tick
        std::filesystem::remove(paths[c]);
        continue;
      }
      const Session session = load_session(paths[c]);
      const int read = static_cast<int>(session.ticks.size());
      CHECK_FALSE(session.report.complete);
      CHECK(session.report.dropped.count == 0);
      CHECK(read >= made - kSecond);
      CHECK(read <= made + 1);
      for (int i = 0; i < read; ++i)
        if (session.ticks[static_cast<std::size_t>(i)].result.contact.count != i) FAIL("tick " << i << " is another");
      most_lost = std::max(most_lost, made - read);
      most_read = std::max(most_read, read);
      with_lost_bytes += session.report.lost_bytes > 0;
      std::filesystem::remove(paths[c]);
    }
  }
  munmap(memory, sizeof(Count) * kAtOnce);
  CHECK(most_read > kSecond);  // otherwise a file without a tick would do
  MESSAGE("most lost, most read [ticks], files with a part of a chunk: ", most_lost, " ", most_read, " ",
          with_lost_bytes);
}

}  // namespace

#endif
