// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/spot.hpp"
#include "../drill/structure_labels.hpp"

#include <trephine/structure/guard_potential.hpp>
#include <trephine/structure/label_grid.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/structure/structure_field.hpp>
#include <trephine/tool/any_tool.hpp>
#include <trephine/voxel/cut_floor.hpp>

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace live {

/// The structures of a bone, and what guards them. Immutable, but for the counts of the floors, which the haptic thread
/// writes.
struct GuardedBone {
  using Floor = trephine::CutFloor<std::int16_t>;

  std::vector<trephine::Structure> structures;            ///< in the field's order
  std::shared_ptr<const trephine::StructureField> field;  ///< in S, the labels' frame
  trephine::Posed X_GS = trephine::Posed::Identity();
  trephine::VoxelBox box;          ///< of the labels that hold a structure
  double margin = 1e-3;            ///< of warning and guard [m]
  double smoothing = 0.6e-3;       ///< of the guard [m]
  double largest_radius = 0;       ///< of a burr that the field's reach allows [m]
  std::shared_ptr<Floor> watch;    ///< cuts take structures, and are counted
  std::shared_ptr<Floor> refuse;   ///< cuts take nothing within half the margin
  std::vector<std::string> notes;  ///< what was left out
  /// How each structure is felt where no bone is over it, by its name; nothing for one that is bone in this volume.
  std::vector<std::optional<trephine::Membrane>> soft;
};

/// The margin of the veto over the guard's: the guard is felt before bone can no longer be cut.
inline constexpr double kVetoShare = 0.5;

/// Is told which share of the distances is done, each quarter.
using TellDone = std::function<void(double share)>;
/// Prints the share on standard output.
void print_done(double share);

/// Builds distances and floors. Throws std::exception with one line: labels that lie beside the bone, or that the
/// library refuses.
[[nodiscard]] std::shared_ptr<const GuardedBone> guard_bone(const drill::Bone& bone, const drill::AnyLabels& labels,
                                                            double margin, std::vector<std::string> notes = {},
                                                            const TellDone& tell = print_done);

/// The same structures for a copy of the bone, with counts of its own.
[[nodiscard]] std::shared_ptr<const GuardedBone> guard_copy(const GuardedBone& guarded, const drill::Bone& copy);

/// The guard's potential for a tool: it takes up to a second, so not for the haptic thread. Throws
/// std::invalid_argument for a tool that the field does not reach round.
[[nodiscard]] std::shared_ptr<const trephine::GuardPotential> potential_for(const GuardedBone& guarded,
                                                                            const trephine::AnyTool& tool);
/// The membranes for a tool, likewise, or nullptr if no structure has one.
[[nodiscard]] std::shared_ptr<const trephine::SoftStructures> soft_for(const GuardedBone& guarded,
                                                                       const trephine::AnyTool& tool);
/// The membrane of a structure whose name has the word dura or nerve, or is of a venous sinus, but not of air's.
[[nodiscard]] std::optional<trephine::Membrane> membrane_named(const std::string& name);

/// Largest radius of a burr in this bone [m].
[[nodiscard]] double largest_burr(const drill::Bone& bone);

/// Structures made around the spot, as `examples/run --structures` makes them.
[[nodiscard]] std::shared_ptr<const GuardedBone> guard_made_structures(const drill::Bone& bone, const drill::Spot& spot,
                                                                       double margin);
/// Structures of a segmentation's file.
[[nodiscard]] std::shared_ptr<const GuardedBone> guard_read_structures(const drill::Bone& bone, const std::string& path,
                                                                       double margin);

}  // namespace live
