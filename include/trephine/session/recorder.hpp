// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/session/recorded_tick.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// An observer of the servo loop that stores the first `capacity` ticks of a session. It drops later ticks, because a
/// replay must start at the scene's first tick. Usage: `loop.run_for(10s, recorder)`, which takes it by reference.
/// Storage (about 400 bytes a tick) is allocated and written at construction, so recording allocates nothing. A full
/// recorder returns a status, no error. One thread at a time: read it after the loop has returned.
class Recorder {
 public:
  /// Throws std::invalid_argument if the capacity [ticks] is 0.
  explicit Recorder(std::size_t capacity) {
    if (capacity == 0) refuse("Recorder", "capacity must be > 0 ticks", capacity);
    storage_.resize(capacity);
  }

  /// Stores a tick if there is room.
  RecordStatus record(const TickInput& input, double dt, const TickResult& result) noexcept {
    if (size_ == storage_.size()) {
      ++dropped_;
      return RecordStatus::kFull;
    }
    storage_[size_++] = {input, dt, result};
    return RecordStatus::kOk;
  }

  template <ObservedTick Tick>
  void operator()(const Tick& tick) noexcept {
    (void)record(tick.input, tick.dt, tick.result);
  }

  [[nodiscard]] std::span<const RecordedTick> ticks() const noexcept { return {storage_.data(), size_}; }
  [[nodiscard]] std::size_t size() const noexcept { return size_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return storage_.size(); }
  [[nodiscard]] bool full() const noexcept { return size_ == storage_.size(); }
  [[nodiscard]] std::uint64_t dropped() const noexcept { return dropped_; }

  void clear() noexcept {
    size_ = 0;
    dropped_ = 0;
  }

 private:
  std::vector<RecordedTick> storage_;
  std::size_t size_ = 0;
  std::uint64_t dropped_ = 0;
};

}  // namespace trephine
