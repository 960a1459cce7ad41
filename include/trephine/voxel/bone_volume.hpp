// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <type_traits>

/// Volume of bone: of the space in which the trilinear interpolant reaches the isovalue.
namespace trephine {

/// Adds up, cell by cell, the share in which the trilinear interpolant reaches the isovalue. A cell has eight voxels as
/// corners; the border's voxels are corners too.
///
/// Along a line parallel to a cell's edge the interpolant is linear, so the line's share of bone is exact:
/// (p⁺ + q⁺)/(|p| + |q|), p and q the ends' densities above the isovalue. A cell takes lines along the axis of its
/// steepest mean difference, at the 4 × 4 Gauss points across. A plane in a linear image is exact as long as it leaves
/// the cell by its sides alone; where it leaves by the ends, neighbours along the axis make up for each other. Cuts of
/// .3 voxel depth, with rims all round, lose the volume that is told within .6 %; 3 × 3 points leave 1.2 %.
///
/// Cost: eight comparisons a cell in vector code, and 16 divisions a cell that the surface crosses, in vector code too.
/// No allocation. Haptic thread.
template <VoxelDensity Density>
class BoneVolume {
 public:
  /// An isovalue above the type's range has no bone.
  BoneVolume(const VoxelGrid<Density>& grid, double isovalue) noexcept
      : grid_(grid), isovalue_(static_cast<float>(isovalue)) {
    constexpr double kMost = static_cast<double>(std::numeric_limits<Density>::max());
    constexpr double kLowest = static_cast<double>(std::numeric_limits<Density>::lowest());
    if constexpr (std::is_floating_point_v<Density>) {
      least_ = isovalue_;
    } else {
      has_bone_ = isovalue <= kMost;
      const double least = std::ceil(isovalue > kLowest ? isovalue : kLowest);
      least_ = static_cast<Density>(has_bone_ ? least : kMost);
    }
  }

  /// Adds cells `first` to `last` of a row; cell (i, j, k) reaches from voxel (i, j, k) to (i + 1, j + 1, k + 1), each
  /// index from −1 to size − 1, which is not checked.
  void add_row(int j, int k, int first, int last) noexcept {
    if (!has_bone_) return;
    const Density* const row = grid_.data() + grid_.index(0, j, k);
    int i = first;
    for (; last - i >= kLanes / 2; i += kLanes) add_block<kLanes>(row + i, std::min(last - i + 1, kLanes));
    if (i <= last) add_block<kLanes / 2>(row + i, last - i + 1);
  }

  /// Volume added so far, in cells.
  [[nodiscard]] double cells() noexcept {
    if (crossed_count_ > 0) add_crossed();
    return static_cast<double>(whole_) + part_;
  }

 private:
  static constexpr int kLanes = 16;
  using Wide = WideDensity<Density>;
  /// As wide as densities, so that comparisons stay in one register width.
  using Mask = std::conditional_t<sizeof(Density) == 1, std::uint8_t,
                                  std::conditional_t<sizeof(Density) == 2, std::uint16_t, std::uint32_t>>;
  using Lanes = std::array<float, kLanes>;

  template <std::size_t kBlock>
  void add_block(const Density* at, int count) noexcept {
    const std::ptrdiff_t y = grid_.row_pitch(), z = grid_.plane_pitch();
    const Density least = least_;
    // Corners in bone; lanes read past the count are of the next row, or spare.
    std::array<Mask, kBlock> in{}, crossed, whole;
    for (const std::ptrdiff_t corner : {std::ptrdiff_t{0}, y, z, y + z}) {
      const Density* const r = at + corner;
      for (std::size_t l = 0; l < kBlock; ++l)
        in[l] = static_cast<Mask>(in[l] + static_cast<Mask>(r[l] >= least) + static_cast<Mask>(r[l + 1] >= least));
    }
    const auto lanes = static_cast<Mask>(count);
    for (std::size_t l = 0; l < kBlock; ++l) in[l] = static_cast<Mask>(l) < lanes ? in[l] : Mask{0};
    for (std::size_t l = 0; l < kBlock; ++l) whole[l] = static_cast<Mask>(in[l] == 8);
    for (std::size_t l = 0; l < kBlock; ++l) crossed[l] = in[l] != 0 ? Mask{1} : Mask{0};
    for (std::size_t l = 0; l < kBlock; ++l) crossed[l] = static_cast<Mask>(crossed[l] - whole[l]);
    constexpr std::size_t kWords = sizeof(crossed) / 8;
    constexpr int kBits = 8 * sizeof(Mask);
    std::array<std::uint64_t, kWords> words, whole_words;
    std::memcpy(words.data(), crossed.data(), sizeof(crossed));
    std::memcpy(whole_words.data(), whole.data(), sizeof(whole));
    for (std::size_t w = 0; w < kWords; ++w) {
      whole_ += std::popcount(whole_words[w]);
      for (std::uint64_t left = words[w]; left != 0;) {
        constexpr bool kLittle = std::endian::native == std::endian::little;
        const int bit = kLittle ? std::countr_zero(left) : 63 - std::countl_zero(left);
        left ^= std::uint64_t{1} << bit;
        const int lane = kLittle ? bit / kBits : 64 / kBits - 1 - bit / kBits;
        keep(at + static_cast<std::ptrdiff_t>(w) * (64 / kBits) + lane, y, z);
      }
    }
  }

