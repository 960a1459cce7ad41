// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/spot.hpp"
#include "guarded_bone.hpp"
#include "live_options.hpp"

#include <memory>
#include <optional>

namespace live {

/// The bone and where the drill starts.
struct Loaded {
  drill::Bone bone;
  drill::Spot spot;
  std::shared_ptr<const GuardedBone> guarded{};                 ///< nothing without structures
  std::shared_ptr<const trephine::GuardPotential> potential{};  ///< for the tool at the start; made if there is none
  std::shared_ptr<const trephine::SoftStructures> soft{};       ///< made with it
};

/// Reads the volume that the options name, or makes one, and places the drill. Throws std::exception with one line.
[[nodiscard]] Loaded load(const drill::Options& options);
/// The same for a bone that needs no file: `drill::made_bone`.
[[nodiscard]] Loaded made(const drill::Options& options);
/// Voxels of a whole bone, resampled, that a machine has room for: 0.7 GB with textures and originals.
inline constexpr double kMaxVoxels = 110e6;
/// Finds where the drill starts, and resamples all of the bone, or what surrounds the spot where that is too much.
/// Throws likewise.
[[nodiscard]] Loaded placed(drill::Bone bone, const drill::Options& options, double max_voxels = kMaxVoxels);
/// Reads or makes the structures that the options ask for, likewise.
void load_structures(Loaded& loaded, const LiveOptions& options);
/// The structures of `drill::temporal_bone`. Throws as `guard_bone`.
[[nodiscard]] std::shared_ptr<const GuardedBone> guard_temporal_bone(const drill::Bone& bone, double margin,
                                                                     const TellDone& tell = print_done);

/// A round burr with a shaft in proportion.
[[nodiscard]] trephine::Burr round_burr(double radius);
/// The burr that a window with this bone starts with.
[[nodiscard]] trephine::Burr first_burr(const drill::Bone& bone);

}  // namespace live
