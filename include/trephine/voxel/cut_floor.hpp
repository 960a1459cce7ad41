// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/bone_volume.hpp>
#include <trephine/voxel/brick_layout.hpp>
#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/cut_slope.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Voxels that a floor refused, and that cuts took of its watched bodies.
struct FloorCounts {
  std::uint64_t refused = 0, taken = 0;
};

/// Lowest densities that cuts may leave, for bone that must not be cut.
///
/// A body's distance c [m], negative inside, gives every voxel near it the floor iso − slope · c/h, rounded up: the
/// densities of a geometric cut of everything outside the body. A cut with floors lowers a voxel to max(target, floor),
/// so the wall that stays is as smooth as a cut. The bone inside the body is the set where the trilinear interpolant of
/// the floors reaches the isovalue. No cut takes any of it:
/// - where all corners of a cell had at least their floors, the interpolant stays at or above the floors' interpolant;
/// - where a corner was lower, as at the bone's own surface, all corners of the cell are frozen (`seal`).
///
/// Each voxel near a body has an owner, a number from 0 to 254. The floor counts what it refused, and what cuts took of
/// bodies that are only watched, as whole voxels, each once. Some bodies of a floor may be protected and others
/// watched: a watched body counts up to where a protected one begins.
///
/// Memory: 11 to 21 bytes a voxel in bricks of 8³ near a body, 80 bytes a frozen brick, 4 bytes a brick elsewhere.
/// Threads: build on any thread before the scene ticks; then the haptic thread alone. Cuts allocate nothing.
template <VoxelDensity Density>
class CutFloor {
 public:
  static constexpr int kOwners = 255;
  using Wide = WideDensity<Density>;

  /// An empty floor for this bone. Throws std::invalid_argument for an isovalue that is not finite.
  CutFloor(const VoxelGrid<Density>& grid, double isovalue)
      : layout_(grid),
        isovalue_(isovalue),
        per_metre_(auto_slope(grid, isovalue) / grid.spacing().maxCoeff()),
        reach_(reach_of(grid.spacing())),
        voxel_mm3_(grid.spacing().prod() * 1e9),
        block_of_(grid.brick_count(), kNone) {
    if (!is_finite(isovalue)) refuse("CutFloor", "isovalue must be finite", isovalue);
    threshold_ = static_cast<Wide>(detail::LeastBone<Density>(isovalue).density);
  }

  /// Distance from a body within which its voxels need floors [m]: the diagonal of a cell, and what rounding adds.
  [[nodiscard]] static double reach_of(const Vec3d& spacing) noexcept {
    return spacing.norm() + spacing.maxCoeff() / 4;
  }
  [[nodiscard]] double reach() const noexcept { return reach_; }

  /// Protects a body: `distance(i, j, k)` is a voxel's signed distance from it [m]. `box` must hold every voxel nearer
  /// than `reach()`. Of several bodies the highest floor counts.
  template <class Distance>
  void protect(int owner, const VoxelBox& box, Distance&& distance) {
    build_ = detail::unique_number();
    for_each_voxel(box, [&](int i, int j, int k) {
      const double c = distance(i, j, k);
      if (!(c < reach_)) return;
      if (is_frozen(layout_.brick_of(i, j, k))) return;
      const Density floor = detail::LeastBone<Density>(isovalue_ - per_metre_ * c).density;
      Block& block = block_at(i, j, k);
      const std::size_t v = BrickLayout::voxel_in_brick(i, j, k);
      if (block.owner[v] != 0 && !(block.floor[v] < floor)) return;
      block.floor[v] = floor;
      // A voxel of a watched body outside of this one may still be taken, down to the floor.
      if (is_set(block.watched, v) && floor < threshold_) return;
      block.owner[v] = static_cast<std::uint8_t>(owner + 1);
      set(block.watched, v, false);
    });
  }

  /// Watches a body that may be cut: voxels for which `inside(i, j, k)` is true, unless another body protects them.
  template <class Inside>
  void watch(int owner, const VoxelBox& box, Inside&& inside) {
    build_ = detail::unique_number();
    for_each_voxel(box, [&](int i, int j, int k) {
      if (!inside(i, j, k) || is_frozen(layout_.brick_of(i, j, k))) return;
      Block& block = block_at(i, j, k);
      const std::size_t v = BrickLayout::voxel_in_brick(i, j, k);
      if (is_set(block.watched, v) || !(block.floor[v] < threshold_)) return;
      block.owner[v] = static_cast<std::uint8_t>(owner + 1);
      set(block.watched, v, true);
    });
  }

