// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"
#include "clutch.hpp"
#include "openhaptics_device.hpp"

#include <trephine/device/registration.hpp>
#include <trephine/device/run_report.hpp>

#include <atomic>
#include <string>
#include <vector>

namespace openhaptics {

using HandledDevice = Clutched<Device>;

/// Everything a run of drilling needs.
struct Session {
  Device& device;
  HandledDevice& handled;
  drill::Bone& bone;
  trephine::Registration registration;
  double seconds = 0;  ///< 0: until `quit`
  const std::atomic<bool>& quit;
};

struct Outcome {
  trephine::RunReport report;
  double removed_mm3 = 0;
  double most_force = 0;  ///< sent to the hand [N]
};

/// Drill until the session is over, with one status line. Warnings of the loop are printed before. Translation units of
/// their own: each is a scene of templates.
[[nodiscard]] Outcome drill_line(const Session& session);
[[nodiscard]] Outcome drill_surface(const Session& session);
[[nodiscard]] Outcome drill_coupled(const Session& session);

}  // namespace openhaptics
