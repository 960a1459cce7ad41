// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>

/// Burr that holds a tool: for code that takes a ball and a shaft and must not miss a part of the tool.
namespace trephine::inline TREPHINE_ALIGNED {

namespace detail {

/// Largest ρ of a piece's points above T's origin that a ball about it with the radius `tip` does not hold [m].
[[nodiscard]] inline double radius_outside(const ToolOutline::Piece& p, double tip) noexcept {
  constexpr double kRounding = 1e-9;
  const auto is_outside = [&](double rho, double z) { return std::hypot(rho, z) > tip * (1 + kRounding); };
  if (!(p.end_z > 0)) return 0;
  if (!(p.end_z > p.z)) {
    const double rho = std::max(p.rho, p.end_rho);
    return is_outside(rho, p.z) ? rho : 0;
  }
  // Heights between which the piece stays in or out of the ball, and its radius has no maximum.
  std::array<double, 5> z;
  z.fill(p.end_z);
  z[0] = std::max(p.z, 0.0);
  std::size_t count = 1;
  const auto add_pair = [&](double middle, double apart) {
    for (const double at : {middle - apart, middle + apart})
      if (at > z[0] && at < p.end_z) z[count++] = at;
  };
  if (p.side == 0) {
    const double towards = p.rho * p.along_rho + p.z * p.along_z;
    const double square = towards * towards - p.rho * p.rho - p.z * p.z + tip * tip;
    if (square > 0) add_pair(p.z - towards * p.along_z, std::sqrt(square) * p.along_z);
  } else {
    if (p.centre_z > z[0] && p.centre_z < p.end_z) z[count++] = p.centre_z;
    const double away = std::hypot(p.centre_rho, p.centre_z);
    const double along = away > 0 ? (tip * tip - p.radius * p.radius + away * away) / (2 * away) : tip;
    const double square = tip * tip - along * along;
    if (square > 0) add_pair(along * p.centre_z / away, std::sqrt(square) * std::abs(p.centre_rho) / away);
  }
  std::sort(z.begin(), z.end());
  double most = 0;
  for (std::size_t i = 1; i < z.size(); ++i) {
    const double middle = (z[i - 1] + z[i]) / 2;
    if (is_outside(p.radius_at(middle), middle)) most = std::max({most, p.radius_at(z[i - 1]), p.radius_at(z[i])});
  }
  return most;
}

}  // namespace detail

/// Returns the burr that holds a tool: the smallest ball about T's origin that holds what is not above it, and the
/// thinnest shaft that holds the rest.
[[nodiscard]] inline Burr holding_burr(const RevolvedTool& tool) noexcept {
  const ToolOutline& outline = tool.outline();
  Burr burr{.tip_radius = outline.largest_distance(outline.z_low(), 0, 0), .shaft_radius = 0, .shaft_length = 0};
  for (const ToolOutline::Piece& p : outline.pieces())
    burr.shaft_radius = std::max(burr.shaft_radius, detail::radius_outside(p, burr.tip_radius));
  constexpr double kLonger = 1 + 1e-9;  // a shaft ends outside its ball
  if (burr.shaft_radius > 0) burr.shaft_length = std::max(outline.z_high(), burr.tip_radius * kLonger);
  return burr;
}

/// A burr holds itself.
[[nodiscard]] inline Burr holding_burr(const Burr& burr) noexcept { return burr; }

}  // namespace trephine
