// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/bit_cast.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <algorithm>
#include <concepts>
#include <cstdint>

/// Policies for the speed of a cut: at once, at a rate, or with a receding surface.
namespace trephine::inline TREPHINE_ALIGNED {

/// A tick's allowance for a cut, from which policies derive how far a voxel may fall.
struct CutAllowance {
  double dt = 0;           ///< [s]
  double force_N = 0;      ///< pressing force [N]
  std::uint32_t tick = 0;  ///< counts the calls: seeds the dithering
  double fraction = 1;     ///< of the bone in the head that a PressureCut removes, 0 to 1
};

/// How a policy lowers densities, which says what a cut computes for each voxel and where a tool cuts.
enum class CutKind : std::uint8_t {
  kAtOnce,      ///< to the geometric cut
  kAtRate,      ///< toward it, by rate and share (`Cutter::shares`)
  kReceding,    ///< as kAtRate, times the densities' slope, so that the surface recedes at a speed
  kByPressure,  ///< by a fraction of what the geometric cut takes
};

/// Type in which limits compute densities. It is as wide as the distances, so that loops over both are vectorised.
template <VoxelDensity Density>
using WideDensity = std::conditional_t<std::is_floating_point_v<Density>, float, int>;

namespace detail {
/// Well mixed bits (the finaliser of MurmurHash3).
[[nodiscard]] inline std::uint32_t scramble(std::uint32_t x) noexcept {
  x = (x ^ (x >> 16)) * 0x85EBCA6BU;
  x = (x ^ (x >> 13)) * 0xC2B2AE35U;
  return x ^ (x >> 16);
}
/// Returns a number in [0, 1).
[[nodiscard]] inline float unit_of(std::uint32_t bits) noexcept {
  return static_cast<float>(static_cast<int>(bits >> 8)) * 0x1p-24F;
}

/// Returns `old` − `drop`, but not less than `target`. Integers fall by whole steps; `dither` rounds the fraction.
template <VoxelDensity Density>
[[nodiscard]] inline WideDensity<Density> lowered(WideDensity<Density> old, float drop, WideDensity<Density> target,
                                                  std::uint32_t dither) noexcept {
  if constexpr (std::is_floating_point_v<Density>) {
    const float value = drop > 0 ? old - drop : old;
    return value > target ? value : target;
  } else {
    // NaN falls by nothing. No fall exceeds the type's range. Masks, because clamps with constant bounds become jumps.
    constexpr std::uint32_t kRange = detail::bit_cast<std::uint32_t>(65536.0F);
    const std::uint32_t positive = drop > 0 ? ~0U : 0U;
    const std::uint32_t bits = detail::bit_cast<std::uint32_t>(drop) & positive;
    // Positive floats are in the order of their bits.
    const std::int32_t most = std::min(static_cast<std::int32_t>(bits), static_cast<std::int32_t>(kRange));
    const int value = old - static_cast<int>(detail::bit_cast<float>(most) + unit_of(dither));
    return value > target ? value : target;
  }
}

/// A value that holds at a reference force and is proportional to the force, up to a bound.
inline void check_force_factor(const char* type, double reference_force, double most_force_factor) {
  if (!(reference_force >= 0) || !is_finite(reference_force))
    refuse(type, "reference_force must be >= 0 N", reference_force);
  if (!(most_force_factor > 0) || !is_finite(most_force_factor))
    refuse(type, "most_force_factor must be > 0", most_force_factor);
}
/// Returns the tick's amount at `rate`. Without a reference force the force has no effect.
[[nodiscard]] inline float in_a_tick(double rate, const CutAllowance& a, double reference_force,
                                     double most_force_factor) noexcept {
  const double factor = reference_force > 0 ? std::min(a.force_N / reference_force, most_force_factor) : 1.0;
  return static_cast<float>(std::min(rate * a.dt * factor, 1e30));
}
}  // namespace detail

/// Cuts everything that the body covers at once. Independent of the tick rate.
struct GeometricCut {
  static constexpr CutKind kKind = CutKind::kAtOnce;
  void validate() const {}

  template <VoxelDensity Density>
  struct Limit {
    using Wide = WideDensity<Density>;
    [[nodiscard]] Wide operator()(Wide /*old*/, Wide target, float /*share*/, std::uint32_t /*voxel*/) const {
      return target;
    }
  };
  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance&) const noexcept {
    return {};
  }
};

/// Equal resistance at every density.
struct UniformHardness {
  [[nodiscard]] float operator()(float /*density*/) const noexcept { return 1.0F; }
};

/// Hardness of a density: a divisor of the rate, > 0.
template <class H>
concept Hardness = std::copy_constructible<H> && requires(const H& h, float density) {
  { h(density) } noexcept -> std::convertible_to<float>;
};

