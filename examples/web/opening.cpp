// SPDX-License-Identifier: MIT
#include "opening.hpp"

#include <algorithm>
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace web {

Opening::Load made_bone(const std::string& kind, double margin) {
  if (kind != "tooth" && kind != "temporal")
    throw std::invalid_argument("there is no made bone of the name " + kind + ": tooth, temporal");
  return [temporal = kind == "temporal", margin](const Opening::Tell& tell) {
    drill::Options options;
    if (!temporal) return live::made(options);
    options.phantom = drill::Phantom::kTemporalBone;
    live::Loaded loaded = live::made(options);
    tell("measures distances to structures");
    loaded.guarded = live::guard_temporal_bone(loaded.bone, margin, [&](double share) {
      tell("measures distances to structures: " + std::to_string(static_cast<int>(100 * share)) + " %");
    });
    tell("fits the guard to the burr");
    loaded.potential = live::potential_for(*loaded.guarded, live::first_burr(loaded.bone));
    loaded.soft = live::soft_for(*loaded.guarded, live::first_burr(loaded.bone));
    return loaded;
  };
}

Opening::Load scanned_bone(std::string name, const trephine::GridGeometry& geometry, std::vector<std::int16_t> voxels,
                           double isovalue) {
  return [name = std::move(name), geometry, voxels = std::move(voxels), isovalue](const Opening::Tell&) {
    constexpr double kMaxVoxels = 60e6;  // 0.4 GB, of the 2 GB that a page can have
    constexpr int kAirHU = -500;         // densities below it are Hounsfield units, which have air at -1000
    const bool hounsfield = !voxels.empty() && *std::min_element(voxels.begin(), voxels.end()) <= kAirHU;
    drill::Options options;
    options.isovalue = isovalue;
    drill::Bone bone{.name = name,
                     .unit = hounsfield ? "HU" : "of the file's densities",
                     .grid = drill::Grid(geometry, std::span<const std::int16_t>(voxels)),
                     .isovalue = isovalue,
                     .burr = {},
                     .notes = {}};
    return live::placed(drill::fitted(std::move(bone), options), options, kMaxVoxels);
  };
}

}  // namespace web
