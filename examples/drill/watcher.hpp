// SPDX-License-Identifier: MIT
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>

#if defined(_WIN32)
#include <io.h>
#else
#include <unistd.h>
#endif

namespace drill {

/// Whether standard output is a terminal, whose line may be overwritten.
[[nodiscard]] inline bool is_terminal() {
#if defined(_WIN32)
  return _isatty(1) != 0;
#else
  return isatty(1) != 0;
#endif
}

/// A thread that looks at a run now and then, so that the run itself never waits for a terminal or a file.
class Watcher {
 public:
  /// Calls `look(false)` every `interval`, and `look(true)` at the end, on the thread.
  Watcher(std::chrono::milliseconds interval, std::function<void(bool)> look)
      : look_(std::move(look)), thread_([this, interval] { watch(interval); }) {}
  ~Watcher() {
    {
      const std::lock_guard lock(mutex_);
      done_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }
  Watcher(const Watcher&) = delete;
  Watcher& operator=(const Watcher&) = delete;

 private:
  void watch(std::chrono::milliseconds interval) {
    std::unique_lock lock(mutex_);
    while (!wake_.wait_for(lock, interval, [this] { return done_; })) look_(false);
    look_(true);
  }

  std::function<void(bool)> look_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool done_ = false;
  std::thread thread_;
};

}  // namespace drill
