// SPDX-License-Identifier: MIT
#include "loaded.hpp"

#include "../drill/temporal_bone.hpp"

#include <trephine/voxel/resample.hpp>

#include <array>
#include <cstddef>
#include <cstdio>
#include <string>
#include <utility>

namespace live {
namespace {

/// What is left where the whole bone is too large, and what to do.
std::string crop_note(const drill::Grid& left, double voxels, double max_voxels) {
  const auto& n = left.size();
  const Vec3d mm = 1e3 * left.spacing().cwiseProduct(Vec3d(n[0], n[1], n[2]));
  std::array<char, 320> text{};
  std::snprintf(
      text.data(), text.size(),
      "cropped to %.0f x %.0f x %.0f mm around the start: the whole would be %.0f million voxels of %.2g mm, "
      "and %.0f fit; --voxel takes larger ones, --at another place, --largest-piece leaves out what hangs apart",
      mm.x(), mm.y(), mm.z(), 1e-6 * voxels, 1e3 * left.spacing().x(), 1e-6 * max_voxels);
  return text.data();
}

}  // namespace

Loaded made(const drill::Options& options) {
  drill::Options placed_options = options;
  if (options.phantom == drill::Phantom::kTemporalBone && !options.at)
    placed_options.at = drill::temporal_bone::kSpot_W;
  return placed(drill::made_bone(options), placed_options);
}

std::shared_ptr<const GuardedBone> guard_temporal_bone(const drill::Bone& bone, double margin, const TellDone& tell) {
  return guard_bone(bone, drill::temporal_bone::labels(), margin, {}, tell);
}

Loaded placed(drill::Bone bone, const drill::Options& options, double max_voxels) {
  drill::Spot spot = options.at ? drill::spot_near(bone, *options.at) : drill::find_spot(bone);
  const Vec3d h = bone.grid.spacing();
  const double voxel = drill::wanted_voxel(bone.grid, options);
  if (voxel > 0) {
    double voxels = 1;
    for (std::size_t a = 0; a < 3; ++a) voxels *= bone.grid.size()[a] * h[static_cast<Eigen::Index>(a)] / voxel;
    drill::Options fine_options = options;
    fine_options.voxel = voxel;
    if (voxels <= max_voxels) {
      bone.grid = trephine::resampled(bone.grid, Vec3d::Constant(voxel));
      if (!bone.tool) bone.burr = drill::fitting_burr(bone.grid, options);
    } else if (auto fine = drill::resampled_around(bone, spot.p_W, fine_options)) {
      bone = std::move(*fine);
      bone.notes.push_back(crop_note(bone.grid, voxels, max_voxels));
    }
    spot = drill::spot_near(bone, spot.p_W);
  }
  return {std::move(bone), spot};
}

trephine::Burr round_burr(double radius) {
  return {.tip_radius = radius, .shaft_radius = 0.53 * radius, .shaft_length = 0.040};
}

trephine::Burr first_burr(const drill::Bone& bone) { return bone.tool ? round_burr(bone.burr.tip_radius) : bone.burr; }

}  // namespace live
