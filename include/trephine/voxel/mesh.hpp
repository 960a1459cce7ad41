// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// A triangle mesh: vertices in G [m]; triangles are counter-clockwise seen from outside the bone.
struct Mesh {
  std::vector<std::array<float, 3>> vertices;
  std::vector<std::array<std::uint32_t, 3>> triangles;
  [[nodiscard]] bool operator==(const Mesh&) const = default;
};

}  // namespace trephine
