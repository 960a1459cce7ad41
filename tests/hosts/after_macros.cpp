// SPDX-License-Identifier: MIT
// Every header after the macros of its users' hosts, and a scene after those of X11, which must come after trephine.
#include "qt_macros.hpp"
#include "unreal_macros.hpp"
#include "windows_macros.hpp"

// Written by CMake: every public header.
#include <every_header.hpp>

#include "x11_macros.hpp"

int main() {
  using namespace trephine;
  VoxelGrid<std::int16_t> bone({.size = {8, 8, 8}, .spacing = {1_mm, 1_mm, 1_mm}}, std::vector<std::int16_t>(512));
  const CoupledToolRenderer drill{Burr{.tip_radius = 1.5_mm}, CoupledOptions{.stiffness = 800}};
  HapticScene scene{bone, 300, drill, Cutting{}, DeviceLimits{.force = 3.3, .torque = 0.1}};
  return needs_ramp(scene.tick({.X_WT = Posed::Identity()}, 1e-3).status) ? 1 : 0;
}
