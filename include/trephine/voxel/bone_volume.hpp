// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/bit_cast.hpp>
#include <trephine/voxel/lane_bits.hpp>
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

/// Volume of bone: the space in which the trilinear interpolant reaches the isovalue.
namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// Smallest density that is bone, and whether the type has one: the isovalue, rounded up.
template <VoxelDensity Density>
struct LeastBone {
  explicit LeastBone(double isovalue) noexcept {
    constexpr double kMax = static_cast<double>(std::numeric_limits<Density>::max());
    constexpr double kLowest = static_cast<double>(std::numeric_limits<Density>::lowest());
    if constexpr (std::is_floating_point_v<Density>) {
      density = static_cast<Density>(isovalue);
      if (static_cast<double>(density) < isovalue)
        density = std::nextafter(density, std::numeric_limits<Density>::infinity());
    } else {
      is_reached = isovalue <= kMax;
      const double least = std::ceil(isovalue > kLowest ? isovalue : kLowest);
      density = static_cast<Density>(is_reached ? least : kMax);
    }
  }

  Density density;
  bool is_reached = true;
};

/// Adds up the shares of bone in cells that the surface crosses.
///
/// Along a line parallel to a cell's edge the interpolant is linear, so the line's share of bone is exact:
/// (p⁺ + q⁺)/(|p| + |q|), with p and q the ends' densities above the isovalue. A cell has lines along the axis of its
/// steepest mean difference, at 4 × 4 Gauss points. A plane in a linear image is exact if it leaves the cell by its
/// sides alone. If it leaves by the ends, the errors of neighbours along the axis cancel. For cuts of .3 voxel depth,
/// with their rims, the volume errs by .6 %; with 3 × 3 points by 1.2 %.
///
/// Cost: 16 divisions a cell, in vector code.
template <VoxelDensity Density>
class CrossedCells {
 public:
  explicit CrossedCells(double isovalue) noexcept : isovalue_(static_cast<float>(isovalue)) {}

  /// Adds the cells whose bit is set, between the rows (y, z), (y + 1, z), (y, z + 1), (y + 1, z + 1). Cell i lies
  /// between their voxels i and i + 1.
  void add(std::uint64_t cells, const Density* r00, const Density* r10, const Density* r01,
           const Density* r11) noexcept {
    std::size_t to = count_;
    for (; cells != 0; cells &= cells - 1) {
      const int i = std::countr_zero(cells);
      pair_[0][to] = pair_at(r00 + i);
      pair_[1][to] = pair_at(r10 + i);
      pair_[2][to] = pair_at(r01 + i);
      pair_[3][to] = pair_at(r11 + i);
      if (++to < kLanes) continue;
      add_kept(kLanes);
      to = 0;
    }
    count_ = to;
  }

  /// Returns the sum of the shares so far [cells].
  [[nodiscard]] double sum() noexcept {
    add_kept(static_cast<int>(count_));
    count_ = 0;
    double sum = 0;
    for (const double lane : sums_) sum += lane;
    return sum;
  }

 private:
  static constexpr int kLanes = 16;
  /// A voxel and the next one. Integers share the bytes: one in the upper half, one in the lower half.
  using Pair = std::conditional_t<std::is_floating_point_v<Density>, std::uint64_t, std::uint32_t>;
  using Lanes = std::array<float, kLanes>;

  [[nodiscard]] static Pair pair_at(const Density* at) noexcept {
    if constexpr (sizeof(Density) == 1) {
      std::uint16_t two;
      std::memcpy(&two, at, sizeof(two));
      return two;
    } else {
      Pair two;
      std::memcpy(&two, at, sizeof(two));
      return two;
    }
  }

  static void split(const std::array<Pair, kLanes>& pair, Lanes& first, Lanes& second) noexcept {
    if constexpr (std::is_floating_point_v<Density>) {
      std::array<float, 2 * kLanes> all;
      std::memcpy(all.data(), pair.data(), sizeof(all));
      for (std::size_t l = 0; l < kLanes; ++l) first[l] = all[2 * l];
      for (std::size_t l = 0; l < kLanes; ++l) second[l] = all[2 * l + 1];
    } else {
      constexpr int kBits = 8 * sizeof(Density);
      constexpr bool kLittle = std::endian::native == std::endian::little;
      constexpr int kToFirst = 32 - (kLittle ? 1 : 2) * kBits, kToSecond = 32 - (kLittle ? 2 : 1) * kBits;
      // Extended with its sign if the type is signed.
      using Top = std::conditional_t<std::is_signed_v<Density>, std::int32_t, std::uint32_t>;
      for (std::size_t l = 0; l < kLanes; ++l)
        first[l] = static_cast<float>(static_cast<int>(static_cast<Top>(pair[l] << kToFirst) >> (32 - kBits)));
      for (std::size_t l = 0; l < kLanes; ++l)
        second[l] = static_cast<float>(static_cast<int>(static_cast<Top>(pair[l] << kToSecond) >> (32 - kBits)));
    }
  }

