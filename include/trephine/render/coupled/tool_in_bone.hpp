// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/clearance_field.hpp>

#include <algorithm>

namespace trephine {

/// Whether the tool's axis, as far as its core reaches, is in bone somewhere: looked at every shortest spacing.
template <class View>
[[nodiscard]] bool is_core_in_bone(const View& view, const ToolBounds& bounds, const Posed& X) noexcept {
  constexpr int kMostSamples = 1000;
  const Vec3d u = X.linear().col(2);
  const double first = bounds.z_low + bounds.core_radius;
  const double length = std::max(0.0, bounds.z_high - bounds.core_radius - first);
  const int n = std::min(kMostSamples, static_cast<int>(length / view.grid().spacing().minCoeff()) + 1);
  for (int i = 0; i <= n; ++i)
    if (view.surface().is_bone(X.translation() + (first + length * i / n) * u)) return true;
  return false;
}

/// Whether the view knows, without a sample, that no bone is nearer than `motion` [m] to the tool. False may also mean
/// that it does not know.
template <class View>
[[nodiscard]] bool is_known_in_air(const View& view, const ToolBounds& bounds, const Posed& X, double motion) noexcept {
  if constexpr (ClearanceField<View> || BoundedField<View>) {
    const Vec3d u = X.linear().col(2);
    const double voxel = view.grid().spacing().minCoeff();
    const double radius = (bounds.z_high - bounds.z_low) / 2 + bounds.radius + motion + voxel;
    const double middle = (bounds.z_high + bounds.z_low) / 2;
    if (is_known_clear<View, double>(view, X.translation() + middle * u, radius)) return true;
    // Balls of air about points of the axis, until they hold the tool.
    if constexpr (ClearanceField<View>) {
      constexpr int kMostBalls = 8;
      double z = bounds.z_low;
      for (int i = 0; i < kMostBalls; ++i) {
        const double air = view.template clearance_at<double>(X.translation() + z * u) - bounds.radius - motion;
        if (!(air > voxel)) return false;
        z += air;
        if (z > bounds.z_high) return true;
      }
    }
  }
  return false;
}

}  // namespace trephine
