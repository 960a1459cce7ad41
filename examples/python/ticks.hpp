// SPDX-License-Identifier: MIT
#pragma once

#include "bind.hpp"

#include <trephine/session/tick_bytes.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace trephine_python {

/// Ticks as files of sessions hold them.
[[nodiscard]] inline std::string bytes_of(std::span<const RecordedTick> ticks) {
  std::string bytes;
  for (const RecordedTick& tick : ticks) recording_detail::put_tick(bytes, tick);
  return bytes;
}
/// Throws std::invalid_argument for bytes of another length.
[[nodiscard]] inline std::vector<RecordedTick> ticks_of(const std::string& bytes) {
  constexpr std::size_t kEach = recording_detail::kTickBytes;
  if (bytes.size() % kEach != 0) refuse("Recording", "a pickle must hold whole ticks of this version", bytes.size());
  std::vector<RecordedTick> ticks;
  recording_detail::Cursor cursor(bytes.data());
  while (ticks.size() < bytes.size() / kEach)
    ticks.push_back(recording_detail::take_tick(cursor, recording_detail::kVersion));
  return ticks;
}

/// Pickles `of(result)`, which is a tick's result or a part of it.
template <class Part, class Of>
[[nodiscard]] auto pickled_in_tick(Of of) {
  return py::pickle(
      [of](const Part& self) {
        RecordedTick tick;
        of(tick.result) = self;
        return py::bytes(bytes_of(std::span(&tick, 1)));
      },
      [of](const py::bytes& bytes) { return Part(of(ticks_of(bytes).at(0).result)); });
}

}  // namespace trephine_python
