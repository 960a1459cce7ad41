// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Input and result of one scene tick, enough to replay it and compare.
struct RecordedTick {
  TickInput input;
  double dt = 0;  ///< interval passed to the scene [s]
  TickResult result;
};

/// What observers of a session take from a tick: a RecordedTick has it, and so has a servo loop's TickRecord.
template <class T>
concept ObservedTick = requires(const T& tick, RecordedTick& taken) {
  taken.input = tick.input;
  taken.dt = tick.dt;
  taken.result = tick.result;
};

}  // namespace trephine
