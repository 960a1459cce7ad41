// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

/// What a picture needs of the bone beside its densities, by bricks of 8³ voxels: where rays find nothing, how much
/// bone is around a place, and what was cut. No OpenGL.
namespace live {

/// Distances in bricks to the nearest brick that holds bone, in the Chebyshev metric: 0 in such a brick. A ray leaps
/// over a cube of bricks at once. x fastest.
class EmptySpace {
 public:
  static constexpr int kFarthest = 30;  ///< bricks; farther ones count as this

  EmptySpace() = default;
  EmptySpace(const std::array<int, 3>& bricks, const std::vector<std::uint8_t>& holds_bone)
      : n_(bricks), distance_(holds_bone.size()) {
    for (std::size_t b = 0; b < distance_.size(); ++b)
      distance_[b] = holds_bone[b] != 0 ? std::uint8_t{0} : std::uint8_t{kFarthest};
    // Two sweeps over the 13 neighbours before and after a brick are exact in this metric.
    sweep(1);
    sweep(-1);
  }
  [[nodiscard]] const std::vector<std::uint8_t>& distances() const { return distance_; }
  /// A brick holds bone or holds none any more. Other distances stay, and are then too short, never too long: only
  /// cuts empty a brick, and only a restore fills one that held bone before.
  std::uint8_t set(std::size_t brick, bool holds_bone) {
    return distance_[brick] = holds_bone ? std::uint8_t{0} : std::max(distance_[brick], std::uint8_t{1});
  }

 private:
  [[nodiscard]] std::size_t index(int x, int y, int z) const {
    return (static_cast<std::size_t>(z) * static_cast<std::size_t>(n_[1]) + static_cast<std::size_t>(y)) *
               static_cast<std::size_t>(n_[0]) +
           static_cast<std::size_t>(x);
  }
  void sweep(int way) {
    const auto along = [way](int i, int n) { return way > 0 ? i : n - 1 - i; };
    for (int c = 0; c < n_[2]; ++c)
      for (int b = 0; b < n_[1]; ++b)
        for (int a = 0; a < n_[0]; ++a) {
          const int x = along(a, n_[0]), y = along(b, n_[1]), z = along(c, n_[2]);
          std::uint8_t& d = distance_[index(x, y, z)];
          for (int dz = -1; dz <= 0; ++dz)
            for (int dy = -1; dy <= (dz < 0 ? 1 : 0); ++dy)
              for (int dx = -1; dx <= (dz < 0 || dy < 0 ? 1 : -1); ++dx) {
                const int u = x + way * dx, v = y + way * dy, w = z + way * dz;
                if (u < 0 || v < 0 || w < 0 || u >= n_[0] || v >= n_[1] || w >= n_[2]) continue;
                d = std::min<std::uint8_t>(d, static_cast<std::uint8_t>(distance_[index(u, v, w)] + 1));
              }
        }
  }

  std::array<int, 3> n_{};
  std::vector<std::uint8_t> distance_;
};

/// Shares of bone in cells of 2, 4 and 8 voxels a side of one brick, 0..255, x fastest.
struct BrickShares {
  std::array<std::uint8_t, 64> of_2;
  std::array<std::uint8_t, 8> of_4;
  std::uint8_t of_8;
};

/// `haloed` as `GridReader::copy_brick` leaves it. A voxel counts by how far its density is above or below the
/// isovalue, over a range of `soft` densities, so that shares change smoothly.
[[nodiscard]] inline BrickShares shares_of(std::span<const std::int16_t, std::size_t{10} * 10 * 10> haloed,
                                           double isovalue, double soft) {
  std::array<float, 64> sum_2{};
  std::array<float, 8> sum_4{};
  float sum_8 = 0;
  const float scale = static_cast<float>(1 / soft), shift = static_cast<float>(0.5 - isovalue / soft);
  for (std::size_t k = 0; k < 8; ++k)
    for (std::size_t j = 0; j < 8; ++j)
      for (std::size_t i = 0; i < 8; ++i) {
        const float v = static_cast<float>(haloed[((k + 1) * 10 + j + 1) * 10 + i + 1]);
        const float share = std::clamp(v * scale + shift, 0.0F, 1.0F);
        sum_2[(k / 2 * 4 + j / 2) * 4 + i / 2] += share;
        sum_4[(k / 4 * 2 + j / 4) * 2 + i / 4] += share;
        sum_8 += share;
      }
  const auto byte = [](float share) { return static_cast<std::uint8_t>(255 * share + 0.5F); };
  BrickShares out{};
  for (std::size_t c = 0; c < 64; ++c) out.of_2[c] = byte(sum_2[c] / 8);
  for (std::size_t c = 0; c < 8; ++c) out.of_4[c] = byte(sum_4[c] / 64);
  out.of_8 = byte(sum_8 / 512);
  return out;
}

}  // namespace live
