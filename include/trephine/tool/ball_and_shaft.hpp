// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>

namespace trephine {

/// Exact signed distance of a round burr (`Burr`): a ball about T's origin and a flat-ended cylinder along +z.
class BallAndShaft {
 public:
  /// Throws std::invalid_argument for a burr that `Burr::validate` refuses.
  BallAndShaft(const Burr& burr) : burr_(burr) {  // NOLINT(google-explicit-constructor): a Burr is this shape
    burr.validate();
  }

  [[nodiscard]] const Burr& burr() const noexcept { return burr_; }

  [[nodiscard]] ToolBounds bounds() const noexcept {
    const double R = burr_.tip_radius, r = burr_.shaft_radius;
    if (!burr_.has_shaft()) return {-R, R, R, R, R};
    return {-R, std::max(R, burr_.shaft_length), std::max(R, r), std::min(R, r), burr_.shaft_emerges()};
  }

  /// The burr with a larger ball: the shaft does not cut.
  [[nodiscard]] CuttingBall cutting_head(double allowance) const noexcept {
    CuttingBall head{burr_, allowance};
    head.tip_radius += allowance;
    return head;
  }

  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& out) const noexcept {
    const auto [R, r, L] = measures<double>();
    ProfileLanes<double> to_centre, to_rim;
    split(rho, z, r, L, to_centre, to_rim);
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      // Signed distances to the cylinder's side and to its nearer end; their positive parts; the larger of both.
      const double side = rho[i] - r, above = z[i] - L, up = above > -z[i] ? 1.0 : -1.0;
      const double end = above > -z[i] ? above : -z[i];
      const double s = side > 0 ? side : 0.0, e = end > 0 ? end : 0.0;
      const double inside = side > end ? side : end;
      const double shaft = to_rim[i] + (inside < 0 ? inside : 0.0), ball = to_centre[i] - R;
      const bool is_ball = !(shaft < ball);
      const bool is_rim = inside > 0;  // outside the shaft: the nearest point may be on the rim of its end
      const double per_centre = 1 / (to_centre[i] > kCentre ? to_centre[i] : kCentre);
      const double per_rim = 1 / (is_rim ? to_rim[i] : 1.0);
      const double flat_rho = side >= end ? 1.0 : 0.0;
      const double shaft_rho = is_rim ? s * per_rim : flat_rho;
      const double shaft_z = is_rim ? up * e * per_rim : up * (1 - flat_rho);
      const double rim_curvature = s > 0 && e > 0 ? per_rim : 0.0;
      out.distance[i] = is_ball ? ball : shaft;
      out.normal_rho[i] = is_ball ? rho[i] * per_centre : shaft_rho;
      out.normal_z[i] = is_ball ? z[i] * per_centre : shaft_z;
      out.curvature[i] = is_ball ? per_centre : rim_curvature;
      out.central[i] = is_ball ? 1.0 : 0.0;
    }
  }

  void distances(const ProfileLanes<float>& rho, const ProfileLanes<float>& z,
                 ProfileLanes<float>& out) const noexcept {
    const auto [R, r, L] = measures<float>();
    ProfileLanes<float> to_centre, to_rim, nearest;
    split(rho, z, r, L, to_centre, to_rim);
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      const float side = rho[i] - r, above = z[i] - L;
      const float end = above > -z[i] ? above : -z[i];
      const float inside = side > end ? side : end;
      const float shaft = to_rim[i] + (inside < 0 ? inside : 0.0F), ball = to_centre[i] - R;
      nearest[i] = shaft < ball ? shaft : ball;
    }
    out = nearest;
  }

 private:
  // Distance from the ball's centre [m] below which the gradient has no direction: it is then shorter than 1.
  static constexpr double kCentre = 1e-9;
  // End of the shaft of a tool without a shaft [m]: so far below the ball that the ball is always nearer.
  static constexpr double kNoShaft = -1e9;

  template <class S>
  struct Measures {
    S tip, shaft, length;
  };
  /// Radii and shaft length in precision S.
  template <class S>
  [[nodiscard]] Measures<S> measures() const noexcept {
    return {static_cast<S>(burr_.tip_radius), static_cast<S>(burr_.shaft_radius),
            static_cast<S>(burr_.has_shaft() ? burr_.shaft_length : kNoShaft)};
  }

  /// Distances from the ball's centre, and from the cylinder for points outside it (0 inside).
  template <class S>
  static void split(const ProfileLanes<S>& rho, const ProfileLanes<S>& z, S r, S L, ProfileLanes<S>& to_centre,
                    ProfileLanes<S>& to_rim) noexcept {
    ProfileLanes<S> centre, rim;
    for (std::size_t i = 0; i < kProfileLanes; ++i) centre[i] = rho[i] * rho[i] + z[i] * z[i];
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      const S side = rho[i] - r, above = z[i] - L;
      const S end = above > -z[i] ? above : -z[i];
      const S s = side > 0 ? side : S(0), e = end > 0 ? end : S(0);
      rim[i] = s * s + e * e;
    }
    to_centre = centre;
    to_rim = rim;
    square_roots(to_centre);
    square_roots(to_rim);
  }

  Burr burr_;
};

static_assert(ToolShape<BallAndShaft>);

}  // namespace trephine
