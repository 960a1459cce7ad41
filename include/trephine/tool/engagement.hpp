// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/tool/cutting_law.hpp>
#include <trephine/tool/head_elements.hpp>

#include <array>
#include <cstddef>
#include <numeric>

namespace trephine::inline TREPHINE_ALIGNED {

/// Sums over a head's elements. `engaged` is each element's share that cuts, 0 to 1, and `strength` the bone's there.
/// `feed` is a unit vector in T.
[[nodiscard]] inline Engagement engagement_of(const HeadElements& head, const Vec3d& feed,
                                              const HeadElements::Numbers& engaged,
                                              const HeadElements::Numbers& strength) noexcept {
  const Vec3<float> d = feed.cast<float>();
  constexpr std::size_t kLanes = 8;
  static_assert(HeadElements::kCount % kLanes == 0);
  using Lanes = std::array<float, kLanes>;
  Lanes area{}, hard_area{}, facing_area{}, pressed{}, edge{}, around_x{}, around_y{}, moment_x{}, moment_y{}, tip{};
  for (std::size_t first = 0; first < HeadElements::kCount; first += kLanes)
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::size_t i = first + l;
      const float facing = d.x() * head.normal_x[i] + d.y() * head.normal_y[i] + d.z() * head.normal_z[i];
      const float e = facing > 0 ? engaged[i] : 0.0F;
      const float cut = e * facing, hard = cut * strength[i], length = hard * head.length[i];
      const float tx = length * head.around_x[i], ty = length * head.around_y[i];
      area[l] += cut * head.area[i];
      hard_area[l] += hard * head.area[i];
      facing_area[l] += e * head.area[i];
      pressed[l] += length * facing;
      edge[l] += length;
      around_x[l] += tx;
      around_y[l] += ty;
      moment_x[l] -= head.z[i] * ty;
      moment_y[l] += head.z[i] * tx;
      tip[l] += i < HeadElements::kAround ? hard : 0.0F;
    }
  const auto total = [](const Lanes& lanes) { return std::accumulate(lanes.begin(), lanes.end(), 0.0); };
  Engagement sum;
  sum.area = total(area);
  sum.hard_area = total(hard_area);
  sum.facing_area = total(facing_area);
  sum.pressed = total(pressed);
  sum.edge = total(edge);
  sum.tip = total(tip) / HeadElements::kAround;
  sum.around = {total(around_x), total(around_y), 0};
  // (r × t)_z = ρ, and A/ρ times ρ is A.
  sum.moment = {total(moment_x), total(moment_y), sum.hard_area};
  return sum;
}

}  // namespace trephine
