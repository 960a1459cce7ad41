// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>

#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// Input and result of one scene tick, enough to replay it and compare.
struct RecordedTick {
  TickInput input;
  double dt = 0;  ///< interval passed to the scene [s]
  TickResult result;
};

/// Records that were dropped: how many, and the time of the ticks among them.
struct DroppedRecords {
  std::uint64_t count = 0;
  double time = 0;  ///< [s]
};

/// What observers of a session take from a tick: a RecordedTick has it, and so has a servo loop's TickRecord.
template <class T>
concept ObservedTick = requires(const T& tick, RecordedTick& taken) {
  taken.input = tick.input;
  taken.dt = tick.dt;
  taken.result = tick.result;
};

/// Status that `record` of a Recorder or a SessionLog returns.
enum class RecordStatus : std::uint8_t {
  kOk = 0,
  kFull = 1,  ///< no room: the tick was counted as dropped and not stored
};

}  // namespace trephine
