// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/bit_cast.hpp>
#include <trephine/device/tickable_scene.hpp>
#include <trephine/session/recorded_tick.hpp>

#include <cstdint>
#include <optional>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Comparison of a replay with its recording.
struct ReplayReport {
  std::uint64_t ticks = 0;
  std::uint64_t different = 0;                   ///< ticks with any output that differs in a bit
  std::optional<std::uint64_t> first_different;  ///< the first of them
  Wrenchd wrench;                                ///< wrench of the replay at that tick
  Wrenchd recorded;                              ///< recorded wrench at that tick

  [[nodiscard]] bool identical() const noexcept { return different == 0; }
};

/// Returns true if all bits are equal. Unlike ==, -0 differs from 0, and NaN equals itself.
[[nodiscard]] inline bool same_bits(double a, double b) noexcept {
  return detail::bit_cast<std::uint64_t>(a) == detail::bit_cast<std::uint64_t>(b);
}
[[nodiscard]] inline bool same_bits(const Vec3d& a, const Vec3d& b) noexcept {
  return same_bits(a.x(), b.x()) && same_bits(a.y(), b.y()) && same_bits(a.z(), b.z());
}
[[nodiscard]] inline bool same_bits(const Wrenchd& a, const Wrenchd& b) noexcept {
  return same_bits(a.force, b.force) && same_bits(a.torque, b.torque);
}
/// Leaves out membranes, which no recording holds.
[[nodiscard]] inline bool same_bits(const StructureSummary& a, const StructureSummary& b) noexcept {
  return a.nearest == b.nearest && a.warns == b.warns && same_bits(a.distance, b.distance) &&
         same_bits(a.push, b.push) && same_bits(a.refused_mm3, b.refused_mm3) && same_bits(a.taken_mm3, b.taken_mm3);
}
[[nodiscard]] inline bool same_bits(const CuttingSummary& a, const CuttingSummary& b) noexcept {
  return same_bits(a.thrust, b.thrust) && same_bits(a.torque, b.torque) && same_bits(a.spindle, b.spindle) &&
         same_bits(a.feed, b.feed);
}
[[nodiscard]] inline bool same_bits(const TickResult& a, const TickResult& b) noexcept {
  return same_bits(a.wrench, b.wrench) && a.status == b.status && a.contact.count == b.contact.count &&
         a.contact.tip == b.contact.tip && a.contact.shaft == b.contact.shaft &&
         same_bits(a.contact.depth, b.contact.depth) && same_bits(a.removed_mm3, b.removed_mm3) &&
         same_bits(a.structures, b.structures) && same_bits(a.cutting, b.cutting);
}

/// Ticks `scene` with the recorded inputs and compares every output bit by bit. The scene must have its state from the
/// start of the recording: the same volume (restored), tool, parameters and contact state, floors with their counts
/// reset (`CutFloor::reset_counts`), in the same binary. No wrench acts at the start. A recording from a file of
/// version 1 has no structures, and one before version 3 no forces of cutting: it differs from a scene that reports
/// them. Afterwards the scene has its state from the end of the recording.
template <TickableScene Scene>
[[nodiscard]] ReplayReport replay(std::span<const RecordedTick> recording, Scene& scene) {
  ReplayReport report;
  if constexpr (requires { scene.forget_wrench(); }) scene.forget_wrench();
  for (const RecordedTick& tick : recording) {
    const TickResult result = scene.tick(tick.input, tick.dt);
    if (!same_bits(result, tick.result)) {
      ++report.different;
      if (!report.first_different) {
        report.first_different = report.ticks;
        report.wrench = result.wrench;
        report.recorded = tick.result.wrench;
      }
    }
    ++report.ticks;
  }
  return report;
}

}  // namespace trephine
