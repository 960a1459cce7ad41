// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
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
    for (int i = first; i <= last; i += kLanes) {
      const int left = last - i + 1;
      add_block(row + i, left < kLanes ? left : kLanes);
    }
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

  void add_block(const Density* at, int count) noexcept {
    const std::ptrdiff_t y = grid_.row_pitch(), z = grid_.plane_pitch();
    const Density* const r0 = at;
    const Density* const r1 = at + y;
    const Density* const r2 = at + z;
    const Density* const r3 = at + y + z;
    const Density least = least_;
    std::array<Mask, kLanes> in, crossed;
    // Corners in bone; lanes read past the count are of the next row, or spare.
    for (std::size_t l = 0; l < kLanes; ++l)
      in[l] = static_cast<Mask>(static_cast<Mask>(r0[l] >= least) + static_cast<Mask>(r1[l] >= least) +
                                static_cast<Mask>(r2[l] >= least) + static_cast<Mask>(r3[l] >= least));
    for (std::size_t l = 0; l < kLanes; ++l)
      in[l] = static_cast<Mask>(in[l] + static_cast<Mask>(r0[l + 1] >= least) + static_cast<Mask>(r1[l + 1] >= least) +
                                static_cast<Mask>(r2[l + 1] >= least) + static_cast<Mask>(r3[l + 1] >= least));
    const auto lanes = static_cast<Mask>(count);
    for (std::size_t l = 0; l < kLanes; ++l) in[l] = static_cast<Mask>(l) < lanes ? in[l] : Mask{0};
    for (std::size_t l = 0; l < kLanes; ++l) crossed[l] = static_cast<Mask>(in[l] != 0 && in[l] != 8);
    Mask whole = 0, any = 0;
    for (std::size_t l = 0; l < kLanes; ++l) whole = static_cast<Mask>(whole + static_cast<Mask>(in[l] == 8));
    for (std::size_t l = 0; l < kLanes; ++l) any = static_cast<Mask>(any | crossed[l]);
    whole_ += whole;
    if (any == 0) return;
    std::array<std::uint8_t, kLanes> lane;
    std::size_t n = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      lane[n] = static_cast<std::uint8_t>(l);
      n += crossed[l];
    }
    for (std::size_t c = 0; c < n; ++c) {
      const std::ptrdiff_t l = lane[c];
      const auto to = static_cast<std::size_t>(crossed_count_);
      corner_[0][to] = r0[l], corner_[1][to] = r0[l + 1];
      corner_[2][to] = r1[l], corner_[3][to] = r1[l + 1];
      corner_[4][to] = r2[l], corner_[5][to] = r2[l + 1];
      corner_[6][to] = r3[l], corner_[7][to] = r3[l + 1];
      if (++crossed_count_ == kLanes) add_crossed();
    }
  }

  // In loops of their own over all lanes, so that they vectorise.
  void add_crossed() noexcept {
    std::array<Lanes, 8> c;
    const float isovalue = isovalue_;
    for (std::size_t m = 0; m < 8; ++m)
      for (std::size_t l = 0; l < kLanes; ++l) c[m][l] = static_cast<float>(corner_[m][l]) - isovalue;
    // Corners at the lines' starts and ends, in the order of the two axes across.
    std::array<Lanes, 4> start, end;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float d07 = c[7][l] - c[0][l], d16 = c[6][l] - c[1][l];
      const float d25 = c[5][l] - c[2][l], d34 = c[4][l] - c[3][l];
      const float x = std::abs(d07 - d16 + d25 - d34);
      const float y = std::abs(d07 + d16 - d25 - d34);
      const float z = std::abs(d07 + d16 + d25 + d34);
      const bool along_z = z >= x && z >= y;
      const bool along_x = x >= y;
      const float p1 = along_x ? c[2][l] : c[1][l], p3 = along_x ? c[6][l] : c[5][l];
      const float q0 = along_x ? c[1][l] : c[2][l], q2 = along_x ? c[5][l] : c[6][l];
      start[0][l] = c[0][l];
      start[1][l] = along_z ? c[1][l] : p1;
      start[2][l] = along_z ? c[2][l] : c[4][l];
      start[3][l] = along_z ? c[3][l] : p3;
      end[0][l] = along_z ? c[4][l] : q0;
      end[1][l] = along_z ? c[5][l] : c[3][l];
      end[2][l] = along_z ? c[6][l] : q2;
      end[3][l] = c[7][l];
    }
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
