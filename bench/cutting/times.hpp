// SPDX-License-Identifier: MIT
#pragma once

#include "common/paired_ticks.hpp"
#include "common/percentile.hpp"
#include "structure/label_shapes.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/everything.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

/// What the cutting law and soft structures add to a tick.
namespace trephine::bench {

/// Times of a scene's ticks beside those of the same scene without a part [µs].
struct TickTimes {
  double without = 0, without_p99 = 0;  ///< median and tail
  double more = 0;                      ///< median of differences
  double with_p99 = 0;
};

/// Ticks both scenes along a path, after an approach that is not kept.
template <class With, class Without, class Path>
[[nodiscard]] TickTimes compare_ticks(With& with, Without& without, const Path& path, int ticks) {
  constexpr int kApproach = 400;
  PairedTicks times;
  for (int i = 0; i < ticks + kApproach; ++i)
    times.tick(with, without, {.X_WT = test::tool_at(path(i), Vec3d::UnitZ()), .spindle_on = true}, i >= kApproach);
  return {percentile(times.without, 0.5), percentile(times.without, 0.99), percentile(times.more, 0.5),
          percentile(times.with, 0.99)};
}

/// Bone of strength 1 in a cube of 14 mm.
inline const test::RasterOptions kImage{
    .size = {46, 46, 46}, .spacing = Vec3d::Constant(0.3e-3), .blur = 0.7, .contrast = 2700, .air = -1000};

/// The law with the same cut as without it, in a slot that grows deeper.
[[nodiscard]] inline TickTimes time_of_law(const NamedTool& tool, int ticks) {
  constexpr double kTop = 10e-3, kIso = 350;
  const auto block = [&] {
    return test::rasterise<std::int16_t>(test::HalfSpace{Vec3d(0, 0, kTop), Vec3d::UnitZ()}, kImage);
  };
  auto bone = block(), same = block();
  const CoupledToolRenderer renderer{tool.tool, CoupledOptions{.stiffness = 800}};
  HapticScene plain{same, kIso, renderer, Cutting{}};
  HapticScene lawful{bone, kIso, renderer, Cutting{GeometricCut{}, CuttingForce({.edges = tool.edges})}};
  const auto path = [&](int i) {
    return Vec3d(7e-3 + 3e-3 * std::sin(i * 1e-3), 7e-3, kTop + tool.tool.burr().tip_radius - i * 1e-6);
  };
  return compare_ticks(lawful, plain, path, ticks);
}

/// Dura below a plate of bone that is 1.5 mm thick.
struct OverDura {
  double hole = 0;  ///< radius of a hole in the bone [m]
  double over = 0;  ///< height of the burr's end over the bone's top, where it slides [m]
  static constexpr double kWide = 14e-3, kDura = 8.6e-3, kTop = 10.1e-3, kIso = 350;  // [m], [m], [m], [HU]

  [[nodiscard]] VoxelGrid<std::int16_t> bone() const {
    const auto shape = [this](const Vec3d& p) {
      const double out = std::max(kDura - p.z(), p.z() - kTop);
      return std::max(out, hole - std::hypot(p.x() - kWide / 2, p.y() - kWide / 2));
    };
    return test::rasterise<std::int16_t>(shape, kImage);
  }

  /// The law with a membrane on the dura, against the law alone.
  [[nodiscard]] TickTimes measure(int ticks) const {
    const NamedTool tool = tool_by_name("round-3");
    const std::vector<std::optional<Membrane>> soft{dura()};
    constexpr double h = 0.4e-3;
    test::Labels labels({35, 35, 25}, Vec3d::Constant(h));
    labels.fill([](const Vec3d& p) { return p.z() - kDura; }, 1);
    const std::shared_ptr<const StructureField> field =
        build_structure_field(labels.view(), {.reach = SoftStructures::required_reach(tool.tool, soft)});
    const CoupledToolRenderer renderer{tool.tool, CoupledOptions{.stiffness = 800}};
    const Cutting law{PressureCut{}, CuttingForce({.edges = tool.edges})};
    auto pressed = bone(), other = bone();
    HapticScene with{pressed, kIso, renderer, law, SoftStructures{field, Posed::Identity(), tool.tool, soft}};
    const auto path = [&](int i) {
      const double down = std::max(0.0, 2e-3 - 1e-5 * i);  // from above
      return Vec3d(kWide / 2 + 3e-3 * std::sin(1e-3 * i), kWide / 2 + 7.5e-7 * i - 1.5e-3,
                   kTop + tool.tool.burr().tip_radius + over + down);
    };
    HapticScene without{other, kIso, renderer, law};
    return compare_ticks(with, without, path, ticks);
  }
};

}  // namespace trephine::bench
