// SPDX-License-Identifier: MIT
// The queue of a session log between two threads: records come whole and in order, or are counted as dropped.
#include "logged.hpp"

#include <doctest/doctest.h>

#include <trephine/session/record_queue.hpp>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <thread>

namespace {

using namespace trephine;

TEST_CASE("session log: across threads records come whole, in order, or are counted where they lack") {
  constexpr std::int64_t kRecords = 200000;
  detail::RecordQueue queue(64);
  std::atomic<bool> done{false};
  std::atomic<std::int64_t> taken{0};
  std::thread haptic([&] {
    for (std::int64_t i = 0; i < kRecords; ++i) {
      // However rarely a busy machine lets the other thread run, it takes a hundredth.
      while (taken.load(std::memory_order_relaxed) < i / 100) std::this_thread::yield();
      queue.add(0.5, [&](detail::LogRecord& r) {
        r.number = i;
        r.tick.dt = static_cast<double>(i);
        r.tick.input.X_WT.matrix().topRows<3>().setConstant(static_cast<double>(i));
        r.tick.result.cutting.feed = static_cast<double>(i);
      });
      if (i % 32 == 0) std::this_thread::yield();
    }
    done.store(true, std::memory_order_release);
  });
  std::int64_t next = 0, torn = 0, misplaced = 0;
  DroppedRecords dropped;
  const auto use = [&](const detail::LogRecord& r) {
    const auto number = static_cast<double>(r.number);
    torn += r.tick.dt != number || r.tick.result.cutting.feed != number ||
            !(r.tick.input.X_WT.matrix().topRows<3>().array() == number).all();
    // What lacks before it has been counted.
    misplaced += r.number != next + static_cast<std::int64_t>(r.dropped.count - dropped.count);
    dropped = r.dropped;
    next = r.number + 1;
    taken.fetch_add(1, std::memory_order_relaxed);
  };
  while (true) {
    const bool last = done.load(std::memory_order_acquire);
    while (queue.take(16, use) > 0) {
    }
    if (last) break;
    std::this_thread::yield();
  }
  haptic.join();
  CHECK(torn == 0);
  CHECK(misplaced == 0);
  CHECK(taken.load() > kRecords / 200);
  CHECK(taken.load() + static_cast<std::int64_t>(queue.dropped().count) == kRecords);
  CHECK(queue.dropped().time == 0.5 * static_cast<double>(queue.dropped().count));
}

TEST_CASE("session log: a session of threads, watched by a third one") {
  std::string bytes;
  std::uint64_t dropped = 0, backwards = 0;
  std::atomic<bool> done{false};
  {
    // A disk that is slow now and then.
    int writes = 0;
    SessionLog log(
        [&](std::string_view more) {
          if (++writes % 4 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(20));
          bytes += more;
          return true;
        },
        {.records = 256, .flush = 0.01});
    std::thread haptic([&] {
      for (int i = 0; i < 20000; ++i) {
        log(test::numbered(i));
        if (i % 1000 == 0) log.tool_changed(i / 1000);
        if (i % 100 == 0) std::this_thread::sleep_for(std::chrono::microseconds(200));
      }
      done.store(true, std::memory_order_release);
    });
    std::thread watcher([&] {
      std::uint64_t before = 0;
      while (!done.load(std::memory_order_acquire)) {
        const std::uint64_t now = log.dropped();
        backwards += now < before;
        before = now;
        if (log.failed()) ++backwards;
        std::this_thread::yield();
      }
    });
    haptic.join();
    watcher.join();
    log.close();
    dropped = log.dropped();
  }
  const test::SessionFile file("trephine_session_threads.bin");
  const Session session = file.load_of(bytes);
  CHECK(backwards == 0);
  CHECK(session.report.complete);
  CHECK(session.report.dropped.count == dropped);
  CHECK(session.ticks.size() + session.tools.size() + dropped == 20020);
  int disordered = 0;
  for (std::size_t i = 1; i < session.ticks.size(); ++i)
    disordered += session.ticks[i].result.contact.count <= session.ticks[i - 1].result.contact.count;
  CHECK(disordered == 0);
}

}  // namespace
