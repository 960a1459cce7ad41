// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/voxel/brick_layout.hpp>
#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Factors on the rate of a cut at each voxel of a bone: enamel is cut slowly, trabecular bone quickly.
///
/// Memory: 4 bytes a brick of 8³ voxels, and 512 bytes more for each brick with several tissues. Immutable: scenes and
/// threads may share it.
class TissueMap {
 public:
  static constexpr int kTissues = 256;
  static constexpr double kMinRate = 1e-3, kMaxRate = 1e3;  ///< bounds of a factor

  /// `tissue_of(i, j, k)` gives each voxel's tissue, a number of `rates`. Throws std::invalid_argument for no or more
  /// than 256 rates, a rate out of bounds, and a tissue without a rate. Its time grows with the voxels.
  template <VoxelDensity Density, class TissueOf>
  TissueMap(const VoxelGrid<Density>& grid, std::span<const double> rates, TissueOf&& tissue_of)
      : layout_(grid), tissues_of_(grid.brick_count()) {
    if (rates.empty() || rates.size() > kTissues)
      refuse("TissueMap", "it needs 1 to 256 tissues", static_cast<double>(rates.size()));
    for (const double rate : rates) {
      if (!(rate >= kMinRate && rate <= kMaxRate)) refuse("TissueMap", "rates must be 0.001 to 1000", rate);
      rates_.push_back(static_cast<float>(rate));
    }
    for (std::size_t brick = 0; brick < tissues_of_.size(); ++brick) {
      const std::array<int, 3> at = grid.brick_coordinates(brick);
      Tissues tissues{};
      int least = kTissues, most = -1;
      for_each_voxel(at, [&](int i, int j, int k, std::size_t v) {
        const int tissue = static_cast<int>(tissue_of(i, j, k));
        if (tissue < 0 || static_cast<std::size_t>(tissue) >= rates.size())
          refuse("TissueMap", "each tissue needs a rate", tissue);
        tissues[v] = static_cast<std::uint8_t>(tissue);
        least = std::min(least, tissue);
        most = std::max(most, tissue);
      });
      if (least == most) {
        tissues_of_[brick] = -1 - least;
      } else {
        tissues_of_[brick] = static_cast<std::int32_t>(mixed_.size());
        mixed_.push_back(tissues);
      }
    }
  }

  /// Returns the factor at a voxel, which must lie in the grid.
  [[nodiscard]] double rate_at(int i, int j, int k) const noexcept {
    const std::int32_t t = tissues_of_[layout_.brick_of(i, j, k)];
    const auto tissue = t < 0 ? static_cast<std::size_t>(-1 - t)
                              : std::size_t{mixed_[static_cast<std::size_t>(t)][BrickLayout::voxel_in_brick(i, j, k)]};
    return static_cast<double>(rates_[tissue]);
  }
  /// Returns true if the map was made for a grid of this size.
  template <VoxelDensity Density>
  [[nodiscard]] bool fits(const VoxelGrid<Density>& grid) const noexcept {
    return grid.size() == layout_.size();
  }
  [[nodiscard]] std::size_t bytes() const noexcept {
    return tissues_of_.size() * sizeof(std::int32_t) + mixed_.size() * sizeof(Tissues) + rates_.size() * sizeof(float);
  }

  /// Multiplies the shares of voxels (i, j, k) to (i + count − 1, j, k), for cuts.
  template <std::size_t kLanes>
  void scale(int i, int j, int k, int count, std::array<float, kLanes>& share) const noexcept {
    layout_.for_each_part(i, j, k, count, [&](std::size_t brick, std::size_t v, int first, int end) {
      const std::int32_t t = tissues_of_[brick];
      if (t < 0) {
        const float rate = rates_[static_cast<std::size_t>(-1 - t)];
        for (int l = first; l < end; ++l) share[static_cast<std::size_t>(l)] *= rate;
      } else {
        const Tissues& tissues = mixed_[static_cast<std::size_t>(t)];
        for (int l = first; l < end; ++l, ++v) share[static_cast<std::size_t>(l)] *= rates_[tissues[v]];
      }
    });
  }

 private:
  static constexpr int kBrick = BrickLayout::kBrick;
  using Tissues = std::array<std::uint8_t, BrickLayout::kVoxels>;

  template <class Visit>
  void for_each_voxel(const std::array<int, 3>& brick, Visit&& visit) const {
    const auto end = [&](std::size_t a) { return std::min(kBrick * (brick[a] + 1), layout_.size()[a]); };
    for (int k = kBrick * brick[2]; k < end(2); ++k)
      for (int j = kBrick * brick[1]; j < end(1); ++j)
        for (int i = kBrick * brick[0]; i < end(0); ++i) visit(i, j, k, BrickLayout::voxel_in_brick(i, j, k));
  }

  BrickLayout layout_;
  std::vector<float> rates_;              // by tissue
  std::vector<std::int32_t> tissues_of_;  // of each brick: −1 − tissue, or a number of `mixed_`
  std::vector<Tissues> mixed_;
};

/// A cut whose rate depends on the tissue: another cut in time, at each voxel times the factor of a TissueMap.
/// \code
/// auto tissues = make_tissue_map(labels, bone, {{.label = 1, .rate = 0.2}});   // structure/tissues.hpp
/// HapticScene{bone, 300, renderer, Cutting{TissueCut{AdvancingCut{.speed = 5e-3}, tissues}}};
/// \endcode
/// Bone behind a slower tissue has a small slope when the surface comes there. In 8 bits rounding then adds to its
/// steepness: behind a tissue eight times slower an `AdvancingCut` goes up to half faster for some voxels.
///
/// The pressing force is the same in every tissue, so harder bone lets the drill advance more slowly under it. The map
/// must be for the same bone: a scene refuses another one, and `carve` then cuts nothing. Copies share the map.
template <CutPolicy Policy>
struct TissueCut {
  static constexpr CutKind kKind = Policy::kKind;
  static_assert(kKind != CutKind::kAtOnce,
                "trephine::TissueCut: a cut at once has no rate; take AdvancingCut or RateLimitedCut");

  using Options = Policy;  ///< what may change between ticks

  TissueCut(const Policy& cut, std::shared_ptr<const TissueMap> map) : policy(cut), tissues(std::move(map)) {
    validate();
  }

  Policy policy;
  std::shared_ptr<const TissueMap> tissues;

  /// Throws std::invalid_argument.
  void validate() const {
    policy.validate();
    if (tissues == nullptr) refuse("TissueCut", "it needs a TissueMap", "none");
  }
  /// Throws std::invalid_argument if the map was made for another grid.
  template <VoxelDensity Density>
  void validate_for(const VoxelGrid<Density>& bone, double /*isovalue*/) const {
    if (!tissues->fits(bone)) refuse("TissueCut", "the map must be made for a bone of the scene's size", "another");
  }

  /// Replaces the inner policy by a valid one.
  void adopt(const Options& options) noexcept { policy = options; }

  template <VoxelDensity Density>
  struct Limit : Policy::template Limit<Density> {
    const TissueMap* map;
    [[nodiscard]] const TissueMap& tissues() const noexcept { return *map; }
  };
  template <VoxelDensity Density>
  [[nodiscard]] Limit<Density> limit(const CutAllowance& allowance) const noexcept {
    return {policy.template limit<Density>(allowance), tissues.get()};
  }
};

}  // namespace trephine
