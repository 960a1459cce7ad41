// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/broad_phase.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <cstddef>
#include <cstdint>
#include <map>

namespace trephine::test {

/// Every element of a bone's surface by its key, without a broad phase.
template <VoxelDensity Density>
[[nodiscard]] std::map<std::uint64_t, SurfaceElement> all_elements(const VoxelGrid<Density>& bone, double isovalue) {
  BoneSurface<Density> surface(bone, isovalue);
  std::map<std::uint64_t, SurfaceElement> all;
  for (std::size_t brick = 0; brick < bone.brick_count(); ++brick) {
    surface.begin_tick();
    surface.begin_use();
    if (!surface.crosses(brick) || !surface.provide(brick)) continue;
    const Vec3d corner = surface.corner(brick);
    surface.for_each_block(brick, [&](const ElementBlock& block, int count) {
      const NearBlock near{&block, count, brick, corner};
      for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) all[near.key(i)] = near.element(i);
    });
  }
  return all;
}

}  // namespace trephine::test
