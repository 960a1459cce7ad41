// SPDX-License-Identifier: MIT
#pragma once

/// Devices: presets, servo loop, simulated device, recordings; and the stages that a device may need.
#include <trephine/device/presets.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/device/two_hands.hpp>
#include <trephine/session/recorder.hpp>
#include <trephine/session/recording_file.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/release_limit.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>
