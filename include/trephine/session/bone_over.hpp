// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/session/cavity_scores.hpp>
#include <trephine/structure/label_grid.hpp>
#include <trephine/voxel/grid_geometry.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <type_traits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Bone that a session left over a structure: how far it was skeletonised.
struct BoneOver {
  double before_mm3 = 0;  ///< bone before, within the reach of the structure and none of its own
  double left_mm3 = 0;    ///< of it bone now
  /// Smallest thickness of what was left between the structure and a removed voxel [m]: the distance of their centres
  /// less a voxel, right to about a voxel. 0: the structure is exposed. Infinite: nothing was removed within the reach.
  double thinnest = std::numeric_limits<double>::infinity();
};

namespace detail {

/// Squared distances [m²] between voxels of a box and the nearest of those that hold 0, up to a reach: exact, by one
/// pass an axis (Felzenszwalb and Huttenlocher 2012), each over a window as wide as the reach.
class WindowedDistance {
 public:
  WindowedDistance(const VoxelBox& box, const Vec3d& spacing, double reach) : box_(box) {
    std::size_t voxels = 1;
    for (std::size_t a = 0; a < 3; ++a) {
      size_[a] = static_cast<std::size_t>(box.hi[a] - box.lo[a] + 1);
      spacing_[a] = spacing[static_cast<Eigen::Index>(a)];
      window_[a] = static_cast<std::size_t>(reach / spacing_[a]);
      voxels *= size_[a];
    }
    squared_.assign(voxels, std::numeric_limits<float>::infinity());
  }

  [[nodiscard]] float& at(int i, int j, int k) noexcept {
    const auto from = [this](int u, std::size_t a) { return static_cast<std::size_t>(u - box_.lo[a]); };
    return squared_[(from(k, 2) * size_[1] + from(j, 1)) * size_[0] + from(i, 0)];
  }

  void spread() {
    std::size_t stride = 1;
    for (std::size_t a = 0; a < 3; stride *= size_[a++]) {
      std::vector<float> row(size_[a]);
      for (std::size_t start = 0; start < squared_.size(); ++start) {
        if (start / stride % size_[a] != 0) continue;
        for (std::size_t u = 0; u < size_[a]; ++u) row[u] = squared_[start + u * stride];
        for (std::size_t u = 0; u < size_[a]; ++u) squared_[start + u * stride] = smallest(row, u, a);
      }
    }
  }

 private:
  [[nodiscard]] float smallest(const std::vector<float>& row, std::size_t u, std::size_t a) const noexcept {
    const std::size_t first = u - std::min(u, window_[a]), last = std::min(u + window_[a], row.size() - 1);
    float best = std::numeric_limits<float>::infinity();
    for (std::size_t v = first; v <= last; ++v) {
      const double apart = spacing_[a] * (static_cast<double>(v) - static_cast<double>(u));
      best = std::min(best, row[v] + static_cast<float>(apart * apart));
    }
    return best;
  }

  VoxelBox box_;
  std::array<std::size_t, 3> size_{}, window_{};
  std::array<double, 3> spacing_{};
  std::vector<float> squared_;
};

/// The voxels of the bone's grid around those of a structure and `reach` beyond.
template <class Density, class Label>
[[nodiscard]] VoxelBox box_around(const VoxelGrid<Density>& bone, const LabelGrid<Label>& labels, Label label,
                                  double reach) {
  const VoxelBox of_labels = labels.box_of(label);
  const Posed X_GS = bone.X_WG().inverse() * labels.X_WS();
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    Vec3d u;
    for (int a = 0; a < 3; ++a) {
      const auto axis = static_cast<std::size_t>(a);
      u[a] = (corner >> a & 1) != 0 ? of_labels.hi[axis] + 0.5 : of_labels.lo[axis] - 0.5;
    }
    box.extend(Vec3d(X_GS * labels.spacing().cwiseProduct(u)));
  }
  VoxelBox voxels;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    const double h = bone.spacing()[axis], end = bone.size()[a];
    voxels.lo[a] = static_cast<int>(std::clamp(std::floor((box.min()[axis] - reach) / h), 0.0, end));
    voxels.hi[a] = static_cast<int>(std::clamp(std::ceil((box.max()[axis] + reach) / h), -1.0, end - 1));
  }
  return voxels;
}

}  // namespace detail

/// Measures the bone left within `reach` [m] of a structure, in the bone's voxels. Throws std::invalid_argument if the
/// bone does not keep its original, the label is not listed, or the reach is not > 0 and at most 0.05 m. Takes memory
/// and time for the voxels around the structure; call it as `cavity_scores`.
template <VoxelDensity Density, VoxelLabel Label>
[[nodiscard]] BoneOver bone_over(const VoxelGrid<Density>& bone, double isovalue, const LabelGrid<Label>& labels,
                                 std::type_identity_t<Label> label, double reach) {
  constexpr double kFarthestReach = 0.05;
  detail::check_original("bone_over", bone.keeps_original());
  detail::check_listed("bone_over", labels.find(std::uint16_t{label}) != nullptr, label);
  if (!(reach > 0)) refuse("bone_over", "reach must be > 0 m", reach);
  refuse_beyond("bone_over", "reach", kFarthestReach, reach);
  BoneOver over;
  const VoxelBox box = detail::box_around(bone, labels, label, reach);
  if (box.empty()) return over;

  const auto for_each_voxel = [&box](const auto& visit) {
    for (int k = box.lo[2]; k <= box.hi[2]; ++k)
      for (int j = box.lo[1]; j <= box.hi[1]; ++j)
        for (int i = box.lo[0]; i <= box.hi[0]; ++i) visit(i, j, k);
  };
  const detail::LabelsInWorld<Label> world(labels);
  detail::WindowedDistance distance(box, bone.spacing(), reach);
  for_each_voxel([&](int i, int j, int k) {
    const Vec3d p_GQ = bone.spacing().cwiseProduct(Vec3d(i, j, k));
    if (world.at(bone.X_WG() * p_GQ) == label) distance.at(i, j, k) = 0;
  });
  distance.spread();

  std::size_t before = 0, left = 0;
  for_each_voxel([&](int i, int j, int k) {
    const std::size_t at = bone.index(i, j, k);
    const double d = std::sqrt(static_cast<double>(distance.at(i, j, k)));
    if (!(static_cast<double>(bone.original_data()[at]) >= isovalue) || !(d <= reach)) return;
    const bool is_left = static_cast<double>(bone.data()[at]) >= isovalue;
    if (!is_left) over.thinnest = std::min(over.thinnest, std::max(0.0, d - bone.spacing().mean()));
    if (!(d > 0)) return;
    ++before;
    left += is_left ? 1 : 0;
  });
  const double voxel_mm3 = bone.spacing().prod() * 1e9;
  over.before_mm3 = voxel_mm3 * static_cast<double>(before);
  over.left_mm3 = voxel_mm3 * static_cast<double>(left);
  return over;
}

}  // namespace trephine
