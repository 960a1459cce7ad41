// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/session/recorded_tick.hpp>

#include <algorithm>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// What the haptic thread hands to a log.
struct LogRecord {
  enum class Kind : std::uint8_t { kTick = 1, kTool = 2, kEvent = 3 };
  Kind kind = Kind::kTick;
  std::int64_t number = 0;  // of the tool or event
  RecordedTick tick;
  DroppedRecords dropped{};  // all before this record, since the start
};

/// A bounded queue from one thread, which adds, to one thread, which takes. Neither waits, locks or allocates. A full
/// queue drops what is added, and counts it; the next record that finds room says how much.
class RecordQueue {
 public:
  /// Takes all memory now. Throws std::invalid_argument unless the capacity is 1 to 2^24 records; it is rounded up to a
  /// power of two.
  explicit RecordQueue(std::size_t capacity) {
    if (capacity < 1 || capacity > kMaxCapacity) refuse("SessionLog", "records must be 1 to 2^24", capacity);
    slots_.resize(std::bit_ceil(capacity));
  }

  /// True if the next record will not be dropped. Adding thread.
  [[nodiscard]] bool has_room() noexcept {
    if (added_ - taken_seen_ == slots_.size()) taken_seen_ = taken_.load(std::memory_order_acquire);
    return added_ - taken_seen_ < slots_.size();
  }

  /// Adds a record that `fill(LogRecord&)` writes; `time` [s] counts if it is dropped. False if it was. Adding thread.
  template <class Fill>
  bool add(double time, Fill&& fill) noexcept {
    if (!has_room()) {
      dropped_.time += time;
      dropped_.count += 1;
      dropped_time_.store(dropped_.time, std::memory_order_relaxed);
      dropped_count_.store(dropped_.count, std::memory_order_relaxed);
      return false;
    }
    LogRecord& slot = slots_[added_ & (slots_.size() - 1)];
    fill(slot);
    slot.dropped = dropped_;
    head_.store(++added_, std::memory_order_release);
    return true;
  }

  /// Calls `use(const LogRecord&)` for records in the queue, at most `most`; returns their number. Taking thread.
  template <class Use>
  std::size_t take(std::size_t most, Use&& use) {
    const std::uint64_t head = head_.load(std::memory_order_acquire);
    const auto count = static_cast<std::size_t>(std::min<std::uint64_t>(head - took_, most));
    for (std::size_t i = 0; i < count; ++i) {
      use(static_cast<const LogRecord&>(slots_[took_ & (slots_.size() - 1)]));
      taken_.store(++took_, std::memory_order_release);
    }
    return count;
  }

  /// All dropped so far. Any thread; the two numbers may belong to different moments unless adding has ended.
  [[nodiscard]] DroppedRecords dropped() const noexcept {
    return {dropped_count_.load(std::memory_order_relaxed), dropped_time_.load(std::memory_order_relaxed)};
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }

 private:
  static constexpr std::size_t kMaxCapacity = std::size_t{1} << 24;
  static constexpr std::size_t kCacheLine = 64;  // [bytes] keeps data of the two threads in separate lines
  static_assert(std::atomic<std::uint64_t>::is_always_lock_free && std::atomic<double>::is_always_lock_free);

  std::vector<LogRecord> slots_;
  alignas(kCacheLine) std::atomic<std::uint64_t> head_{0};  // records added
  std::atomic<std::uint64_t> dropped_count_{0};
  std::atomic<double> dropped_time_{0};
  std::uint64_t added_ = 0;  // these are the adding thread's alone
  std::uint64_t taken_seen_ = 0;
  DroppedRecords dropped_;
  alignas(kCacheLine) std::atomic<std::uint64_t> taken_{0};  // records taken
  std::uint64_t took_ = 0;                                   // the taking thread's alone
};

}  // namespace detail

}  // namespace trephine
