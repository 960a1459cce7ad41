// SPDX-License-Identifier: MIT
#pragma once

#include "contact_cases.hpp"

#include <trephine/tool/discretization.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace pick {

/// Where an algorithm feels: Line with the ball's centre and the shaft's centreline, Surface and Coupled with the skins
/// of both. The same hand pose is a different contact for each, so each is tried at contacts of its own.
enum class Algorithm { kLine, kSurface, kCoupled };
inline constexpr std::array kAlgorithms{Algorithm::kLine, Algorithm::kSurface, Algorithm::kCoupled};

[[nodiscard]] inline const char* name_of(Algorithm a) {
  return std::array{"line", "surface", "coupled"}[static_cast<std::size_t>(a)];
}

[[nodiscard]] inline const char* title_of(Algorithm a) {
  return std::array{"Line", "Surface", "Coupled"}[static_cast<std::size_t>(a)];
}

/// Points that stand closely over what an algorithm feels with: says whether it touches the bone.
class Feeler {
 public:
  /// Points lie about `spacing` [m] apart.
  Feeler(Algorithm algorithm, const trephine::Burr& burr, double spacing) : algorithm_(algorithm), burr_(burr) {
    const double length = burr.has_shaft() ? burr.shaft_length : 0;
    points_.push_back({0, 0, 0});
    if (algorithm == Algorithm::kLine) {
      if (length > 0) add_column(burr.tip_radius, length, 0, spacing);
    } else {
      const double R = burr.tip_radius;
      const double per_area = spacing * spacing;
      const int on_ball = std::clamp(static_cast<int>(4 * std::numbers::pi * R * R / per_area), 200, 4000);
      for (const auto& d : trephine::spread_over_sphere(on_ball).directions) points_.push_back(R * d);
      const double r = burr.shaft_radius;
      const int columns = std::clamp(static_cast<int>(2 * std::numbers::pi * r / spacing), 12, 64);
      for (int i = 0; i < columns && length > 0; ++i)
        add_column(burr.shaft_emerges(), length, 2 * std::numbers::pi * i / columns, spacing, r);
    }
    points_.pad();
    values_.resize(static_cast<std::size_t>(points_.size()));
  }

  [[nodiscard]] bool touches(const Field& field, const trephine::Posed& X_GT) {
    field.values(X_GT, points_.x.data(), points_.y.data(), points_.z.data(), values_.data(), points_.size());
    return *std::max_element(values_.begin(), values_.end()) >= 0;
  }

  [[nodiscard]] Algorithm algorithm() const noexcept { return algorithm_; }
  [[nodiscard]] const trephine::Burr& burr() const noexcept { return burr_; }
  /// From the ball's centre and from the shaft's axis to what feels [m].
  [[nodiscard]] double tip_reach() const noexcept { return algorithm_ == Algorithm::kLine ? 0 : burr_.tip_radius; }
  [[nodiscard]] double shaft_reach() const noexcept { return algorithm_ == Algorithm::kLine ? 0 : burr_.shaft_radius; }

 private:
  void add_column(double from, double to, double angle, double spacing, double radius = 0) {
    const int n = std::clamp(static_cast<int>(std::ceil((to - from) / spacing)), 1, 2000);
    for (int i = 0; i <= n; ++i)
      points_.push_back({radius * std::cos(angle), radius * std::sin(angle), from + (to - from) * i / n});
  }

  Algorithm algorithm_;
  trephine::Burr burr_;
  trephine::PointArrays<double> points_;
  std::vector<double> values_;
};

}  // namespace pick
