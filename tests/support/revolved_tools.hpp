// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/shapes/barrel.hpp>
#include <trephine/tool/shapes/cylinder.hpp>
#include <trephine/tool/shapes/disc.hpp>
#include <trephine/tool/shapes/match_head.hpp>
#include <trephine/tool/shapes/pear.hpp>
#include <trephine/tool/shapes/reamer.hpp>
#include <trephine/tool/shapes/taper.hpp>
#include <trephine/tool/shapes/twist_drill.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace trephine::test {

struct ToolOfShape {
  std::string name;
  RevolvedTool tool;
};

/// A tool of each shape, with heads of 3 to 6 mm.
[[nodiscard]] inline std::vector<ToolOfShape> revolved_tools() {
  return {{"match head", MatchHead{}},
          {"pear", PearBurr{.radius = 0.0015, .top_radius = 0.0008}},
          {"cylinder", CylinderBurr{.radius = 0.0015, .rim_radius = 0.0004}},
          {"taper", TaperBurr{.radius = 0.0015, .end_radius = 0.0008}},
          {"barrel", BarrelBurr{}},
          {"disc", DiscBurr{.radius = 0.003, .thickness = 0.0015}},
          {"twist drill", TwistDrill{}},
          {"reamer", Reamer{.radius = 0.003, .front_radius = 0.0024, .chamfer = 0.001, .length = 0.007}}};
}

/// Lowest height along `up` of a tool whose axis has the direction `axis` [m].
[[nodiscard]] inline double lowest_height(const RevolvedTool& tool, const Vec3d& axis, const Vec3d& up) {
  const ToolBounds b = tool.bounds();
  const double c = axis.dot(up), s = std::sqrt(std::max(0.0, 1 - c * c));
  double low = 0;
  for (int i = 0; i <= 20000; ++i) {
    const double z = b.z_low + (b.z_high - b.z_low) * i / 20000;
    low = std::min(low, z * c - tool.outline().radius_at(z) * s);
  }
  return low;
}

}  // namespace trephine::test
