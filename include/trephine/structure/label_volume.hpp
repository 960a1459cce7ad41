// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/core/tolerances.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// Voxels that belong to structures, as input of `build_structure_field`. A view: it owns nothing.
///
/// Frame S: the centre of voxel (i, j, k) lies at `spacing * (i, j, k)`.
struct LabelVolume {
  std::array<int, 3> size{};                  ///< voxels along x (fastest in memory), y, z; each >= 1
  Vec3d spacing = Vec3d::Zero();              ///< [m], each > 0
  std::span<const std::uint8_t> structure{};  ///< per voxel: 0 for none, s + 1 for structure s

  /// Structure number plus one at voxel (i, j, k); 0 outside of the volume.
  [[nodiscard]] std::uint8_t at(int i, int j, int k) const noexcept {
    if (i < 0 || j < 0 || k < 0 || i >= size[0] || j >= size[1] || k >= size[2]) return 0;
    return structure[static_cast<std::size_t>(i) +
                     static_cast<std::size_t>(size[0]) *
                         (static_cast<std::size_t>(j) +
                          static_cast<std::size_t>(size[1]) * static_cast<std::size_t>(k))];
  }

  /// Throws std::invalid_argument unless sizes, spacing and the number of voxels fit and a voxel has a structure.
  void validate() const {
    double voxels = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      const double h = spacing[static_cast<Eigen::Index>(a)];
      if (size[a] < 1 || size[a] > kLargestSize) refuse("LabelVolume", "size must be in [1, 4096]", size[a]);
      if (!(h > 0)) refuse("LabelVolume", "spacing must be > 0 m", h);
      if (!(h <= kLargestSpacing)) refuse_beyond("LabelVolume", "spacing", kLargestSpacing, h);
      voxels *= size[a];
    }
    if (voxels != static_cast<double>(structure.size()))
      refuse("LabelVolume", "structure must have one number a voxel", structure.size());
    if (std::all_of(structure.begin(), structure.end(), [](std::uint8_t s) { return s == 0; }))
      refuse("LabelVolume", "a voxel must belong to a structure; voxels that do", 0);
  }

 private:
  static constexpr int kLargestSize = 4096;
};

/// Options of `build_structure_field`.
struct StructureFieldOptions {
  /// Surfaces: true, the smoothed labels' isosurface; false, midway between the centres of differing voxels.
  bool smooth = true;
  double reach = 0.002;  ///< half width of the band about each structure's surface with its own distances [m]
  int threads = 0;       ///< that work; 0: as many as the machine has
};

/// Progress of a build, shared with the thread that waits for it.
struct BuildProgress {
  std::atomic<bool> cancel{false};  ///< set it, from any thread, to end the build early
  std::atomic<float> done{0.0F};    ///< part that is done, from 0 to 1; never falls
};

}  // namespace trephine
