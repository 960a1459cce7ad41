// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>

/// How fast a cut goes: at once, or at a rate.
namespace trephine {

/// What a tick allows a cut to do: how much any voxel may fall by.
struct CutAllowance {
  double dt = 0;           ///< [s]
  double force_N = 0;      ///< pressing force [N]
  std::uint32_t tick = 0;  ///< counts the calls: seeds the dithering
};

/// A density as limits compute with it: as wide as the distances, so that loops over both vectorise.
template <VoxelDensity Density>
using WideDensity = std::conditional_t<std::is_floating_point_v<Density>, float, int>;

/// Cuts at once what the body covers. Independent of the tick rate.
struct GeometricCut {
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

/// The same resistance whatever the density.
struct UniformHardness {
  [[nodiscard]] float operator()(float /*density*/) const noexcept { return 1.0F; }
};

/// How hard a density is to cut, as a divisor of the rate; > 0.
template <class H>
concept Hardness = std::copy_constructible<H> && requires(const H& h, float density) {
  { h(density) }
  noexcept->std::convertible_to<float>;
};

/// Approaches the geometric cut: a voxel falls by at most rate · share · dt / hardness(ρ) a tick, and not below the
/// geometric target. share goes linearly from 1 at `cut_reach` inside the cutter over 1/2 at its surface to 0 at the
/// same distance outside: all voxels that the geometric cut would change approach it, inner ones first.
///
/// Integer densities fall by whole steps whose mean is exact: the fraction decides by a hash of voxel and tick, so that
/// slow cuts do not stall and two runs give the same bits.
///
/// A voxel counts as covered for the whole tick in which the swept body reaches it: a burr that passes by faster than
/// its own radius a tick removes up to (2R + v dt)/(2R) too much.
template <Hardness H = UniformHardness>
struct RateLimitedCut {
  double rate = 1e5;           ///< densities/s that a wholly covered voxel of hardness 1 loses, > 0
  double reference_force = 0;  ///< [N]: the rate holds at this force and is proportional to it; 0: force plays no part
  double most_force_factor = 4;  ///< bound of force / reference_force
  [[no_unique_address]] H hardness{};

  /// Throws std::invalid_argument.
  void validate() const {
    if (!(rate > 0) || !std::isfinite(rate)) refuse("RateLimitedCut", "rate must be > 0 densities/s", rate);
    if (!(reference_force >= 0) || !std::isfinite(reference_force))
      refuse("RateLimitedCut", "reference_force must be >= 0 N", reference_force);
    if (!(most_force_factor > 0) || !std::isfinite(most_force_factor))
      refuse("RateLimitedCut", "most_force_factor must be > 0", most_force_factor);
  }

  template <VoxelDensity Density>
  struct Limit {
    float fall;  // densities a wholly covered voxel of hardness 1 may lose now
    std::uint32_t seed;
    const H* hardness;

    using Wide = WideDensity<Density>;
    [[nodiscard]] Wide operator()(Wide old, Wide target, float share, std::uint32_t voxel) const {
      const float from = static_cast<float>(old);
      const float drop = fall * share / static_cast<float>((*hardness)(from));
      if constexpr (std::is_floating_point_v<Density>) {
        const float value = drop > 0 ? from - drop : from;
        return value > target ? value : target;
      } else {
        // NaN falls by nothing. A whole range is enough for any fall.
        constexpr float kRange = 65536.0F;
        const float most = drop > 0 ? (drop < kRange ? drop : kRange) : 0.0F;
        const int value = old - static_cast<int>(most + unit_hash(voxel ^ seed));
        return value > target ? value : target;
      }
    }
  };

  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance& a) const noexcept {
    const double factor = reference_force > 0 ? std::min(a.force_N / reference_force, most_force_factor) : 1.0;
    return {static_cast<float>(std::min(rate * a.dt * factor, 1e30)), scramble(a.tick + 0x9E3779B9U), &hardness};
  }

 private:
  /// Well mixed bits (the finaliser of MurmurHash3).
  [[nodiscard]] static std::uint32_t scramble(std::uint32_t x) noexcept {
    x = (x ^ (x >> 16)) * 0x85EBCA6BU;
    x = (x ^ (x >> 13)) * 0xC2B2AE35U;
    return x ^ (x >> 16);
  }
  /// In [0, 1).
  [[nodiscard]] static float unit_hash(std::uint32_t x) noexcept {
    return static_cast<float>(static_cast<int>(scramble(x) >> 8)) * 0x1p-24F;
  }
};

template <class P>
concept CutPolicy = requires(const P& policy, const CutAllowance& allowance) {
  {policy.validate()};
  { policy.template limit<std::uint8_t>(allowance) }
  noexcept;
};

}  // namespace trephine
