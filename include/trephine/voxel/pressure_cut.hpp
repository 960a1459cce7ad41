// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_policy.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Cuts in proportion to the pressure: bone in the head recedes by the same fraction of its depth everywhere. The
/// law of the scene's `Cutting` gives each tick's fraction, by the force that presses the head.
///
/// A voxel falls by this fraction of what a geometric cut would take. The ramp before the head is linear, so the
/// isosurface moves by the fraction of its depth in the head, and keeps the head's shape.
///
/// The scene cuts at the renderer's `pressure_cutting_pose()`. Integer densities fall by whole steps with an exact
/// mean, evenly in time. Two runs give the same bits.
struct PressureCut {
  static constexpr CutKind kKind = CutKind::kByPressure;
  void validate() const {}

  template <VoxelDensity Density>
  struct Limit {
    float fraction;       // 0 to 1
    std::uint32_t phase;  // fraction of a turn, in units of 2^-32

    using Wide = WideDensity<Density>;
    /// `factor`: of the tissue at this voxel (TissueMap).
    [[nodiscard]] Wide operator()(Wide old, Wide target, float factor, std::uint32_t voxel) const noexcept {
      const float f = fraction * factor;
      const float drop = (f < 1 ? f : 1.0F) * (static_cast<float>(old) - static_cast<float>(target));
      return detail::lowered<Density>(old, drop, target, detail::scramble(voxel) + phase);
    }
  };
  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance& a) const noexcept {
    return {static_cast<float>(a.fraction), a.tick * 0x9E3779B9U};
  }
};

}  // namespace trephine
