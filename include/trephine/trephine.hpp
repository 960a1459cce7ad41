// SPDX-License-Identifier: MIT
#pragma once

/// Everything but structures, the compiled library and the adapters. Include single headers where compile time matters.
#include <trephine/contact/friction.hpp>
#include <trephine/contact/surface_proxy.hpp>
#include <trephine/core/units.hpp>
#include <trephine/device/presets.hpp>
#include <trephine/device/recorder.hpp>
#include <trephine/device/recording_file.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/first_contact.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/line/shaft_tracking.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>
#include <trephine/tool/discretization.hpp>
#include <trephine/version.hpp>
#include <trephine/voxel/clearance_map.hpp>
#include <trephine/voxel/grid_reader.hpp>
#include <trephine/voxel/protected_cut.hpp>
#include <trephine/voxel/resample.hpp>
#include <trephine/voxel/tissue_cut.hpp>
#include <trephine/voxel/voxel_grid.hpp>
