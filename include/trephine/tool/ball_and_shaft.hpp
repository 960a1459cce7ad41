// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace trephine {

/// The exact shape of a round burr: a ball about T's origin and a flat-ended cylinder along +z (`Burr`).
class BallAndShaft {
 public:
  /// Throws std::invalid_argument for a burr that `Burr::validate` refuses.
  BallAndShaft(const Burr& burr) : burr_(burr) {  // NOLINT(google-explicit-constructor): a Burr is this shape
    burr.validate();
    if (!burr.has_shaft()) burr_.shaft_radius = 0;
    shaft_end_ = burr.has_shaft() ? burr.shaft_length : -std::numeric_limits<double>::max() / 4;
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }

  [[nodiscard]] ToolBounds bounds() const noexcept {
    const double R = burr_.tip_radius, r = burr_.shaft_radius;
    if (!burr_.has_shaft()) return {-R, R, R, R};
    return {-R, std::max(R, burr_.shaft_length), std::max(R, r), std::min(R, r)};
  }

  [[nodiscard]] ProfilePoint at(double rho, double z) const noexcept {
    const double to_centre = std::sqrt(rho * rho + z * z);
    const double ball = to_centre - burr_.tip_radius;
    const double side = rho - burr_.shaft_radius;
    const double end = std::max(-z, z - shaft_end_);
    const bool beside = side > 0, beyond = end > 0;
    const double shaft = beside && beyond ? std::sqrt(side * side + end * end) : std::max(side, end);
    if (!(shaft < ball)) {
      if (!(to_centre > kCentre)) return {ball, 0, -1, 1 / kCentre, true};
      return {ball, rho / to_centre, z / to_centre, 1 / to_centre, true};
    }
    const double up = z > 0 ? 1 : -1;
    if (beside && beyond) return {shaft, side / shaft, up * end / shaft, 1 / shaft, false};
    return side >= end ? ProfilePoint{shaft, 1, 0, 0, false} : ProfilePoint{shaft, 0, up, 0, false};
  }

  template <RealScalar S>
  void distances(const S* rho, const S* z, S* out, std::size_t n) const noexcept {
    const auto R = static_cast<S>(burr_.tip_radius), r = static_cast<S>(burr_.shaft_radius);
    const auto L = static_cast<S>(std::max(shaft_end_, -1e9));
    using Lanes = Eigen::Array<S, 16, 1>;
    for (std::size_t i = 0; i < n; i += 16) {
      const Eigen::Map<const Lanes> rhos(rho + i), zs(z + i);
      const Lanes side = rhos - r;
      const Lanes end = (-zs).max(zs - L);
      const Lanes ball = (rhos.square() + zs.square()).sqrt() - R;
      const Lanes shaft = (side.max(S(0)).square() + end.max(S(0)).square()).sqrt() + side.max(end).min(S(0));
      Eigen::Map<Lanes>(out + i) = ball.min(shaft);
    }
  }

 private:
  static constexpr double kCentre = 1e-9;  // [m]: nearer to the ball's centre there is no direction
  Burr burr_;
  double shaft_end_;
};

static_assert(ToolShape<BallAndShaft>);

}  // namespace trephine
