// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/tool/tool_shape.hpp>

#include <algorithm>

namespace trephine::inline TREPHINE_ALIGNED {

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

  void profile(const ProfileLanes<double>& rho, const ProfileLanes<double>& z, Profile& __restrict out) const noexcept {
    using Lanes = ProfileLanes<double>;
    const auto [R, r, L] = measures<double>();
    Lanes to_centre, to_rim;
    split(rho, z, r, L, to_centre, to_rim);
    // Choices and arithmetic in loops of their own, and weights of 0 and 1: arithmetic that follows a choice may trap,
    // and g++ vectorises it for processors with masks alone.
    Lanes s, e, up, inside, flat, centre, not_beyond, is_beyond, beyond_side, beyond_end, shaft, ball;
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      // Signed distances to the cylinder's side and to its nearer end; their positive parts; the larger of both.
      const double side = rho[i] - r, above = z[i] - L;
      const double end = above > -z[i] ? above : -z[i];
      up[i] = above > -z[i] ? 1.0 : -1.0;
      s[i] = side > 0 ? side : 0.0;
      e[i] = end > 0 ? end : 0.0;
      beyond_side[i] = side > 0 ? 1.0 : 0.0;
      beyond_end[i] = end > 0 ? 1.0 : 0.0;
      inside[i] = side > end ? side : end;
      flat[i] = side >= end ? 1.0 : 0.0;
    }
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      is_beyond[i] = inside[i] > 0 ? 1.0 : 0.0;
      not_beyond[i] = inside[i] < 0 ? inside[i] : 0.0;
      centre[i] = to_centre[i] > kCentre ? to_centre[i] : kCentre;
    }
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      shaft[i] = to_rim[i] + not_beyond[i];
      ball[i] = to_centre[i] - R;
    }
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      const double nearer_shaft = shaft[i], nearer_ball = ball[i];
      out.distance[i] = nearer_shaft < nearer_ball ? nearer_shaft : nearer_ball;
      out.central[i] = nearer_shaft < nearer_ball ? 0.0 : 1.0;
    }
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      // Outside the shaft the nearest point may be on the rim of its end.
      const double per_centre = 1 / centre[i], per_rim = 1 / (is_beyond[i] * to_rim[i] + (1 - is_beyond[i]));
      const double shaft_rho = is_beyond[i] * s[i] * per_rim + (1 - is_beyond[i]) * flat[i];
      const double shaft_z = up[i] * (is_beyond[i] * e[i] * per_rim + (1 - is_beyond[i]) * (1 - flat[i]));
      const double rim_curvature = beyond_side[i] * beyond_end[i] * per_rim;
      const double of_ball = out.central[i], of_shaft = 1 - of_ball;
      out.normal_rho[i] = of_ball * (rho[i] * per_centre) + of_shaft * shaft_rho;
      out.normal_z[i] = of_ball * (z[i] * per_centre) + of_shaft * shaft_z;
      out.curvature[i] = of_ball * per_centre + of_shaft * rim_curvature;
    }
  }

  void distances(const ProfileLanes<float>& rho, const ProfileLanes<float>& z,
                 ProfileLanes<float>& __restrict out) const noexcept {
    const auto [R, r, L] = measures<float>();
    ProfileLanes<float> to_centre, to_rim;
    split(rho, z, r, L, to_centre, to_rim);
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      const float side = rho[i] - r, above = z[i] - L;
      const float end = above > -z[i] ? above : -z[i];
      const float inside = side > end ? side : end;
      const float shaft = to_rim[i] + (inside < 0 ? inside : 0.0F), ball = to_centre[i] - R;
      out[i] = shaft < ball ? shaft : ball;
    }
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
  static void split(const ProfileLanes<S>& rho, const ProfileLanes<S>& z, S r, S L,
                    ProfileLanes<S>& __restrict to_centre, ProfileLanes<S>& __restrict to_rim) noexcept {
    ProfileLanes<S> s, e;
    for (std::size_t i = 0; i < kProfileLanes; ++i) to_centre[i] = rho[i] * rho[i] + z[i] * z[i];
    for (std::size_t i = 0; i < kProfileLanes; ++i) {
      const S side = rho[i] - r, above = z[i] - L;
      const S end = above > -z[i] ? above : -z[i];
      s[i] = side > 0 ? side : S(0);
      e[i] = end > 0 ? end : S(0);
    }
    for (std::size_t i = 0; i < kProfileLanes; ++i) to_rim[i] = s[i] * s[i] + e[i] * e[i];
    square_roots(to_centre);
    square_roots(to_rim);
  }

  Burr burr_;
};

static_assert(ToolShape<BallAndShaft>);

}  // namespace trephine
