// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>

/// Tests for a tool's core in bone, and for a tool in the air.
namespace trephine::inline TREPHINE_ALIGNED {

/// Returns true if bone holds a sample of the tool's core: of the axis, between points `core_radius` from its ends.
/// Samples lie a shortest spacing apart at most, unless the tool has over 1000 of them.
template <class View>
[[nodiscard]] bool is_core_in_bone(const View& view, const ToolBounds& bounds, const Posed& X) noexcept {
  const Vec3d u = z_axis(X);
  const double first = bounds.z_low + bounds.core_radius;
  const double length = std::max(0.0, bounds.z_high - bounds.core_radius - first);
  const int n =
      std::min(CoupledConstants::kMaxAxisSamples, static_cast<int>(length / view.grid().spacing().minCoeff()) + 1);
  for (int i = 0; i <= n; ++i)
    if (view.surface().is_bone(X.translation() + (first + length * i / n) * u)) return true;
  return false;
}

/// Returns true if the tool and `motion` [m] about it lie beyond the volume and in air. False proves nothing.
template <class View>
[[nodiscard]] bool is_known_in_air(const View& view, const ToolBounds& bounds, const Posed& X, double motion) noexcept {
  const double radius = (bounds.z_high - bounds.z_low) / 2 + bounds.radius + motion + view.grid().spacing().minCoeff();
  const double middle = (bounds.z_high + bounds.z_low) / 2;
  return view.is_beyond(X.translation() + middle * z_axis(X), radius);
}

}  // namespace trephine
