// SPDX-License-Identifier: MIT
#pragma once

/// What a first scene needs: bone, the coupled tool, cutting and limits. Topics have headers of their own: tools.hpp,
/// cutting.hpp, structures.hpp, devices.hpp, thesis.hpp; everything.hpp has them all.
#include <trephine/core/units.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/version.hpp>
#include <trephine/voxel/grid_reader.hpp>
#include <trephine/voxel/voxel_grid.hpp>
