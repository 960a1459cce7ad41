// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Cutting edges of a tool.
struct CuttingEdges {
  enum class Kind : unsigned char {
    kFluted,   ///< edges along the head
    kDiamond,  ///< grains all over it, without edges
  };
  Kind kind = Kind::kFluted;
  int flutes = 8;       ///< edges round the axis; 0 for diamond
  bool chisel = false;  ///< the edges do not meet on the axis, where a web presses bone aside: a twist drill
  double wear = 0;      ///< by how much more blunt edges rub: the share by which their own forces have grown, >= 0

  /// Edges that pass a place of the head in a turn. A diamond's grains act as kGrains edges.
  [[nodiscard]] int count() const noexcept { return kind == Kind::kDiamond ? kGrains : flutes; }
  static constexpr int kGrains = 24;

  /// Throws std::invalid_argument.
  void validate() const {
    if (kind == Kind::kFluted && !(flutes >= 1 && flutes <= 100))
      refuse("CuttingEdges", "flutes must be 1 to 100", flutes);
    if (!(wear >= 0) || !is_finite(wear)) refuse("CuttingEdges", "wear must be finite and >= 0", wear);
  }
};

}  // namespace trephine
