// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/label_surface.hpp>
#include <trephine/structure/label_volume.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED::detail {

/// Index of a label volume: which labels each brick of 8³ voxels has, and the box of each structure's voxels.
class LabelBricks {
 public:
  static constexpr int kBrick = 8;

  /// `volume` is valid. Visits every voxel once.
  explicit LabelBricks(const LabelVolume& volume) : size_(volume.size) {
    for (std::size_t a = 0; a < 3; ++a) bricks_[a] = (size_[a] + kBrick - 1) / kBrick;
    present_.resize(static_cast<std::size_t>(bricks_[0]) * static_cast<std::size_t>(bricks_[1]) *
                    static_cast<std::size_t>(bricks_[2]));
    std::size_t n = 0;
    for (int k = 0; k < size_[2]; ++k)
      for (int j = 0; j < size_[1]; ++j)
        for (int i = 0; i < size_[0]; ++i, ++n) {
          const std::uint8_t label = volume.structure[n];
          present_[brick_index(i / kBrick, j / kBrick, k / kBrick)][label / 64] |= std::uint64_t{1} << (label % 64);
          if (label == 0) continue;
          if (label > boxes_.size()) boxes_.resize(label, LatticeBox{size_, {-1, -1, -1}});
          LatticeBox& box = boxes_[label - std::size_t{1}];
          const std::array<int, 3> at{i, j, k};
          for (std::size_t a = 0; a < 3; ++a) {
            box.lo[a] = std::min(box.lo[a], at[a]);
            box.hi[a] = std::max(box.hi[a], at[a]);
          }
        }
  }

  /// Number of structures: the largest label.
  [[nodiscard]] std::size_t structures() const noexcept { return boxes_.size(); }
  /// Box of a structure's voxels. `hi` is negative if it has none.
  [[nodiscard]] const LatticeBox& box(std::size_t structure) const noexcept { return boxes_[structure]; }

  /// True if a brick that meets the box has a voxel of label `label` (0: none, or beyond the volume).
  [[nodiscard]] bool has(const LatticeBox& box, std::uint32_t label) const noexcept {
    for (std::size_t a = 0; a < 3; ++a) {
      if (label == 0 && (box.lo[a] < 0 || box.hi[a] >= size_[a])) return true;
      if (box.hi[a] < 0 || box.lo[a] >= size_[a]) return false;
    }
    const auto lo = [&](std::size_t a) { return std::max(box.lo[a], 0) / kBrick; };
    const auto hi = [&](std::size_t a) { return std::min(box.hi[a], size_[a] - 1) / kBrick; };
    for (int z = lo(2); z <= hi(2); ++z)
      for (int y = lo(1); y <= hi(1); ++y)
        for (int x = lo(0); x <= hi(0); ++x)
          if ((present_[brick_index(x, y, z)][label / 64] >> (label % 64) & 1) != 0) return true;
    return false;
  }

 private:
  using Present = std::array<std::uint64_t, 4>;  // bit l: a voxel has label l

  [[nodiscard]] std::size_t brick_index(int bx, int by, int bz) const noexcept {
    return static_cast<std::size_t>(bx) +
           static_cast<std::size_t>(bricks_[0]) *
               (static_cast<std::size_t>(by) + static_cast<std::size_t>(bricks_[1]) * static_cast<std::size_t>(bz));
  }

  std::array<int, 3> size_, bricks_{};
  std::vector<Present> present_;
  std::vector<LatticeBox> boxes_;
};

}  // namespace trephine::detail
