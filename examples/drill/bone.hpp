// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"

#include <trephine/tool/revolved_tool.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace drill {

using Grid = trephine::VoxelGrid<std::int16_t>;

/// What is drilled: a volume cropped to its bone, and what fits it.
struct Bone {
  std::string name;                ///< for pictures and tables: "skull", "tooth phantom", a file's name
  std::string unit;                ///< of the file's densities: "HU", "levels" or "of the file's densities"
  Grid grid;                       ///< its world is the volume as read: first voxel's centre, the volume's axes
  double isovalue = 0;             ///< bone is where density >= isovalue
  trephine::Burr burr;             ///< a drill of sensible size for these voxels
  std::vector<std::string> notes;  ///< what was changed or is not known
  std::string tool_name{};         ///< of `tool`
  std::optional<trephine::RevolvedTool> tool{};  ///< in place of the burr, which then has its size
  double scale = 1;                              ///< of the file's densities: level = scale * density + offset
  double offset = 0;                             ///< likewise

  /// The file's density of a level of the grid.
  [[nodiscard]] double density(double level) const { return (level - offset) / scale; }
};

/// Reads or makes what the options ask for. Throws std::exception with one clear line: what, where, what to do.
[[nodiscard]] Bone load_bone(const Options& options);
/// Makes the bone that needs no file: the phantom that the options ask for, or the tooth.
[[nodiscard]] Bone made_bone(const Options& options);
/// Fits a bone as it was read to be drilled: puts the options' tool in, leaves out pieces if they say so, and crops.
/// Throws std::runtime_error where it has no surface at its isovalue.
[[nodiscard]] Bone fitted(Bone bone, const Options& options);

/// A burr for these voxels, as far as the options leave it open: three voxels' radius at least, so that the ball is
/// round and its way out of bone is more than one sample; in steps of half a millimetre, or of 0.1 mm below 1 mm.
[[nodiscard]] trephine::Burr fitting_burr(const Grid& grid, const Options& options);

/// The spacing [m] to resample to: the options' own, or 0.4 mm where voxels are clearly coarser; 0: as read.
[[nodiscard]] double wanted_voxel(const Grid& grid, const Options& options);

/// The bone within reach of a drill at `p_W`, resampled to the spacing that the options ask for, with a burr that fits
/// these voxels; nothing where the voxels stay as read. Throws std::invalid_argument as `trephine::resampled`.
[[nodiscard]] std::optional<Bone> resampled_around(const Bone& bone, const trephine::Vec3d& p_W,
                                                   const Options& options);

/// A grid of its own with the same densities in the same place, to be carved.
[[nodiscard]] Grid fresh_copy(const Grid& grid);

}  // namespace drill
