// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

/// How much bone there is, by the trilinear interpolant: slow, and another way than BoneVolume's.
namespace trephine::test {

/// Share of a cell in which the trilinear interpolant of its corners is above 0: the cell is halved along all axes
/// `depth` times where its corners disagree, and in the smallest the interpolant is a ramp along its steepest axis.
[[nodiscard]] inline double share_of_cell(const std::array<double, 8>& c, int depth) {
  const auto [lo, hi] = std::minmax_element(c.begin(), c.end());
  if (*lo >= 0) return 1;
  if (*hi < 0) return 0;
  if (depth == 0) {
    double mean = 0;
    std::array<double, 3> rise{};
    for (std::size_t i = 0; i < 8; ++i) {
      mean += c[i] / 8;
      for (std::size_t a = 0; a < 3; ++a) rise[a] += ((i >> a & 1) != 0 ? c[i] : -c[i]) / 4;
    }
    double most = 0;
    for (const double r : rise) most = std::max(most, std::abs(r));
    if (std::abs(mean) >= most / 2) return mean >= 0 ? 1 : 0;
    return 0.5 + mean / most;
  }
  // Values at the corners of the eight halves, by axis after axis of means.
  std::array<double, 27> v{};
  const auto at = [](std::size_t x, std::size_t y, std::size_t z) { return (z * 3 + y) * 3 + x; };
  for (std::size_t i = 0; i < 8; ++i) v[at(2 * (i & 1), 2 * (i >> 1 & 1), 2 * (i >> 2))] = c[i];
  for (std::size_t y = 0; y < 3; y += 2)
    for (std::size_t z = 0; z < 3; z += 2) v[at(1, y, z)] = (v[at(0, y, z)] + v[at(2, y, z)]) / 2;
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t z = 0; z < 3; z += 2) v[at(x, 1, z)] = (v[at(x, 0, z)] + v[at(x, 2, z)]) / 2;
  for (std::size_t x = 0; x < 3; ++x)
    for (std::size_t y = 0; y < 3; ++y) v[at(x, y, 1)] = (v[at(x, y, 0)] + v[at(x, y, 2)]) / 2;
  double sum = 0;
  for (std::size_t part = 0; part < 8; ++part) {
    std::array<double, 8> half;
    for (std::size_t i = 0; i < 8; ++i)
      half[i] = v[at((part & 1) + (i & 1), (part >> 1 & 1) + (i >> 1 & 1), (part >> 2) + (i >> 2))];
    sum += share_of_cell(half, depth - 1);
  }
  return sum / 8;
}

/// Remembers a grid's densities, border included, and tells what volume its isosurface has lost since.
template <VoxelDensity Density>
class LostVolume {
 public:
  LostVolume(const VoxelGrid<Density>& grid, double isovalue) : grid_(&grid), isovalue_(isovalue) {
    const auto& n = grid.size();
    before_.assign(grid.data(), grid.data() + grid.index(n[0], n[1], n[2]) + 1);
  }

  [[nodiscard]] double mm3() const {
    const auto& n = grid_->size();
    double cells = 0;
    for (int k = -1; k < n[2]; ++k)
      for (int j = -1; j < n[1]; ++j)
        for (int i = -1; i < n[0]; ++i) {
          std::array<double, 8> was, is;
          for (int c = 0; c < 8; ++c) {
            const std::size_t at = grid_->index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
            was[static_cast<std::size_t>(c)] = static_cast<double>(before_[at]) - isovalue_;
            is[static_cast<std::size_t>(c)] = static_cast<double>(grid_->data()[at]) - isovalue_;
          }
          if (was != is) cells += share_of_cell(was, kDepth) - share_of_cell(is, kDepth);
        }
    return cells * grid_->spacing().prod() * 1e9;
  }

 private:
  /// Halved again, shallow cuts' volumes differ by .1 % or less.
  static constexpr int kDepth = 4;
  const VoxelGrid<Density>* grid_;
  double isovalue_;
  std::vector<Density> before_;
};

}  // namespace trephine::test