  /// Protects all voxels of a brick of the grid, which must lie deeper than `reach()` in the owner's body.
  void freeze_brick(int owner, std::size_t brick) {
    build_ = detail::unique_number();
    const auto owned_by = static_cast<std::uint8_t>(owner + 1);
    std::int32_t& b = block_of_[brick];
    if (b >= 0) {
      Block& block = blocks_[static_cast<std::size_t>(b)];
      block.floor.fill(kMax);
      block.owner.fill(owned_by);
      block.watched.fill(0);
    } else if (b == kNone) {
      b = kFirstFrozen - static_cast<std::int32_t>(frozen_.size());
      frozen_.push_back({.owner = owned_by});
    }
  }

  /// Freezes cells whose bone does not reach its floors. Call it once after all bodies. Frozen voxels are never cut.
  /// Any thread, also while the bone is cut: it then sees voxels before or after the cut.
  void seal(const VoxelGrid<Density>& grid) {
    build_ = detail::unique_number();
    const GridReader<Density> reader(grid, false);
    std::vector<std::array<int, 3>> frozen;
    for (std::size_t brick = 0; brick < block_of_.size(); ++brick) {
      if (block_of_[brick] < 0) continue;
      // Cells with a corner in the brick; its neighbours find some of them again.
      std::array<int, 3> lo = grid.brick_coordinates(brick);
      for (int& at : lo) at *= kBrick;
      for (int k = lo[2] - 1; k < lo[2] + kBrick; ++k)
        for (int j = lo[1] - 1; j < lo[1] + kBrick; ++j)
          for (int i = lo[0] - 1; i < lo[0] + kBrick; ++i)
            if (must_freeze(grid, reader, i, j, k)) frozen.push_back({i, j, k});
    }
    for (const auto& cell : frozen)
      for (int c = 0; c < 8; ++c) {
        const int i = cell[0] + (c & 1), j = cell[1] + (c >> 1 & 1), k = cell[2] + (c >> 2);
        if (!grid.contains(i, j, k) || is_frozen(layout_.brick_of(i, j, k))) continue;
        Block& block = block_at(i, j, k);
        block.floor[BrickLayout::voxel_in_brick(i, j, k)] = kMax;
      }
  }

  /// Returns the voxel's floor; the lowest density where there is none. The voxel must lie in the grid.
  [[nodiscard]] Density floor_at(int i, int j, int k) const noexcept {
    const std::int32_t b = block_of_[layout_.brick_of(i, j, k)];
    if (b < 0) return b == kNone ? kLowest : kMax;
    return blocks_[static_cast<std::size_t>(b)].floor[BrickLayout::voxel_in_brick(i, j, k)];
  }
  /// Returns true if the voxel is protected itself: its floor reaches the isovalue.
  [[nodiscard]] bool is_protected(int i, int j, int k) const noexcept { return !(floor_at(i, j, k) < threshold_); }

  /// True if the floor was made for a grid of this size and this isovalue.
  [[nodiscard]] bool fits(const VoxelGrid<Density>& grid, double isovalue) const noexcept {
    return grid.size() == layout_.size() && isovalue == isovalue_;
  }

  /// Return the volume of the owner's voxels that cuts would have taken, and took of a watched body [mm³].
  [[nodiscard]] double refused_mm3(int owner) const noexcept { return voxel_mm3_ * counts(refused_, owner); }
  [[nodiscard]] double taken_mm3(int owner) const noexcept { return voxel_mm3_ * counts(taken_, owner); }
  /// The same for all owners.
  [[nodiscard]] double refused_mm3() const noexcept { return voxel_mm3_ * static_cast<double>(all_refused_); }
  [[nodiscard]] double taken_mm3() const noexcept { return voxel_mm3_ * static_cast<double>(all_taken_); }

  /// Voxels of all owners, and the volume of one [mm³].
  [[nodiscard]] FloorCounts counts() const noexcept { return {all_refused_, all_taken_}; }
  [[nodiscard]] double voxel_mm3() const noexcept { return voxel_mm3_; }

