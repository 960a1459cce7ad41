// SPDX-License-Identifier: MIT
#pragma once

#include "scene_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace live {

/// Bone dust that flies off the burr: as much as bone goes, for the eye alone. Window thread.
class Dust {
 public:
  static constexpr std::size_t kMax = 300;     ///< grains at once
  static constexpr double kGrainsPerMm3 = 60;  ///< thrown up
  static constexpr double kLife = 0.9;         ///< [s]

  /// `removed_mm3`: since the last call, at the burr.
  void advance(double dt, double removed_mm3, const Posed& tool_W, double tip_radius) {
    for (Grain& g : grains_) {
      g.age += dt;
      g.velocity += dt * (Vec3d(0, 0, -1.5) - 6 * g.velocity);
      g.p_W += dt * g.velocity;
    }
    std::erase_if(grains_, [](const Grain& g) { return g.age > kLife; });
    owed_ = std::min(owed_ + kGrainsPerMm3 * std::max(removed_mm3, 0.0), 40.0);
    while (owed_ >= 1 && grains_.size() < kMax) {
      owed_ -= 1;
      const Vec3d out = Vec3d(next(), next(), 0.3 + std::abs(next())).normalized();
      grains_.push_back({tool_W * Vec3d(0.9 * tip_radius * out), tool_W.linear() * out * (0.10 + 0.08 * next()), 0,
                         60e-6 + 40e-6 * next()});
    }
  }
  [[nodiscard]] bool empty() const { return grains_.empty(); }
  void add_to(std::vector<Mark>& sprites) const {
    for (const Grain& g : grains_)
      sprites.push_back({g.p_W, {0.93F, 0.87F, 0.76F, static_cast<float>(0.8 * (1 - g.age / kLife))}, g.radius});
  }

 private:
  struct Grain {
    Vec3d p_W, velocity;
    double age, radius;
  };
  /// -1..1; a linear congruential generator, so that pictures repeat.
  double next() {
    state_ = state_ * 1664525U + 1013904223U;
    return static_cast<double>(state_) / 2147483648.0 - 1;
  }

  std::vector<Grain> grains_;
  double owed_ = 0;
  std::uint32_t state_ = 1;
};

}  // namespace live
