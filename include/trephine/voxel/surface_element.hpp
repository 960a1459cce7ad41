// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>

#include <array>
#include <cstddef>
#include <cstdint>

namespace trephine::inline TREPHINE_ALIGNED {

/// A small piece of the isosurface: a parallelogram about `position` with the half sides `along` and `across`.
/// `area` [m²] is its quadrature weight: its own area, and more at sharp edges of bone. G axes, metres.
struct SurfaceElement {
  Vec3d position;
  Vec3d along;
  Vec3d across;
  double area;
};

/// Sixteen elements of a brick as arrays of single precision. Positions are relative to the brick's voxel 0 [m].
struct ElementBlock {
  static constexpr int kSize = 16;
  /// Number of voxel edges of a brick and its halo. `edge` is the voxel edge's number plus this times the part's.
  static constexpr std::uint32_t kEdges = 3 * 9 * 9 * 9;
  using Lanes = std::array<float, kSize>;
  std::array<Lanes, 3> position, along, across;
  Lanes area;
  Lanes spread;                           ///< greatest distance of an element's points from its position [m]
  std::array<std::uint32_t, kSize> edge;  ///< 3 (x + 9 y + 81 z) + axis of the voxel edge, 0 for voxel −1
  Vec3<float> middle;                     ///< centre of a bounding ball, from the brick's voxel 0 [m]
  float radius;                           ///< radius of that ball [m]

  /// Element i in G, for a brick whose voxel 0 lies at `corner`.
  [[nodiscard]] SurfaceElement element(std::size_t i, const Vec3d& corner) const noexcept {
    const auto vector = [&](const std::array<Lanes, 3>& v) {
      return Vec3d(static_cast<double>(v[0][i]), static_cast<double>(v[1][i]), static_cast<double>(v[2][i]));
    };
    return {corner + vector(position), vector(along), vector(across), static_cast<double>(area[i])};
  }

  /// Computes the bounding ball of the first `count` elements, and fills the other lanes with copies of the first.
  void finish(int count) noexcept {
    for (auto i = static_cast<std::size_t>(count); i < kSize; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) position[axis][i] = position[axis][0];
      spread[i] = spread[0];
    }
    Lanes reach{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Lanes& p = position[axis];
      float low = p[0], high = p[0];
      for (const float x : p) low = x < low ? x : low;
      for (const float x : p) high = x > high ? x : high;
      const float centre = 0.5F * (low + high);
      for (std::size_t i = 0; i < kSize; ++i) reach[i] += (p[i] - centre) * (p[i] - centre);
      middle[static_cast<Eigen::Index>(axis)] = centre;
    }
    square_roots(reach);
    radius = 0;
    for (std::size_t i = 0; i < kSize; ++i) reach[i] += spread[i];
    for (const float r : reach) radius = r > radius ? r : radius;
  }
};

}  // namespace trephine
