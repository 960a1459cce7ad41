// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/tool/tool_shape.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Pose at which the coupled tool is drawn: the virtual tool's, or on the way there where that snapped past an edge.
class DrawnPose {
 public:
  /// Moves to the virtual tool at X: at once where contact starts anew, else by no more than the device moved and
  /// kDrawnSpeed, at `arm` metres from the tool's origin.
  void follow(const Posed& X, bool at_once, double arm, const ToolMotion& device_motion, double dt) noexcept {
    const double travel = motion_between(X_, X).at(arm);
    const double most = device_motion.at(arm) + CoupledConstants::kDrawnSpeed * dt;
    X_ = at_once || !(travel > most) ? X : moved(X_, (most / travel) * motion_to(X_, X));
  }

  [[nodiscard]] const Posed& pose() const noexcept { return X_; }

 private:
  Posed X_ = Posed::Identity();
};

}  // namespace trephine