/// Approaches the geometric cut in time. A voxel falls by at most rate · share · dt / hardness(ρ) a tick, and never
/// below the geometric target. The share is 1 at `cut_reach` inside the cutter, 1/2 at its surface and 0 at the same
/// distance outside, linear between. So every voxel that the geometric cut would change approaches its target, inner
/// voxels first. The share is the mean over the tick's path (`Cutter`): a pass removes the same in any number of ticks.
///
/// Integer densities fall by whole steps with an exact mean: a hash of voxel and tick rounds the fraction. So slow cuts
/// do not stall, and two runs give the same bits.
template <Hardness H = UniformHardness>
struct RateLimitedCut {
  static constexpr CutKind kKind = CutKind::kAtRate;
  double rate = 1e5;           ///< densities/s that a wholly covered voxel of hardness 1 loses, > 0
  double reference_force = 0;  ///< [N]: the rate holds at this force and is proportional to it; 0: force plays no part
  double most_force_factor = 4;  ///< bound of force / reference_force
  [[no_unique_address]] H hardness{};

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(rate > 0) || !is_finite(rate)) refuse("RateLimitedCut", "rate must be > 0 densities/s", rate);
    detail::check_force_factor("RateLimitedCut", reference_force, most_force_factor);
  }

  template <VoxelDensity Density>
  struct Limit {
    float fall;  // densities a wholly covered voxel of hardness 1 may lose now
    std::uint32_t seed;
    const H* hardness;

    using Wide = WideDensity<Density>;
    [[nodiscard]] Wide operator()(Wide old, Wide target, float share, std::uint32_t voxel) const {
      const float drop = fall * share / static_cast<float>((*hardness)(static_cast<float>(old)));
      return detail::lowered<Density>(old, drop, target, detail::scramble(voxel ^ seed));
    }
  };

  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance& a) const noexcept {
    return {detail::in_a_tick(rate, a, reference_force, most_force_factor), detail::scramble(a.tick + 0x9E3779B9U),
            &hardness};
  }
};

/// Moves the surface into the bone at a speed, along its normal, where the cutter covers it, but not beyond the
/// geometric cut. The speed is the same at every contrast, within a fifteenth over the first two voxels, where a sharp
/// edge is rounded first.
///
/// A voxel falls by speed · share · dt · |∇ρ| a tick, with the gradient toward lower neighbours and RateLimitedCut's
/// share. So bone ahead of the surface keeps its densities, and the surface under the burr recedes by micrometres a
/// tick. A RateLimitedCut wears all bone under the burr together, whose support then ends within a tick. The surface
/// recedes by about a voxel a tick at most. The cut costs six more loads a voxel in the cutter's box.
///
/// Integer densities fall by whole steps with an exact mean, evenly in time. Two runs give the same bits.
struct AdvancingCut {
  static constexpr CutKind kKind = CutKind::kReceding;
  double speed = 1e-3;         ///< of the surface where it is wholly covered [m/s], > 0
  double reference_force = 0;  ///< [N]: the speed holds at this force and is proportional to it; 0: force plays no part
  double most_force_factor = 4;          ///< bound of force / reference_force
  static constexpr double kFastest = 1;  ///< [m/s]; a greater speed is likely one in mm/s

  /// Throws std::invalid_argument.
  void validate() const {
    if (!is_finite(speed) || !(speed > 0 && speed <= kFastest))
      refuse("AdvancingCut", "speed must be > 0 and at most 1 m/s", speed);
    detail::check_force_factor("AdvancingCut", reference_force, most_force_factor);
  }

  template <VoxelDensity Density>
  struct Limit {
    float recession;      // distance by which a wholly covered surface may recede now [m]
    std::uint32_t phase;  // fraction of a turn, in units of 2^-32

    using Wide = WideDensity<Density>;
    /// `steepness` in densities per metre.
    [[nodiscard]] Wide operator()(Wide old, Wide target, float share, std::uint32_t voxel,
                                  float steepness) const noexcept {
      return detail::lowered<Density>(old, recession * share * steepness, target, detail::scramble(voxel) + phase);
    }
  };

  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance& a) const noexcept {
    // The golden ratio spreads fractions of steps evenly in time, so that neighbours stay in step.
    return {detail::in_a_tick(speed, a, reference_force, most_force_factor), a.tick * 0x9E3779B9U};
  }
};

/// Says how a cut lowers voxels: `limit` returns a function of a voxel's density, its geometric target, its share and
/// its index, and for kReceding of the densities' slope. A limit may have `floor()`, a pointer to a CutFloor below
/// which no voxel falls, or null, and `tissues()`, a TissueMap with factors on the shares.
template <class P>
concept CutPolicy = requires(const P& policy, const CutAllowance& allowance) {
  { P::kKind } -> std::convertible_to<CutKind>;
  { policy.validate() };
  { policy.template limit<std::uint8_t>(allowance) } noexcept;
};

}  // namespace trephine
