// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/voxel/grid_geometry.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// How steep the densities of an image are at its isosurfaces, for any isovalue.
///
/// A voxel and its next neighbours along the axes cross the isovalues between their densities. Their differences make
/// the gradient there, in densities per voxel. A table of isovalues holds the mean over the voxels that cross each.
/// Rows of at most kVoxels voxels are read, spread evenly over the image. Memory: 4 kB.
class SurfaceSlopes {
 public:
  static constexpr std::size_t kBins = 1024;
  static constexpr std::size_t kVoxels = std::size_t{1} << 22;

  SurfaceSlopes() = default;
  /// Reads voxels, x fastest, with densities from `min` to `max`.
  template <VoxelDensity Density>
  SurfaceSlopes(const std::array<int, 3>& size, std::span<const Density> voxels, Density min, Density max)
      : min_(static_cast<double>(min)), max_(static_cast<double>(max)) {
    per_density_ = kBins / (max_ - min_);
    if (!is_finite(per_density_)) return;  // no range to speak of
    slopes_.resize(kBins);
    // Running sums: a voxel that crosses bins m to n adds its slope from bin m on, and takes it away after n.
    std::vector<double> sum(kBins + 1), count(kBins + 1);
    const auto nx = static_cast<std::size_t>(size[0]), ny = static_cast<std::size_t>(size[1]);
    const double share = static_cast<double>(kVoxels) / static_cast<double>(voxels.size());
    std::size_t row = 0;
    for (int k = 0; k + 1 < size[2]; ++k)
      for (int j = 0; j + 1 < size[1]; ++j) {
        // Multiples of the golden ratio spread evenly.
        const double turns = static_cast<double>(row++) / std::numbers::phi;
        if (turns - std::floor(turns) >= share) continue;
        const Density* v = voxels.data() + nx * (ny * static_cast<std::size_t>(k) + static_cast<std::size_t>(j));
        for (std::size_t i = 0; i + 1 < nx; ++i, ++v) {
          const Density x = v[1], y = v[nx], z = v[nx * ny];
          const Density low = std::min({*v, x, y, z}), high = std::max({*v, x, y, z});
          if (low == high) continue;
          const std::size_t first = bin_of(low), last = bin_of(high);
          const auto here = static_cast<double>(*v);
          const double slope =
              Vec3d(static_cast<double>(x) - here, static_cast<double>(y) - here, static_cast<double>(z) - here).norm();
          sum[first + 1] += slope;
          sum[last + 1] -= slope;
          count[first + 1] += 1;
          count[last + 1] -= 1;
        }
      }
    double slope = 0, voxels_here = 0;
    for (std::size_t n = 0; n < kBins; ++n) {
      slope += sum[n];
      voxels_here += count[n];
      slopes_[n] = voxels_here > 0.5 ? static_cast<float>(slope / voxels_here) : 0.0F;
    }
  }

  /// Returns the mean slope of the surface of an isovalue [densities per voxel]; 0 if the image has no such surface.
  [[nodiscard]] double at(double isovalue) const noexcept {
    if (slopes_.empty() || !(isovalue >= min_ && isovalue <= max_)) return 0;
    return static_cast<double>(slopes_[bin_of(isovalue)]);
  }
  [[nodiscard]] std::size_t bytes() const noexcept { return slopes_.size() * sizeof(float); }

 private:
  template <class Value>
  [[nodiscard]] std::size_t bin_of(Value v) const noexcept {
    return std::min(static_cast<std::size_t>((static_cast<double>(v) - min_) * per_density_), kBins - 1);
  }

  double min_ = 0, max_ = 0, per_density_ = 0;
  std::vector<float> slopes_;
};

}  // namespace trephine