  /// Takes the counts of a copy of this floor, or all of another floor for this bone.
  void take(const CutFloor& other) {
    if (build_ != other.build_) {
      *this = other;
      return;
    }
    for (std::size_t b = 0; b < blocks_.size(); ++b) blocks_[b].counted = other.blocks_[b].counted;
    frozen_ = other.frozen_;
    refused_ = other.refused_;
    taken_ = other.taken_;
    all_refused_ = other.all_refused_;
    all_taken_ = other.all_taken_;
  }

  /// Forgets what was refused and taken.
  void reset_counts() noexcept {
    refused_.fill(0);
    taken_.fill(0);
    all_refused_ = all_taken_ = 0;
    for (Block& block : blocks_) block.counted.fill(0);
    for (Frozen& brick : frozen_) brick.counted.fill(0);
  }

  /// Forgets what was taken of voxels that are bone again, as after an undo. Call it between cuts, on the thread that
  /// cuts; it allocates nothing.
  void forget_put_back(const VoxelGrid<Density>& grid) noexcept {
    for (std::size_t brick = 0; brick < block_of_.size(); ++brick) {
      if (block_of_[brick] < 0) continue;
      Block& block = blocks_[static_cast<std::size_t>(block_of_[brick])];
      const std::array<int, 3> at = grid.brick_coordinates(brick);
      for (std::size_t v = 0; v < kVoxels; ++v) {
        if (!is_set(block.watched, v) || !is_set(block.counted, v)) continue;
        const int n = static_cast<int>(v);
        const int i = n % kBrick, j = n / kBrick % kBrick, k = n / (kBrick * kBrick);
        if (grid.at(kBrick * at[0] + i, kBrick * at[1] + j, kBrick * at[2] + k) < threshold_) continue;
        set(block.counted, v, false);
        --all_taken_;
        if (block.owner[v] > 0) --taken_[block.owner[v] - 1U];
      }
    }
  }

  [[nodiscard]] std::size_t bytes() const noexcept {
    return blocks_.size() * sizeof(Block) + frozen_.size() * sizeof(Frozen) + block_of_.size() * sizeof(std::int32_t);
  }

  // --- For cuts, haptic thread ---------------------------------------------------------------------------------------
  /// Raises the targets of voxels (i, j, k) to (i + count − 1, j, k) to their floors, and counts what that refuses.
  template <std::size_t kLanes>
  void raise(int i, int j, int k, int count, const std::array<Density, kLanes>& old,
             std::array<Wide, kLanes>& target) noexcept {
    const auto would_go = [&](std::size_t l) { return target[l] < threshold_ && !(old[l] < threshold_); };
    const auto raise_to_floor = [&](Block& block, std::size_t v, std::size_t l) {
      const Wide floor = block.floor[v];
      if (!(target[l] < floor)) return;
      if (would_go(l) && !(floor < threshold_)) count_once(block.counted, block.owner[v], v, refused_, all_refused_);
      target[l] = floor;
    };
    const auto freeze = [&](Frozen& brick, std::size_t v, std::size_t l) {
      if (would_go(l)) count_once(brick.counted, brick.owner, v, refused_, all_refused_);
      target[l] = kMax;
    };
    for_each_part(i, j, k, count, raise_to_floor, freeze);
  }

  /// Counts the watched voxels that fall from `old` to `value` through the isovalue.
  template <std::size_t kLanes>
  void count_taken(int i, int j, int k, int count, const std::array<Density, kLanes>& old,
                   const std::array<Density, kLanes>& value) noexcept {
    const auto count_watched = [&](Block& block, std::size_t v, std::size_t l) {
      if (!is_set(block.watched, v) || old[l] < threshold_ || !(value[l] < threshold_)) return;
      count_once(block.counted, block.owner[v], v, taken_, all_taken_);
    };
    for_each_part(i, j, k, count, count_watched, [](Frozen&, std::size_t, std::size_t) {});
  }

 private:
  static constexpr std::int32_t kNone = -1, kFirstFrozen = -2;  // in `block_of_`
  static constexpr int kBrick = BrickLayout::kBrick;
  static constexpr std::size_t kVoxels = BrickLayout::kVoxels;
  static constexpr Density kLowest = std::numeric_limits<Density>::lowest();
  static constexpr Density kMax = std::numeric_limits<Density>::max();
  using Bits = std::array<std::uint64_t, kVoxels / 64>;

  struct Block {
    std::array<Density, kVoxels> floor;
    std::array<std::uint8_t, kVoxels> owner{};  // 0: none, else owner + 1
    Bits watched{}, counted{};
    Block() noexcept { floor.fill(kLowest); }
  };

