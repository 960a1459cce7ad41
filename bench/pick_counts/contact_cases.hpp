// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/density_field.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace pick {

using Grid = trephine::VoxelGrid<std::int16_t>;
using Field = trephine::DensityField<std::int16_t, double>;

/// What a short run of the tool was aimed at.
enum class Kind { kTipPress, kShaftLean, kRim, kSlide };
inline constexpr int kKinds = 4;
inline constexpr std::array<const char*, kKinds> kKindNames{"tip presses", "shaft on ridges and edges",
                                                            "shaft on a hole's rim", "sliding"};

/// A run of the tool, a pose a tick: from just free of the bone into it. The Line approximation has a history, so a
/// single pose says nothing about it.
struct Case {
  Kind kind = Kind::kTipPress;
  bool milled = false;                  ///< it happens in the bone with holes
  std::vector<trephine::Posed> X_GT{};  ///< of the tool in the grid, one a tick of 1 ms
};

/// The bone as it is and with holes milled into it, and what the tool does there.
struct Bones {
  const Grid* whole = nullptr;
  const Grid* milled = nullptr;
  double isovalue = 0;
};

[[nodiscard]] inline std::size_t tick_count(const std::vector<Case>& cases) {
  std::size_t n = 0;
  for (const Case& c : cases) n += c.X_GT.size();
  return n;
}

/// How many there are of each kind.
[[nodiscard]] inline std::array<int, kKinds> count_kinds(const std::vector<Case>& cases) {
  std::array<int, kKinds> counts{};
  for (const Case& c : cases) ++counts[static_cast<std::size_t>(c.kind)];
  return counts;
}

}  // namespace pick
