// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>

#include <Eigen/Core>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

/// Lines and circular arcs that outlines are made of, and the nearest places on them.
namespace trephine::inline TREPHINE_ALIGNED {

/// A place on a tool's outline [m] with the unit normal out of the body.
struct OutlinePlace {
  double rho, z, normal_rho, normal_z;
};

/// A piece of a tool's outline: a line, or an arc with side ±1 (outward, inward), from its lower end to its upper one
/// [m].
struct OutlinePiece {
  double rho, z, end_rho, end_z;
  double along_rho = 0, along_z = 0, length = 0;              // of a line
  double centre_rho = 0, centre_z = 0, radius = 0, side = 0;  // of an arc
  double middle_rho = 0, middle_z = 0, cosine = 1;            // of an arc: its middle's direction, half its angle

  /// A straight piece between two places that differ [m].
  [[nodiscard]] static OutlinePiece line(double rho, double z, double end_rho, double end_z) noexcept {
    const double length = std::hypot(end_rho - rho, end_z - z);
    return {.rho = rho,
            .z = z,
            .end_rho = end_rho,
            .end_z = end_z,
            .along_rho = (end_rho - rho) / length,
            .along_z = (end_z - z) / length,
            .length = length};
  }

  /// Of an arc: the sine of half its angle.
  [[nodiscard]] double sine() const noexcept { return std::sqrt(1 - cosine * cosine); }
  /// ρ at a height between its ends [m].
  [[nodiscard]] double radius_at(double height) const noexcept {
    if (side != 0) {
      const double b = height - centre_z;
      return centre_rho + side * std::sqrt(std::max(0.0, radius * radius - b * b));
    }
    if (!(end_z > z)) return std::min(rho, end_rho);
    return rho + (end_rho - rho) * (height - z) / (end_z - z);
  }
  /// Largest ρ [m].
  [[nodiscard]] double largest_radius() const noexcept {
    const bool bulges = side > 0 && (centre_z - z) * (centre_z - end_z) < 0;
    return bulges ? centre_rho + radius : std::max(rho, end_rho);
  }
  /// Angle by which its direction turns [rad].
  [[nodiscard]] double turn() const noexcept { return side != 0 ? 2 * std::acos(cosine) : 0.0; }
  /// Length along it [m].
  [[nodiscard]] double length_along() const noexcept { return side != 0 ? radius * turn() : length; }
  /// Place after this length [m] along it.
  [[nodiscard]] OutlinePlace place_at(double along) const noexcept {
    if (side == 0) return {rho + along * along_rho, z + along * along_z, along_z, -along_rho};
    const double angle = std::atan2(z - centre_z, rho - centre_rho) + side * along / radius;
    const double c = std::cos(angle), s = std::sin(angle);
    return {centre_rho + radius * c, centre_z + radius * s, side * c, side * s};
  }
  /// Area that it sweeps about the axis between two lengths along it [m²].
  [[nodiscard]] double area(double from, double to) const noexcept {
    const OutlinePlace a = place_at(from), b = place_at(to);
    const double about_centre = centre_rho * (to - from) + side * radius * (b.z - a.z);
    return 2 * std::numbers::pi * (side == 0 ? (a.rho + b.rho) / 2 * (to - from) : about_centre);
  }
};

namespace detail {

/// The nearest place on a piece, for several points at a time. Plain loops over members, which cannot overlap, so
/// that compilers vectorise them.
template <RealScalar S, std::size_t kLanes>
struct NearestOnPiece {
  using Lanes = std::array<S, kLanes>;
  Lanes at_rho, at_z;  ///< the points
  Lanes square;        ///< of the distance
  Lanes rho, z;        ///< from the nearest place
  Lanes at_end;        ///< 1 if that is an end of the piece, else 0
  Lanes inside;        ///< 1 if the point is level with the piece, on the body's side of it
  Lanes to_centre;     ///< of an arc: distance from its centre
  S low, high;         ///< least and largest height of the points

  NearestOnPiece(const Lanes& point_rho, const Lanes& point_z) noexcept
      : at_rho(point_rho), at_z(point_z), low(lanes(point_z).minCoeff()), high(lanes(point_z).maxCoeff()) {}