  /// A brick of which nothing may be cut.
  struct Frozen {
    std::uint8_t owner = 0;  // as in a block
    Bits counted{};
  };
  [[nodiscard]] bool is_frozen(std::size_t brick) const noexcept { return block_of_[brick] <= kFirstFrozen; }

  static void set(Bits& bits, std::size_t v, bool on) noexcept {
    const std::uint64_t bit = std::uint64_t{1} << (v % 64);
    bits[v / 64] = on ? bits[v / 64] | bit : bits[v / 64] & ~bit;
  }
  [[nodiscard]] static bool is_set(const Bits& bits, std::size_t v) noexcept {
    return (bits[v / 64] >> (v % 64) & 1) != 0;
  }

  static void count_once(Bits& counted, std::uint8_t owner, std::size_t v, std::array<std::uint64_t, kOwners>& counts,
                         std::uint64_t& all) noexcept {
    if (is_set(counted, v)) return;
    set(counted, v, true);
    ++all;
    if (owner > 0) ++counts[owner - 1U];
  }
  [[nodiscard]] static double counts(const std::array<std::uint64_t, kOwners>& counts, int owner) noexcept {
    return owner >= 0 && owner < kOwners ? static_cast<double>(counts[static_cast<std::size_t>(owner)]) : 0.0;
  }

  Block& block_at(int i, int j, int k) {
    std::int32_t& b = block_of_[layout_.brick_of(i, j, k)];
    if (b == kNone) {
      b = static_cast<std::int32_t>(blocks_.size());
      blocks_.emplace_back();
    }
    return blocks_[static_cast<std::size_t>(b)];
  }

  template <class Visit>
  void for_each_voxel(const VoxelBox& box, Visit&& visit) const {
    for (int k = std::max(box.lo[2], 0); k <= std::min(box.hi[2], layout_.size()[2] - 1); ++k)
      for (int j = std::max(box.lo[1], 0); j <= std::min(box.hi[1], layout_.size()[1] - 1); ++j)
        for (int i = std::max(box.lo[0], 0); i <= std::min(box.hi[0], layout_.size()[0] - 1); ++i) visit(i, j, k);
  }

  /// Visits the voxels of a part of a row, which spans up to three bricks, in bricks with a block and frozen ones.
  template <class Visit, class VisitFrozen>
  void for_each_part(int i, int j, int k, int count, const Visit& visit, const VisitFrozen& visit_frozen) noexcept {
    layout_.for_each_part(i, j, k, count, [&](std::size_t at, std::size_t v, int first, int end) {
      const std::int32_t b = block_of_[at];
      if (b == kNone) return;
      if (b < 0) {
        Frozen& brick = frozen_[static_cast<std::size_t>(kFirstFrozen - b)];
        for (int l = first; l < end; ++l, ++v) visit_frozen(brick, v, static_cast<std::size_t>(l));
      } else {
        Block& block = blocks_[static_cast<std::size_t>(b)];
        for (int l = first; l < end; ++l, ++v) visit(block, v, static_cast<std::size_t>(l));
      }
    });
  }

  /// Whether the cell holds protected bone and a corner with less than its floor.
  [[nodiscard]] bool must_freeze(const VoxelGrid<Density>& grid, const GridReader<Density>& reader, int i, int j,
                                 int k) const noexcept {
    bool holds = false, lower = false;
    for (int c = 0; c < 8; ++c) {
      const int x = i + (c & 1), y = j + (c >> 1 & 1), z = k + (c >> 2);
      if (!grid.contains(x, y, z)) {
        lower = true;  // the border is as it is
        continue;
      }
      const Density floor = floor_at(x, y, z);
      holds = holds || !(floor < threshold_);
      lower = lower || reader.voxel(x, y, z) < floor;
    }
    return holds && lower;
  }

  BrickLayout layout_;
  double isovalue_;
  double per_metre_;
  double reach_;
  double voxel_mm3_;
  Wide threshold_{};  // the lowest density that is bone
  std::vector<std::int32_t> block_of_;
  std::vector<Block> blocks_;
  std::vector<Frozen> frozen_;
  std::array<std::uint64_t, kOwners> refused_{}, taken_{};
  std::uint64_t all_refused_ = 0, all_taken_ = 0;
  std::uint64_t build_ = detail::unique_number();  // copies have the same floors where this is the same
};

}  // namespace trephine
