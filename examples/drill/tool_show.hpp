// SPDX-License-Identifier: MIT
#pragma once

#include "surgeon.hpp"

#include <trephine/core/status.hpp>
#include <trephine/tool/cutting_law.hpp>

#include <array>
#include <string>
#include <vector>

namespace drill {

/// Tools that are shown, as `trephine::tool_by_name`.
inline constexpr std::array kShownTools{"round-3", "match-head-3", "diamond-3", "twist-3.2"};

/// One tick. Without the cutting law the thrust is the contact's force, and spindle, torque and feed are nan.
struct ToolRow {
  double time = 0;          ///< [s]
  trephine::Vec3d force_W;  ///< on the device [N]
  double thrust = 0;        ///< true one, before the device's share [N]
  double torque = 0;        ///< true one, of the bone about the spindle's axis [N·m]
  double spindle = 0;       ///< [rad/s]
  double feed = 0;          ///< that the law allows [m/s]
  double depth = 0;         ///< of the drawn tool's foremost point below the spot [m]
  double removed_mm3 = 0;   ///< since the run's start
  bool presses = false;     ///< the tool touches bone, and the hand does not withdraw yet
  trephine::Status status{};
};

/// Mean strength of the removed bone, relative to cortical bone.
struct MeanStrength {
  double law = 0;      ///< as the cutting law sampled it when bone went
  double voxels = 0;   ///< of the removed voxels themselves, which the scan's blur softens
  double densest = 0;  ///< of the densest voxel near each of them
};

/// One tool, with the cutting law or without.
struct ToolRun {
  std::string tool;
  bool law = false;
  double force_scale = 1;  ///< share of the true forces that the device gets
  std::vector<ToolRow> rows;
  double chip_work = 0;  ///< of the spindle, with the law [J]
  MeanStrength strength;

  /// Mean strength of the removed bone by the spindle's work on chips.
  [[nodiscard]] double worked_strength() const {
    return chip_work / (trephine::CuttingLaw{}.energy * 1e-9 * rows.back().removed_mm3);
  }
};

/// Means over the ticks that press.
struct ToolFigures {
  double force = 0, ripple = 0;  ///< on the device: mean and, above about 10 Hz, root mean square [N]
  double most_force = 0;         ///< on the device, of all ticks; nan if one is [N]
  double thrust = 0;             ///< [N]
  double torque = 0;             ///< [N·m]
  double removed_mm3 = 0;        ///< by all ticks that press
  double per_thrust = 0;         ///< the same by thrust and time [mm³/(N·s)]
};
[[nodiscard]] ToolFigures figures_of(const ToolRun& run);

/// By tool, without the law before with it.
struct ToolShow {
  std::vector<ToolRun> runs;
  double seconds = 0;  ///< of each run
  double voxel = 0;    ///< of the bone that was drilled [m]
};

/// Whether the bone's voxels are fine enough for tools of 3 mm: three to the radius, as for a burr.
[[nodiscard]] bool shown_tools_fit(const Bone& bone);

/// Presses each tool into the bone at the surgeon's spot, burrs then along, with the example's own cut and with the
/// cutting law. Device and renderer are the coupled algorithm's; no other stage adds to the force. Voxels far finer
/// than the tools are made coarser first.
[[nodiscard]] ToolShow show_tools(const Bone& bone, const Options& options, const Surgeon& surgeon);

void print_table(const ToolShow& show);
/// Writes `time_s,tool,law,force_N,...`, a row a tick. Throws std::runtime_error where the file cannot be written.
void write_csv(const ToolShow& show, const std::string& path);
/// Prints what must hold of forces, work and volumes. Returns how much does not.
[[nodiscard]] int check(const ToolShow& show);

}  // namespace drill
