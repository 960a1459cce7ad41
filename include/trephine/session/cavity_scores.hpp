// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/structure/label_grid.hpp>
#include <trephine/voxel/grid_geometry.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <type_traits>
#include <vector>

/// Scores of the bone that a session left, from its grid: a drilled cavity beside the planned one, and volumes by
/// label. A voxel is bone where its density is at least the isovalue, and counts as a whole, as in `removed_mm3` of a
/// tick. Bone before the session is the grid's original (`GridOptions::keep_original`).
///
/// Each function visits all voxels. Call it on the haptic thread between ticks, or while no thread ticks.
namespace trephine::inline TREPHINE_ALIGNED {

/// A drilled cavity beside the planned one.
struct CavityScores {
  double planned_mm3 = 0;  ///< bone before, within the plan
  double removed_mm3 = 0;  ///< bone before that is no bone now
  double overlap_mm3 = 0;  ///< both

  /// Dice's overlap 2 |A ∩ B| / (|A| + |B|), 0 to 1; 1 where nothing was planned and nothing removed.
  [[nodiscard]] double dice() const noexcept {
    const double both = planned_mm3 + removed_mm3;
    return both > 0 ? 2 * overlap_mm3 / both : 1;
  }
  [[nodiscard]] double missed_mm3() const noexcept { return planned_mm3 - overlap_mm3; }  ///< planned, still there
  [[nodiscard]] double excess_mm3() const noexcept { return removed_mm3 - overlap_mm3; }  ///< removed, not planned
};

/// Bone of one structure, or of none.
struct LabelScores {
  std::uint16_t label = 0;  ///< 0: bone without a label
  double before_mm3 = 0;    ///< bone before
  double removed_mm3 = 0;   ///< of it no bone now
};

namespace detail {

inline void check_original(std::string_view function, bool keeps_original) {
  if (!keeps_original) refuse(function, "the bone must keep its original (GridOptions::keep_original)", "one without");
}
inline void check_listed(std::string_view function, bool listed, std::uint16_t label) {
  if (!listed) refuse(function, "the label must be a structure of the grid's", label);
}

/// Calls `visit(p_W, removed)` for each voxel that was bone, x fastest.
template <class Density, class Visit>
void for_each_bone_before(const VoxelGrid<Density>& bone, double isovalue, const Visit& visit) {
  const auto [nx, ny, nz] = bone.size();
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i) {
        const std::size_t at = bone.index(i, j, k);
        if (!(static_cast<double>(bone.original_data()[at]) >= isovalue)) continue;
        const Vec3d p_GQ = bone.spacing().cwiseProduct(Vec3d(i, j, k));
        visit(Vec3d(bone.X_WG() * p_GQ), !(static_cast<double>(bone.data()[at]) >= isovalue));
      }
}

/// A point in W to its label.
template <class Label>
class LabelsInWorld {
 public:
  explicit LabelsInWorld(const LabelGrid<Label>& labels) : labels_(&labels), X_SW_(labels.X_WS().inverse()) {}
  [[nodiscard]] Label at(const Vec3d& p_WQ) const noexcept { return labels_->label_at(X_SW_ * p_WQ); }

 private:
  const LabelGrid<Label>* labels_;
  Posed X_SW_;
};

}  // namespace detail

/// Compares what was removed with a plan: `is_planned(p_WQ)` says whether a point [m] in W is to be removed. Throws
/// std::invalid_argument if the bone does not keep its original.
template <VoxelDensity Density, std::predicate<const Vec3d&> Plan>
[[nodiscard]] CavityScores cavity_scores(const VoxelGrid<Density>& bone, double isovalue, const Plan& is_planned) {
  detail::check_original("cavity_scores", bone.keeps_original());
  std::array<std::array<std::size_t, 2>, 2> counts{};  // [planned][removed]
  detail::for_each_bone_before(
      bone, isovalue, [&](const Vec3d& p_WQ, bool removed) { ++counts[is_planned(p_WQ) ? 1 : 0][removed ? 1 : 0]; });
  const double voxel_mm3 = bone.spacing().prod() * 1e9;
  return {.planned_mm3 = voxel_mm3 * static_cast<double>(counts[1][0] + counts[1][1]),
          .removed_mm3 = voxel_mm3 * static_cast<double>(counts[0][1] + counts[1][1]),
          .overlap_mm3 = voxel_mm3 * static_cast<double>(counts[1][1])};
}

/// The same for a plan that is a structure of a segmentation. Throws std::invalid_argument for a label that is not
/// listed, too.
template <VoxelDensity Density, VoxelLabel Label>
[[nodiscard]] CavityScores cavity_scores(const VoxelGrid<Density>& bone, double isovalue,
                                         const LabelGrid<Label>& labels, std::type_identity_t<Label> plan) {
  detail::check_listed("cavity_scores", labels.find(std::uint16_t{plan}) != nullptr, plan);
  const detail::LabelsInWorld<Label> world(labels);
  return cavity_scores(bone, isovalue, [&](const Vec3d& p_WQ) { return world.at(p_WQ) == plan; });
}

/// Bone before and removed of each structure, in the order of `labels.structures()`; first that without a label.
/// Throws std::invalid_argument if the bone does not keep its original.
template <VoxelDensity Density, VoxelLabel Label>
[[nodiscard]] std::vector<LabelScores> label_scores(const VoxelGrid<Density>& bone, double isovalue,
                                                    const LabelGrid<Label>& labels) {
  detail::check_original("label_scores", bone.keeps_original());
  const std::vector<Structure>& structures = labels.structures();
  std::vector<std::array<std::size_t, 2>> counts(structures.size() + 1);  // before, removed
  const detail::LabelsInWorld<Label> world(labels);
  detail::for_each_bone_before(bone, isovalue, [&](const Vec3d& p_WQ, bool removed) {
    const Label label = world.at(p_WQ);
    const auto is_it = [label](const Structure& s) { return s.label == label; };
    const auto found = std::find_if(structures.begin(), structures.end(), is_it);
    auto& count = counts[label == 0 ? 0 : static_cast<std::size_t>(found - structures.begin()) + 1];
    ++count[0];
    count[1] += removed ? 1 : 0;
  });
  std::vector<LabelScores> scores(counts.size());
  const double voxel_mm3 = bone.spacing().prod() * 1e9;
  for (std::size_t s = 0; s < scores.size(); ++s)
    scores[s] = {.label = s == 0 ? std::uint16_t{0} : structures[s - 1].label,
                 .before_mm3 = voxel_mm3 * static_cast<double>(counts[s][0]),
                 .removed_mm3 = voxel_mm3 * static_cast<double>(counts[s][1])};
  return scores;
}

}  // namespace trephine