  /// Keeps a cell's corners until there are enough for a sum.
  void keep(const Density* at, std::ptrdiff_t y, std::ptrdiff_t z) noexcept {
    const auto to = static_cast<std::size_t>(crossed_count_);
    corner_[0][to] = at[0], corner_[1][to] = at[1];
    corner_[2][to] = at[y], corner_[3][to] = at[y + 1];
    corner_[4][to] = at[z], corner_[5][to] = at[z + 1];
    corner_[6][to] = at[y + z], corner_[7][to] = at[y + z + 1];
    if (++crossed_count_ == kLanes) add_crossed();
  }

  // In loops of their own over all lanes, so that they vectorise.
  void add_crossed() noexcept {
    std::array<Lanes, 8> c;
    const float isovalue = isovalue_;
    for (std::size_t m = 0; m < 8; ++m)
      for (std::size_t l = 0; l < kLanes; ++l) c[m][l] = static_cast<float>(corner_[m][l]) - isovalue;
    // How much steeper the cell is along x than along y, and along z than along both.
    Lanes to_x, to_z;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float d07 = c[7][l] - c[0][l], d16 = c[6][l] - c[1][l];
      const float d25 = c[5][l] - c[2][l], d34 = c[4][l] - c[3][l];
      const float x = std::abs(d07 - d16 + d25 - d34);
      const float y = std::abs(d07 + d16 - d25 - d34);
      const float z = std::abs(d07 + d16 + d25 + d34);
      to_x[l] = x - y;
      to_z[l] = z - (x > y ? x : y);
    }
    // Corners at the lines' starts and ends, in the order of the two axes across.
    std::array<Lanes, 4> start, end;
    start[0] = c[0];
    end[3] = c[7];
    const auto choose = [&](Lanes& out, const Lanes& by_x, const Lanes& by_y, const Lanes& by_z) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        const float across = to_x[l] >= 0 ? by_x[l] : by_y[l];
        out[l] = to_z[l] >= 0 ? by_z[l] : across;
      }
    };
    choose(start[1], c[2], c[1], c[1]);
    choose(start[2], c[4], c[4], c[2]);
    choose(start[3], c[6], c[5], c[3]);
    choose(end[0], c[1], c[2], c[4]);
    choose(end[1], c[3], c[3], c[5]);
    choose(end[2], c[5], c[6], c[6]);
    constexpr std::array<float, 4> kPlace{0.0694318442F, 0.3300094782F, 0.6699905218F, 0.9305681558F};
    constexpr std::array<float, 4> kWeight{0.1739274226F, 0.3260725774F, 0.3260725774F, 0.1739274226F};
    Lanes share{};
    for (std::size_t u = 0; u < 4; ++u) {
      Lanes p0, dp, q0, dq;
      for (std::size_t l = 0; l < kLanes; ++l) {
        p0[l] = start[0][l] + kPlace[u] * (start[1][l] - start[0][l]);
        dp[l] = start[2][l] + kPlace[u] * (start[3][l] - start[2][l]) - p0[l];
        q0[l] = end[0][l] + kPlace[u] * (end[1][l] - end[0][l]);
        dq[l] = end[2][l] + kPlace[u] * (end[3][l] - end[2][l]) - q0[l];
      }
      for (std::size_t v = 0; v < 4; ++v)
        for (std::size_t l = 0; l < kLanes; ++l) {
          const float p = p0[l] + kPlace[v] * dp[l], q = q0[l] + kPlace[v] * dq[l];
          // p⁺ + q⁺ is half of |p| + |q| + p + q; a line at the isovalue throughout is bone.
          constexpr float kLeast = std::numeric_limits<float>::min();
          const float both = std::abs(p) + std::abs(q) + kLeast;
          share[l] += kWeight[u] * kWeight[v] * (0.5F + 0.5F * (p + q + kLeast) / both);
        }
    }
    float sum = 0;
    for (std::size_t l = 0; l < kLanes; ++l) sum += static_cast<int>(l) < crossed_count_ ? share[l] : 0.0F;
    part_ += static_cast<double>(sum);
    crossed_count_ = 0;
  }

  const VoxelGrid<Density>& grid_;
  float isovalue_;
  Density least_;  // that is bone
  bool has_bone_ = true;
  int crossed_count_ = 0;
  std::int64_t whole_ = 0;
  double part_ = 0;
  std::array<std::array<Wide, kLanes>, 8> corner_{};  // of cells that the surface crosses and no sum has yet
};

}  // namespace trephine
