// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/isovalue_warning.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <sstream>
#include <string>
#include <vector>

/// Checks of a scene's tool, bone and renderer against each other, at construction. Any thread; they allocate.
namespace trephine::inline TREPHINE_ALIGNED {

/// Tip radius that voxels hold [longest spacings]. A deep hole's section is then off by 4.4 % at most. At a radius of
/// one it is too large by 11 % (coupled tool), or too small by 20 %.
inline constexpr double kFewestVoxels = 2;
/// Least stiffness that is likely meant [N/m]: a hand that presses it by 3 cm feels 0.3 N.
inline constexpr double kSoftest = 10;

/// Throws std::invalid_argument for a burr larger than the bone: burr and grid then differ in units.
template <VoxelDensity Density>
void check_tool_size(const VoxelGrid<Density>& bone, const Burr& burr) {
  const double diagonal = bone.spacing().cwiseProduct(Vec3d(bone.size()[0], bone.size()[1], bone.size()[2])).norm();
  if (2 * burr.tip_radius <= diagonal) return;
  std::ostringstream rule;
  rule << "the grid's diagonal of " << diagonal << " m must exceed the burr's diameter (are both in metres?)";
  refuse("HapticScene", rule.str(), 2 * burr.tip_radius);
}

/// Returns one sentence for each reason why a scene's results may be off: voxels too long for a tool that cuts, an
/// isovalue that finds no surface, a stiffness that is likely in other units.
template <VoxelDensity Density, class R>
[[nodiscard]] std::vector<std::string> scene_warnings(const VoxelGrid<Density>& bone, double isovalue,
                                                      const R& renderer, bool cuts) {
  std::vector<std::string> warnings;
  const double voxel = bone.spacing().maxCoeff(), radius = renderer.shape().tip_radius;
  if (cuts && radius < kFewestVoxels * voxel) {
    std::ostringstream s;
    s << "trephine::HapticScene: the tool's diameter is " << 2 * radius / voxel << " of the longest voxels: below "
      << 2 * kFewestVoxels << " a hole's section is off by 4 to 20 %; `resampled` makes finer voxels";
    warnings.push_back(s.str());
  }
  if (const std::string text = isovalue_warning(bone, isovalue); !text.empty())
    warnings.push_back("trephine::HapticScene: " + text);
  if constexpr (HasStiffness<R>)
    if (static_cast<double>(renderer.stiffness()) < kSoftest) {
      std::ostringstream s;
      s << "trephine::HapticScene: a stiffness of " << static_cast<double>(renderer.stiffness())
        << " N/m is not felt; is it in N/mm?";
      warnings.push_back(s.str());
    }
  return warnings;
}

}  // namespace trephine
