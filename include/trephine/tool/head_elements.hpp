// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace trephine {

/// A burr's ball, below the shaft, as a head.
[[nodiscard]] inline CuttingHead head_of(const Burr& burr) {
  const double R = burr.tip_radius;
  ToolOutline ball(0, -R);
  const double top = burr.has_shaft() ? burr.shaft_emerges() : R;
  ball.arc_to(std::sqrt(std::max(0.0, R * R - top * top)), top, 0, 0);
  return {ball.close(), 0};
}
[[nodiscard]] inline const CuttingHead& head_of(const CuttingHead& head) { return head; }

/// Quadrature of a cutting head's surface: places in T with normals, areas, and areas divided by the distance from the
/// axis. The outline is divided into bands of kAround elements, evenly about the axis, so that directions about it
/// cancel. The places turn from band to band by the golden angle, so they cover the surface evenly.
struct HeadElements {
  static constexpr std::size_t kAround = 4, kBands = 24;
  static constexpr std::size_t kCount = kAround * kBands;
  using Numbers = std::array<float, kCount>;

  Numbers x{}, y{}, z{};                       ///< [m]
  Numbers normal_x{}, normal_y{}, normal_z{};  ///< out of the head
  Numbers around_x{}, around_y{};              ///< unit, about +z
  Numbers area{};                              ///< A [m²]
  Numbers length{};                            ///< ∫ dA / ρ, 2π times the outline's length [m]

  HeadElements() = default;
  explicit HeadElements(const CuttingHead& cutting) {
    const ToolOutline& head = cutting.outline;
    const double out = cutting.allowance;
    // Bands with equal sums of relative area and relative length: both integrals need places.
    const double total = head.side_length(), step = total / kSteps;
    std::array<double, kSteps + 1> areas{}, shares{};
    for (std::size_t i = 0; i < kSteps; ++i)
      areas[i + 1] =
          areas[i] + 2 * std::numbers::pi * step * enlarged(head, (static_cast<double>(i) + 0.5) * step, out).rho;
    for (std::size_t i = 0; i <= kSteps; ++i)
      shares[i] = areas[i] / areas[kSteps] / 2 + static_cast<double>(i) / kSteps / 2;
    const auto step_at = [&](double share) {
      const auto above = std::upper_bound(shares.begin(), shares.end() - 1, share);
      const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(0, above - shares.begin() - 1));
      return static_cast<double>(i) + (share - shares[i]) / (shares[i + 1] - shares[i]);
    };
    const auto area_to = [&](double at) {
      const auto i = std::min(static_cast<std::size_t>(at), kSteps - 1);
      return areas[i] + (at - static_cast<double>(i)) * (areas[i + 1] - areas[i]);
    };
    for (std::size_t n = 0; n < kCount; ++n) {
      const std::size_t band = n / kAround;
      const double from = step_at(static_cast<double>(band) / kBands);
      const double to = step_at(static_cast<double>(band + 1) / kBands);
      const ToolOutline::Place at = enlarged(head, (from + to) / 2 * step, out);
      const double angle =
          static_cast<double>(band) * kGoldenAngle + 2 * std::numbers::pi * static_cast<double>(n % kAround) / kAround;
      const double c = std::cos(angle), s = std::sin(angle);
      x[n] = static_cast<float>(at.rho * c);
      y[n] = static_cast<float>(at.rho * s);
      z[n] = static_cast<float>(at.z);
      normal_x[n] = static_cast<float>(at.normal_rho * c);
      normal_y[n] = static_cast<float>(at.normal_rho * s);
      normal_z[n] = static_cast<float>(at.normal_z);
      around_x[n] = static_cast<float>(-s);
      around_y[n] = static_cast<float>(c);
      area[n] = static_cast<float>((area_to(to) - area_to(from)) / kAround);
      length[n] = static_cast<float>(2 * std::numbers::pi * (to - from) * step / kAround);
    }
  }

 private:
  [[nodiscard]] static ToolOutline::Place enlarged(const ToolOutline& head, double length, double out) noexcept {
    ToolOutline::Place at = head.place_at(length);
    at.rho = std::max(0.0, at.rho + out * at.normal_rho);
    at.z += out * at.normal_z;
    return at;
  }
  static constexpr std::size_t kSteps = 1024;
  static constexpr double kGoldenAngle = 2.399963229728653;  // π (3 − √5)
};

}  // namespace trephine
