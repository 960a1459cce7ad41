// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "run_log.hpp"
#include "surgeon.hpp"

namespace drill {

/// Runs of the algorithms on `bone`, which they carve. Translation units of their own: each is a scene of
/// templates.
[[nodiscard]] RunLog run_line(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon,
                              double pictured);
[[nodiscard]] RunLog run_surface(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon,
                                 double pictured);
[[nodiscard]] RunLog run_coupled(Grid& bone, const Bone& about, const Options& options, const Surgeon& surgeon,
                                 double pictured);

/// Stiffness of the bone under the tip, the same for all [N/m].
inline constexpr double kStiffness = 800;
/// Of the simulated device [N, N·m].
inline constexpr double kMaxForce = 8.5, kMaxTorque = 0.188;

}  // namespace drill