  // Separate loops over all lanes, so that they are vectorised.
  void add_kept(int count) noexcept {
    std::array<Lanes, 8> c;
    const float isovalue = isovalue_;
    for (std::size_t m = 0; m < 4; ++m) {
      split(pair_[m], c[2 * m], c[2 * m + 1]);
      for (std::size_t l = 0; l < kLanes; ++l) c[2 * m][l] -= isovalue;
      for (std::size_t l = 0; l < kLanes; ++l) c[2 * m + 1][l] -= isovalue;
    }
    // Excess of the cell's steepness along x over y, and along z over both. Masks, because compilers without blends
    // make jumps of choices, half of which are mispredicted.
    std::array<std::uint32_t, kLanes> along_x, along_z;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float d07 = c[7][l] - c[0][l], d16 = c[6][l] - c[1][l];
      const float d25 = c[5][l] - c[2][l], d34 = c[4][l] - c[3][l];
      const float x = std::abs(d07 - d16 + d25 - d34);
      const float y = std::abs(d07 + d16 - d25 - d34);
      const float z = std::abs(d07 + d16 + d25 + d34);
      along_x[l] = x >= y ? ~0U : 0U;
      along_z[l] = z >= (x > y ? x : y) ? ~0U : 0U;
    }
    // Corners at the lines' starts and ends, in the order of the two axes across.
    std::array<Lanes, 4> start, end;
    start[0] = c[0];
    end[3] = c[7];
    const auto choose = [&](Lanes& out, const Lanes& by_x, const Lanes& by_y, const Lanes& by_z) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        const auto bits = [l](const Lanes& from) { return detail::bit_cast<std::uint32_t>(from[l]); };
        const std::uint32_t across = (bits(by_x) & along_x[l]) | (bits(by_y) & ~along_x[l]);
        out[l] = detail::bit_cast<float>((bits(by_z) & along_z[l]) | (across & ~along_z[l]));
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
    Lanes share{};  // share of bone minus share of air
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
          constexpr float kMin = std::numeric_limits<float>::min();
          const float both = std::abs(p) + std::abs(q) + kMin;
          share[l] += kWeight[u] * kWeight[v] * ((p + q + kMin) / both);
        }
    }
    // Lanes without a cell hold earlier cells.
    for (std::size_t l = 0; l < kLanes; ++l) share[l] = (static_cast<int>(l) < count ? 0.5F : 0.0F) * (1.0F + share[l]);
    for (std::size_t l = 0; l < kLanes; ++l) sums_[l] += static_cast<double>(share[l]);
  }

  float isovalue_;
  std::size_t count_ = 0;
  std::array<double, kLanes> sums_{};
  std::array<std::array<Pair, kLanes>, 4> pair_{};  // corners along x of cells that are not summed yet
};

}  // namespace detail

/// Adds up the volume in which the trilinear interpolant reaches the isovalue, cell by cell. A cell's corners are eight
/// voxels, the border's included. `detail::CrossedCells` computes a cell's share.
///
/// Cost: eight comparisons a cell, and 16 divisions a cell that the surface crosses, in vector code. No allocation.
/// Haptic thread.
template <VoxelDensity Density>
class BoneVolume {
 public:
  /// With an isovalue above the type's range there is no bone.
  BoneVolume(const VoxelGrid<Density>& grid, double isovalue) noexcept
      : grid_(grid), least_(isovalue), crossed_(isovalue) {}

  /// Adds cells `first` to `last` of a row; cell (i, j, k) reaches from voxel (i, j, k) to (i + 1, j + 1, k + 1), each
  /// index from −1 to size − 1, which is not checked.
  void add_row(int j, int k, int first, int last) noexcept {
    if (!least_.is_reached) return;
    const Density* const row = grid_.data() + grid_.index(0, j, k);
    int i = first;
    for (; last - i >= kLanes / 2; i += kLanes) add_block<kLanes>(row + i, std::min(last - i + 1, kLanes));
    if (i <= last) add_block<kLanes / 2>(row + i, last - i + 1);
  }

  /// Returns the volume added so far [cells].
  [[nodiscard]] double cells() noexcept { return static_cast<double>(whole_) + crossed_.sum(); }

 private:
  static constexpr int kLanes = 16;
  using Mask = detail::LaneFlag<Density>;

  template <std::size_t kBlock>
  void add_block(const Density* at, int count) noexcept {
    const std::ptrdiff_t y = grid_.row_pitch(), z = grid_.plane_pitch();
    const Density least = least_.density;
    // Corners in bone. Lanes beyond the count belong to the next row, or are spare.
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
        const Density* const cell = at + static_cast<std::ptrdiff_t>(w) * (64 / kBits) + lane;
        crossed_.add(1, cell, cell + y, cell + z, cell + y + z);
      }
    }
  }

  const VoxelGrid<Density>& grid_;
  detail::LeastBone<Density> least_;
  detail::CrossedCells<Density> crossed_;
  std::int64_t whole_ = 0;
};

}  // namespace trephine
