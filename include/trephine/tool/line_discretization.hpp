// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/counts.hpp>
#include <trephine/tool/discretization.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// Vertices of the Line approximation, on the shaft's centreline: vertex i is at height `heights()[i]` above T's
/// origin.
template <RealScalar S>
class ToolDiscretization<LineCounts, S, Burr> {
 public:
  using Scalar = S;
  static constexpr int kMaxVertices = 100000;  ///< along the shaft; bounds memory and the work of a tick

  /// Throws std::invalid_argument for an invalid burr, or for a count outside [1, 100000] if the burr has a shaft.
  ToolDiscretization(const Burr& burr, const LineCounts& counts) : burr_(burr) {
    burr.validate();
    if (!burr.has_shaft()) return;
    if (!(counts.shaft >= 1 && counts.shaft <= kMaxVertices))
      refuse("ToolDiscretization", "shaft vertices must be 1 to 100000", counts.shaft);
    // The centreline, unlike the shaft's surface, leaves the ball at its pole.
    const double from = burr.tip_radius;
    for (int i = 0; i < counts.shaft; ++i) {
      const double fraction = counts.shaft == 1 ? 1.0 : static_cast<double>(i) / (counts.shaft - 1);
      points_.push_back({0, 0, from + fraction * (burr.shaft_length - from)});
    }
    count_ = counts.shaft;
    points_.pad();
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }
  [[nodiscard]] int count() const noexcept { return count_; }
  /// Vertices with padding, a multiple of kLane.
  [[nodiscard]] int padded() const noexcept { return points_.size(); }
  [[nodiscard]] const PointArrays<Scalar>& points() const noexcept { return points_; }
  /// Heights of the vertices above T's origin, ascending [m].
  [[nodiscard]] const std::vector<Scalar>& heights() const noexcept { return points_.z; }

 private:
  Burr burr_;
  int count_ = 0;
  PointArrays<Scalar> points_;
};

}  // namespace trephine
