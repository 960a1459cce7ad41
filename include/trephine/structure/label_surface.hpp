// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/structure/label_volume.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Surfaces of labels, as oriented points on the voxel edges that leave a structure.
namespace trephine::inline TREPHINE_ALIGNED::detail {

/// An oriented point of a structure's surface, in S. Single precision: 1e-4 voxels at 256 voxels.
struct Surfel {
  std::array<float, 3> position;  ///< [m]
  std::array<float, 3> normal;    ///< unit length, out of the structure
  std::uint8_t structure;
  std::uint8_t side;  ///< of the voxel that it belongs to: +x, -x, +y, -y, +z, -z
};

/// Integer box of voxels, both ends included.
struct LatticeBox {
  std::array<int, 3> lo{}, hi{};
};

/// Weights of a Gaussian along one axis.
class SmoothingKernel {
 public:
  static constexpr int kRadius = 4;      ///< [voxels]
  static constexpr double kSigma = 1.2;  ///< [voxels]: normals stray by 5 degrees

  SmoothingKernel() noexcept {
    double sum = 0;
    for (int i = -kRadius; i <= kRadius; ++i) sum += std::exp(-i * i / (2 * kSigma * kSigma));
    for (int i = 0; i <= kRadius; ++i)
      weight_[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(-i * i / (2 * kSigma * kSigma)) / sum);
  }
  [[nodiscard]] float operator[](int i) const noexcept { return weight_[static_cast<std::size_t>(i < 0 ? -i : i)]; }

 private:
  std::array<float, kRadius + 1> weight_{};
};

/// Finds the surfels of one structure in one block of voxels. Owns the block's memory; one per thread.
class LabelSurface {
 public:
  static constexpr int kBlock = 32;  ///< edge of a block [voxels]

  explicit LabelSurface(const LabelVolume& volume) : volume_(&volume), occupancy_(kVolume), scratch_(kVolume) {}

  /// Appends the surfels on all edges from voxels of `structure` in the block at `first` to voxels not of it.
  void find(int structure, const std::array<int, 3>& first, std::vector<Surfel>& out) {
    bool blurred = false;
    const auto label = static_cast<std::uint8_t>(structure + 1);
    const std::array<int, 3> end{std::min(first[0] + kBlock, volume_->size[0]),
                                 std::min(first[1] + kBlock, volume_->size[1]),
                                 std::min(first[2] + kBlock, volume_->size[2])};
    for (int k = first[2]; k < end[2]; ++k)
      for (int j = first[1]; j < end[1]; ++j)
        for (int i = first[0]; i < end[0]; ++i) {
          if (volume_->at(i, j, k) != label) continue;
          for (int side = 0; side < 6; ++side) {
            std::array<int, 3> other{i, j, k};
            const auto axis = static_cast<std::size_t>(side / 2);
            other[axis] += side % 2 == 0 ? 1 : -1;
            if (volume_->at(other[0], other[1], other[2]) == label) continue;
            if (!blurred) {
              blur(label, first);
              blurred = true;
            }
            out.push_back(surfel(structure, first, {i, j, k}, side));
          }
        }
  }

 private:
  static constexpr int kHalo = SmoothingKernel::kRadius + 2;  // the gradient beside the block reads one more
  static constexpr int kEdge = kBlock + 2 * kHalo;
  static constexpr std::size_t kVolume = static_cast<std::size_t>(kEdge) * kEdge * kEdge;
  [[nodiscard]] static std::size_t at(int x, int y, int z) noexcept {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(kEdge) * (static_cast<std::size_t>(y) + kEdge * static_cast<std::size_t>(z));
  }

  /// Occupancy of the block and its halo, smoothed along each axis.
  void blur(std::uint8_t label, const std::array<int, 3>& first) {
    for (int z = 0; z < kEdge; ++z)
      for (int y = 0; y < kEdge; ++y)
        for (int x = 0; x < kEdge; ++x)
          occupancy_[at(x, y, z)] =
              volume_->at(first[0] + x - kHalo, first[1] + y - kHalo, first[2] + z - kHalo) == label ? 1.0F : 0.0F;
    for (const std::size_t pitch : {at(1, 0, 0), at(0, 1, 0), at(0, 0, 1)}) {
      constexpr auto r = static_cast<std::size_t>(SmoothingKernel::kRadius);
      const std::size_t margin = r * pitch;
      // Wraps around at the ends of lines, within the halo, where nothing is read.
      for (std::size_t n = margin; n < kVolume - margin; ++n) {
        float sum = kernel_[0] * occupancy_[n];
        for (std::size_t i = 1; i <= r; ++i)
          sum += kernel_[static_cast<int>(i)] * (occupancy_[n - i * pitch] + occupancy_[n + i * pitch]);
        scratch_[n] = sum;
      }
      occupancy_.swap(scratch_);
    }
  }

  [[nodiscard]] Vec3d gradient(std::size_t n) const noexcept {
    const auto difference = [&](std::size_t pitch) {
      return static_cast<double>(occupancy_[n + pitch]) - static_cast<double>(occupancy_[n - pitch]);
    };
    const Vec3d per_voxel(difference(at(1, 0, 0)), difference(at(0, 1, 0)), difference(at(0, 0, 1)));
    return per_voxel.cwiseQuotient(volume_->spacing);
  }

  /// The surfel midway along the edge from `voxel` to its neighbour. Its normal is the smoothed occupancy's gradient,
  /// or without smoothing the edge.
  [[nodiscard]] Surfel surfel(int structure, const std::array<int, 3>& first, const std::array<int, 3>& voxel,
                              int side) const noexcept {
    const auto axis = static_cast<Eigen::Index>(side / 2);
    const int step = side % 2 == 0 ? 1 : -1;
    Vec3d normal = Vec3d::Zero();
    normal[axis] = step;
    const std::size_t in = at(voxel[0] - first[0] + kHalo, voxel[1] - first[1] + kHalo, voxel[2] - first[2] + kHalo);
    const std::size_t pitch = side < 2 ? at(1, 0, 0) : side < 4 ? at(0, 1, 0) : at(0, 0, 1);
    const Vec3d slope = -gradient(in) - gradient(step > 0 ? in + pitch : in - pitch);
    if (slope.dot(normal) > 0) normal = slope.normalized();
    Vec3d u(voxel[0], voxel[1], voxel[2]);
    u[axis] += 0.5 * step;
    const Vec3d p = u.cwiseProduct(volume_->spacing);
    Surfel s{};
    for (std::size_t a = 0; a < 3; ++a) {
      s.position[a] = static_cast<float>(p[static_cast<Eigen::Index>(a)]);
      s.normal[a] = static_cast<float>(normal[static_cast<Eigen::Index>(a)]);
    }
    s.structure = static_cast<std::uint8_t>(structure);
    s.side = static_cast<std::uint8_t>(side);
    return s;
  }

  const LabelVolume* volume_;
  SmoothingKernel kernel_;
  std::vector<float> occupancy_, scratch_;
};

}  // namespace trephine::detail
