// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/sampling.hpp>

/// What the library's sampling is measured against.
namespace trephine::bench {

/// The least that sampling must do: the four pairs of voxels of each cell, loaded, at addresses known beforehand.
class BareLoads {
 public:
  /// `n` is a multiple of kLane.
  template <RealScalar Scalar>
  BareLoads(const SampleView<std::uint8_t, Scalar>& view, const Mat3<Scalar>& A, const Vec3<Scalar>& t, const Scalar* x,
            const Scalar* y, const Scalar* z, int n)
      : voxels_(view.voxels), row_(view.row), plane_(view.plane) {
    for (int i = 0; i < n; ++i)
      base_.push_back(cell_at<std::uint8_t, Scalar>(view, A * Vec3<Scalar>(x[i], y[i], z[i]) + t).base);
    words_.resize(4 * base_.size());
  }

  /// Loads into a buffer, as a kernel would: two neighbours of an array after the other, which processors write at
  /// once.
  const std::uint16_t* operator()() noexcept {
    const std::size_t n = base_.size();
    const int* base = base_.data();
    const auto load = [base](const std::uint8_t* corner, std::uint16_t* words, std::size_t i) {
      std::memcpy(words + i, corner + base[i], 2);
      std::memcpy(words + i + 1, corner + base[i + 1], 2);
    };
    const std::uint8_t* voxels = voxels_;
    const std::ptrdiff_t row = row_, plane = plane_;
    std::uint16_t* words = words_.data();
    for (std::size_t i = 0; i < n; i += 2) {
      load(voxels, words, i);
      load(voxels + row, words + n, i);
      load(voxels + plane, words + 2 * n, i);
      load(voxels + plane + row, words + 3 * n, i);
    }
    return words;
  }

 private:
  const std::uint8_t* voxels_;
  std::ptrdiff_t row_, plane_;
  std::vector<int> base_;
  std::vector<std::uint16_t> words_;
};

/// Trilinear sampling as one writes it first: a point at a time in double precision, each corner's index checked.
class CheckedSampling {
 public:
  explicit CheckedSampling(const VoxelGrid<std::uint8_t>& grid)
      : size_(grid.size()),
        spacing_(grid.spacing()),
        outside_(grid.outside()),
        voxels_(static_cast<std::size_t>(size_[0]) * static_cast<std::size_t>(size_[1]) *
                static_cast<std::size_t>(size_[2])) {
    grid.copy_voxels(voxels_);
  }

  [[nodiscard]] double operator()(const Vec3d& p_G) const {
    const Vec3d u = p_G.cwiseQuotient(spacing_);
    const Eigen::Vector3i base = u.array().floor().cast<int>();
    const Vec3d f = u - base.cast<double>();
    double sum = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i step(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      double weight = 1;
      for (int a = 0; a < 3; ++a) weight *= step[a] == 1 ? f[a] : 1 - f[a];
      sum += weight * at(base + step);
    }
    return sum;
  }

 private:
  [[nodiscard]] double at(const Eigen::Vector3i& v) const {
    for (int a = 0; a < 3; ++a)
      if (v[a] < 0 || v[a] >= size_[static_cast<std::size_t>(a)]) return outside_;
    return voxels_.at(static_cast<std::size_t>((v.z() * size_[1] + v.y()) * size_[0] + v.x()));
  }

  std::array<int, 3> size_;
  Vec3d spacing_;
  double outside_;
  std::vector<std::uint8_t> voxels_;
};

}  // namespace trephine::bench
