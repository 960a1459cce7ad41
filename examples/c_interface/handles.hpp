// SPDX-License-Identifier: MIT
#pragma once

#include "guard.hpp"

#include <trephine/compiled/scene.hpp>
#include <trephine/compiled/structures.hpp>
#include <trephine/device/ramp.hpp>

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

/// What callers hold by pointers.

struct trephine_grid {
  trephine::compiled::Bone bone;
};

struct trephine_scene {
  trephine::compiled::Scene scene;
  double removed_mm3 = 0;
};

struct trephine_reader {
  explicit trephine_reader(const trephine::compiled::Bone& of) : bone(of), reader(of) {
    pending.reserve(brick_count());
  }
  [[nodiscard]] std::size_t brick_count() const noexcept {
    const auto& [x, y, z] = bone.bricks();
    return static_cast<std::size_t>(x) * static_cast<std::size_t>(y) * static_cast<std::size_t>(z);
  }

  trephine::compiled::Bone bone;
  trephine::compiled::BoneReader reader;
  std::vector<std::int32_t> pending;  // named by a poll and not yet by a caller's list; taken from its end
  trephine::Mesh mesh;                // as its caller wants it, until it makes another
  std::vector<std::array<float, 3>> normals;
};

struct trephine_structures {
  trephine::compiled::Structures distances;
  std::vector<trephine::ProtectedStructure> each;
  std::vector<std::string> names;
  trephine::ProtectionOptions options{};

  /// Throws std::invalid_argument for a number that is none.
  [[nodiscard]] std::size_t index(const char* function, std::int32_t structure) const {
    trephine_c::require(structure >= 0 && structure < distances.count(), function, ": no structure ", structure);
    return static_cast<std::size_t>(structure);
  }
};

struct trephine_protection {
  trephine::compiled::Protection protection;
};

struct trephine_ramp {
  trephine::Ramp ramp;
  bool anew = true;  // the next factor is 0
};
