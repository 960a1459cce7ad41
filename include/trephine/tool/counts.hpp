// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

/// Numbers of a burr's vertices, for the Line and Surface approximations.
namespace trephine::inline TREPHINE_ALIGNED {

/// Vertex count of the Line approximation (thesis 3.1): vertices along the shaft's centreline, both ends included. The
/// shaft starts where it leaves the ball: a vertex at the ball's centre would make every press of the tip a shaft
/// contact.
struct LineCounts {
  int shaft = 50;
};

/// Vertex counts of the Surface approximation (thesis 3.2). Each group (ball, slice) has a further vertex at its
/// centre. With the defaults the force on smooth bone is within 1 % of the limit of infinitely many vertices
/// (`bench/run`).
struct SurfaceCounts {
  int sphere = 260;   ///< vertices on the ball
  int slices = 70;    ///< slices along the shaft
  int per_slice = 8;  ///< vertices round each slice

  /// Counts of the thesis: 207 vertices with the centres.
  [[nodiscard]] static constexpr SurfaceCounts thesis() noexcept {
    return {.sphere = 26, .slices = 20, .per_slice = 8};
  }
};

}  // namespace trephine
