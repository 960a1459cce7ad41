// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/device/tick_record.hpp>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace trephine {

/// One tick as the scene saw it: enough to give it again and compare.
struct RecordedTick {
  TickInput input;
  double dt = 0;
  TickResult result;
};

enum class RecordStatus : std::uint8_t {
  kOk = 0,
  kFull = 1,  ///< no room: the tick was counted in `dropped()` and not kept
};

/// Keeps the first `capacity` ticks of a session, because a replay must begin where the scene did. Storage is taken and
/// touched at construction (about 300 bytes a tick); recording allocates nothing, and being full is a status, not an
/// error. It is an observer of the servo loop: `loop.run_for(10s, recorder)` takes it by reference.
/// One thread at a time: read it when the loop has returned.
class Recorder {
 public:
  /// Throws std::invalid_argument when capacity is 0.
  explicit Recorder(std::size_t capacity) {
    if (capacity == 0) refuse("Recorder", "capacity must be > 0 ticks", capacity);
    storage_.resize(capacity);
  }

  RecordStatus record(const TickInput& input, double dt, const TickResult& result) noexcept {
    if (size_ == storage_.size()) {
      ++dropped_;
      return RecordStatus::kFull;
    }
    storage_[size_++] = {input, dt, result};
    return RecordStatus::kOk;
  }

  void operator()(const TickRecord& tick) noexcept { (void)record(tick.input, tick.dt, tick.result); }

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