  /// True if a piece lies so far above or below all points that it is no nearer to any than `best`, squared distances
  /// from other pieces. None is level with it then.
  [[nodiscard]] bool is_beyond(const OutlinePiece& p, const Lanes& best) noexcept {
    const S gap = std::max(static_cast<S>(p.z) - high, low - static_cast<S>(p.end_z));
    if (!(gap > S(0))) return false;
    if (most_ < S(0)) most_ = lanes(best).maxCoeff();
    return gap * gap > kRoundedUp * most_;
  }

  void find(const OutlinePiece& p) noexcept {
    most_ = -1;
    p.side != 0 ? find_on_arc(p) : find_on_line(p);
  }

  void find_on_line(const OutlinePiece& p) noexcept {
    const S p_rho = static_cast<S>(p.rho), p_z = static_cast<S>(p.z), end_z = static_cast<S>(p.end_z);
    const S along_rho = static_cast<S>(p.along_rho), along_z = static_cast<S>(p.along_z);
    const S length = static_cast<S>(p.length), zero = 0;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const S a = at_rho[l] - p_rho, b = at_z[l] - p_z;
      const S along = a * along_rho + b * along_z;
      const S up = along > zero ? along : zero, on = up < length ? up : length;
      rho[l] = a - on * along_rho;
      z[l] = b - on * along_z;
      at_end[l] = on == along ? S(0) : S(1);
      const S in = a * along_z - b * along_rho < S(0) ? S(1) : S(0);
      const S above = at_z[l] >= p_z ? in : S(0);
      inside[l] = at_z[l] < end_z ? above : S(0);
    }
    for (std::size_t l = 0; l < kLanes; ++l) square[l] = rho[l] * rho[l] + z[l] * z[l];
  }

  void find_on_arc(const OutlinePiece& p) noexcept {
    const S p_rho = static_cast<S>(p.rho), p_z = static_cast<S>(p.z);
    const S end_rho = static_cast<S>(p.end_rho), end_z = static_cast<S>(p.end_z);
    const S centre_rho = static_cast<S>(p.centre_rho), centre_z = static_cast<S>(p.centre_z);
    const S middle_rho = static_cast<S>(p.middle_rho), middle_z = static_cast<S>(p.middle_z);
    const S radius = static_cast<S>(p.radius), side = static_cast<S>(p.side), cosine = static_cast<S>(p.cosine);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const S a = at_rho[l] - centre_rho, b = at_z[l] - centre_z;
      to_centre[l] = a * a + b * b;
    }
    square_roots(to_centre);
    for (std::size_t l = 0; l < kLanes; ++l) {
      // The end on the point's side: an arc ascends, so its end has the larger angle from the middle.
      const S a = at_rho[l] - centre_rho, b = at_z[l] - centre_z;
      const S upper = (middle_rho * b - middle_z * a) * side > S(0) ? S(1) : S(0);
      rho[l] = at_rho[l] - p_rho - upper * (end_rho - p_rho);
      z[l] = at_z[l] - p_z - upper * (end_z - p_z);
      at_end[l] = a * middle_rho + b * middle_z >= cosine * to_centre[l] ? S(0) : S(1);
    }
    for (std::size_t l = 0; l < kLanes; ++l) {
      // An end is farther than the circle.
      const S off = to_centre[l] - radius, to_end = at_end[l] * (rho[l] * rho[l] + z[l] * z[l]);
      square[l] = to_end > off * off ? to_end : off * off;
    }
    // Level with the arc, the body has what lies before its centre, with or without the circle.
    const S circle = p.side > 0 ? S(1) : S(0);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const S before = at_rho[l] < centre_rho ? S(1) : S(0);
      const S in = to_centre[l] < radius ? circle : before;
      const S above = at_z[l] >= p_z ? in : S(0);
      inside[l] = at_z[l] < end_z ? above : S(0);
    }
  }

 private:
  static constexpr S kRoundedUp = S(1.0001);

  [[nodiscard]] static auto lanes(const Lanes& x) noexcept {
    return Eigen::Map<const Eigen::Array<S, static_cast<int>(kLanes), 1>>(x.data());
  }

  S most_ = -1;  // the largest of `best` since `find`; negative: not known yet
};

}  // namespace detail

}  // namespace trephine
