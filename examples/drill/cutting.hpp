// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"

#include <trephine/core/units.hpp>
#include <trephine/stage/cutting_force.hpp>

/// The law of cutting in the bone that is drilled here.
namespace drill {

/// How a tool's spindle is used.
struct SpindleUse {
  double turns;        ///< without load [1/min]
  double force_scale;  ///< share of the true forces that the device gets
};
// A pen feels a burr's forces. Those of a drill press through a handle, with the body behind it.
inline constexpr SpindleUse kBurrUse{.turns = 40'000, .force_scale = 1};
inline constexpr SpindleUse kDrillUse{.turns = 1000, .force_scale = 1 / 60.0};
[[nodiscard]] constexpr const SpindleUse& use_of(const trephine::CuttingEdges& edges) {
  return edges.chisel ? kDrillUse : kBurrUse;
}

/// Strength by density. Where densities are no Hounsfield units, the volume's lowest has none and its highest has
/// cortical bone's.
[[nodiscard]] inline trephine::BoneStrength strength_of(const Bone& bone) {
  if (bone.unit == "HU") return {};
  const auto range = bone.grid.original_range();
  return {.soft = static_cast<double>(range.min), .cortical = static_cast<double>(range.max)};
}

[[nodiscard]] inline trephine::CuttingForce::Options cutting_with(const trephine::CuttingEdges& edges,
                                                                  const trephine::BoneStrength& strength,
                                                                  const SpindleUse& use) {
  return {.edges = edges, .speed = trephine::rpm(use.turns), .strength = strength, .force_scale = use.force_scale};
}

}  // namespace drill
