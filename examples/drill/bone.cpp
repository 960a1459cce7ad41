// SPDX-License-Identifier: MIT
#include "bone.hpp"

#include "phantom.hpp"
#include "temporal_bone.hpp"

#include <trephine/tool/named_tools.hpp>
#include <trephine/voxel/largest_piece.hpp>
#include <trephine/voxel/resample.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <utility>

namespace drill {
namespace {

Bone tooth(const Options& options) {
  return {.name = "tooth phantom",
          .unit = "levels",
          .grid = tooth_phantom<std::int16_t>(),
          .isovalue = options.isovalue.value_or(PhantomDensities::kIsovalue),
          .burr = {},
          .notes = {}};
}

}  // namespace

trephine::Burr fitting_burr(const Grid& grid, const Options& options) {
  const double least_mm = std::max(3e3 * grid.spacing().minCoeff(), 0.8);
  const double steps_a_mm = least_mm > 1 ? 2 : 10;
  const double radius_mm = std::ceil(steps_a_mm * least_mm - 1e-6) / steps_a_mm;
  trephine::Burr burr;
  burr.tip_radius = options.tip_radius.value_or(1e-3 * radius_mm);
  // To 0.1 mm, where that is not more than the ball itself.
  const double about_half = 0.53 * burr.tip_radius;
  burr.shaft_radius =
      options.shaft_radius.value_or(about_half < 1e-4 ? about_half : 1e-4 * std::round(1e4 * about_half));
  burr.shaft_length = options.shaft_length.value_or(0.040);
  burr.validate();
  return burr;
}

namespace {

/// Leaves out what hangs apart from the bone, and notes it.
void leave_out_pieces(Bone& bone) {
  const trephine::RemovedPieces removed = trephine::keep_largest_piece(bone.grid, bone.isovalue);
  if (removed.pieces == 0) return;
  bone.notes.push_back("left out: " + std::to_string(removed.pieces) + (removed.pieces == 1 ? " piece" : " pieces") +
                       " apart from the largest one, " + std::to_string(removed.voxels) +
                       " voxels, such as a scanner's head rest");
}

/// Puts the options' tool in, or a burr that fits the bone's voxels.
void choose_tool(Bone& bone, const Options& options) {
  bone.tool_name = options.tool;
  if (options.tool.empty()) {
    bone.burr = fitting_burr(bone.grid, options);
  } else {
    bone.tool = trephine::tool_by_name(options.tool).tool;
    bone.burr = bone.tool->burr();
  }
}

}  // namespace

Bone made_bone(const Options& options) {
  return fitted(options.phantom == Phantom::kTemporalBone ? temporal_bone::bone(options) : tooth(options), options);
}

Bone fitted(Bone bone, const Options& options) {
  const auto range = bone.grid.original_range();
  if (!(range.min < bone.isovalue && bone.isovalue <= range.max)) {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "%s has no surface at isovalue %g: its densities are %g to %g; choose one "
                  "between them with --isovalue",
                  bone.name.c_str(), bone.density(bone.isovalue), bone.density(range.min), bone.density(range.max));
    throw std::runtime_error(text.data());
  }
  choose_tool(bone, options);
  // The skull's file is known to hold its scanner's head rest. Bones of other scans may be apart: a jaw, a hand's.
  if (!options.skull.empty() || options.largest_piece) leave_out_pieces(bone);
  bone.grid = bone.grid.cropped(bone.isovalue);
  return bone;
}

double wanted_voxel(const Grid& grid, const Options& options) {
  constexpr double kFine = 0.4e-3;  // a burr of 1.5 mm has four voxels of radius
  return options.voxel.value_or(grid.spacing().maxCoeff() > 1.25 * kFine ? kFine : 0);
}

std::optional<Bone> resampled_around(const Bone& bone, const trephine::Vec3d& p_W, const Options& options) {
  constexpr double kReach = 24e-3;  // hole, rim and what a picture shows of them
  const trephine::Vec3d& h = bone.grid.spacing();
  const double voxel = wanted_voxel(bone.grid, options);
  if (!(voxel > 0)) return std::nullopt;
  const trephine::Vec3d u = (bone.grid.X_WG().inverse() * p_W).cwiseQuotient(h);
  trephine::VoxelBox box;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto i = static_cast<Eigen::Index>(a);
    // Kept to where voxels are: beyond, the grid's border is.
    const double first = std::clamp(u[i] - kReach / h[i], 0.0, bone.grid.size()[a] - 1.0);
    const double last = std::clamp(u[i] + kReach / h[i], 0.0, bone.grid.size()[a] - 1.0);
    box.lo[a] = static_cast<int>(std::floor(first));
    box.hi[a] = static_cast<int>(std::ceil(last));
  }
  Bone fine{.name = bone.name,
            .unit = bone.unit,
            .grid = trephine::resampled(bone.grid, trephine::Vec3d::Constant(voxel), box),
            .isovalue = bone.isovalue,
            .burr = {},
            .notes = bone.notes,
            .scale = bone.scale,
            .offset = bone.offset};
  choose_tool(fine, options);
  return fine;
}

Grid fresh_copy(const Grid& grid) {
  const auto& n = grid.size();
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                                   static_cast<std::size_t>(n[2]));
  grid.copy_voxels(voxels);
  return {{.size = n, .spacing = grid.spacing(), .X_WG = grid.X_WG(), .outside = static_cast<double>(grid.outside())},
          std::span<const std::int16_t>(voxels)};
}

}  // namespace drill
