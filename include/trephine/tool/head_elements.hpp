// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_tool.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <span>

namespace trephine::inline TREPHINE_ALIGNED {

/// The outline of a head without its allowance. A burr's is its ball below the shaft.
[[nodiscard]] inline ToolOutline outline_of(const CuttingBall& head) {
  const double R = head.tip_radius - head.allowance;
  ToolOutline ball(0, -R);
  const double top = head.has_shaft() ? Burr{R, head.shaft_radius}.shaft_emerges() : R;
  ball.arc_to(std::sqrt(std::max(0.0, R * R - top * top)), top, 0, 0);
  return ball.close();
}
[[nodiscard]] inline ToolOutline outline_of(const Burr& burr) { return outline_of(CuttingBall{burr}); }
[[nodiscard]] inline const ToolOutline& outline_of(const CuttingHead& head) { return head.outline; }

/// Quadrature of a cutting head's surface: places in T with normals, areas, and areas divided by the distance from the
/// axis. Each piece of the outline is divided into bands of kAround elements, evenly about the axis, so that directions
/// about it cancel. From band to band the places turn by the golden section of the angle between them, so they cover
/// the surface evenly. A band of a straight piece has exact sums of normals by area; one of an arc that turns by φ
/// lacks φ²/24 of them.
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
  explicit HeadElements(const ToolOutline& head) {
    const std::span<const OutlinePiece> pieces = head.sides();
    const std::size_t count = pieces.size();
    // Bands have about equal sums of relative area, length and turn: all three integrals need places.
    double whole_area = 0, whole_length = 0, whole_turn = 0;
    for (std::size_t i = 0; i < count; ++i) {
      whole_area += pieces[i].area(0, pieces[i].length_along());
      whole_length += pieces[i].length_along();
      whole_turn += pieces[i].turn();
    }
    const auto share = [&](const OutlinePiece& p, double along) {
      const double turn = whole_turn > 0 ? p.turn() / whole_turn : 0.0;
      return p.area(0, along) / whole_area + along / whole_length + along / p.length_along() * turn;
    };
    Shares shares{};
    for (std::size_t i = 0; i < count; ++i) shares[i] = share(pieces[i], pieces[i].length_along());
    const auto bands = bands_of(shares, count);
    std::size_t band = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const OutlinePiece& p = pieces[i];
      double from = 0;
      for (std::size_t n = 1; n <= bands[i]; ++n) {
        const double end = shares[i] * static_cast<double>(n) / static_cast<double>(bands[i]);
        double low = from, to = p.length_along();
        for (int step = 0; n < bands[i] && step < kBisections; ++step) {
          const double middle = (low + to) / 2;
          (share(p, middle) < end ? low : to) = middle;
        }
        add(band++, p, from, to);
        from = to;
      }
    }
  }

 private:
  using Shares = std::array<double, ToolOutline::kMaxPieces>;

  /// Number of bands of each piece: one, and then one at a time for the piece whose bands are the largest.
  [[nodiscard]] static std::array<std::size_t, ToolOutline::kMaxPieces> bands_of(const Shares& shares,
                                                                                 std::size_t count) noexcept {
    static_assert(ToolOutline::kMaxPieces <= kBands);
    std::array<std::size_t, ToolOutline::kMaxPieces> bands{};
    for (std::size_t i = 0; i < count; ++i) bands[i] = 1;
    for (std::size_t n = count; n < kBands; ++n) {
      std::size_t most = 0;
      for (std::size_t i = 1; i < count; ++i)
        if (shares[i] * static_cast<double>(bands[most]) > shares[most] * static_cast<double>(bands[i])) most = i;
      ++bands[most];
    }
    return bands;
  }

  void add(std::size_t band, const OutlinePiece& p, double from, double to) noexcept {
    const OutlinePlace at = p.place_at((from + to) / 2);
    for (std::size_t i = 0; i < kAround; ++i) {
      const std::size_t n = band * kAround + i;
      const double angle =
          (static_cast<double>(band) / std::numbers::phi + static_cast<double>(i)) * 2 * std::numbers::pi / kAround;
      const double c = std::cos(angle), s = std::sin(angle);
      x[n] = static_cast<float>(at.rho * c);
      y[n] = static_cast<float>(at.rho * s);
      z[n] = static_cast<float>(at.z);
      normal_x[n] = static_cast<float>(at.normal_rho * c);
      normal_y[n] = static_cast<float>(at.normal_rho * s);
      normal_z[n] = static_cast<float>(at.normal_z);
      around_x[n] = static_cast<float>(-s);
      around_y[n] = static_cast<float>(c);
      area[n] = static_cast<float>(p.area(from, to) / kAround);
      length[n] = static_cast<float>(2 * std::numbers::pi * (to - from) / kAround);
    }
  }

  static constexpr int kBisections = 24;  // to a float's last digit
};

}  // namespace trephine
