// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/number.hpp>
#include <trephine/tool/cutting_edges.hpp>
#include <trephine/tool/shapes/barrel.hpp>
#include <trephine/tool/shapes/cylinder.hpp>
#include <trephine/tool/shapes/disc.hpp>
#include <trephine/tool/shapes/match_head.hpp>
#include <trephine/tool/shapes/pear.hpp>
#include <trephine/tool/shapes/reamer.hpp>
#include <trephine/tool/shapes/round.hpp>
#include <trephine/tool/shapes/taper.hpp>
#include <trephine/tool/shapes/twist_drill.hpp>

#include <array>
#include <optional>
#include <string>
#include <string_view>

/// Tools by the names and diameters that catalogues use.
namespace trephine::inline TREPHINE_ALIGNED {

/// A tool with its edges.
struct NamedTool {
  using Tool = RevolvedTool;  ///< that a renderer takes

  RevolvedTool tool;
  CuttingEdges edges;

  /// So that a renderer takes it.
  operator const RevolvedTool&() const noexcept { return tool; }  // NOLINT(google-explicit-constructor)
};

/// A family of tools: the name and the range of diameters [mm].
struct ToolFamily {
  std::string_view name;
  double least, most;
  int flutes;  ///< 0: diamond
};

/// The families. Round, diamond and match-head burrs are those of ear and skull base surgery, pear, cylinder and taper
/// those of dentistry (ISO 6360), twist drills those of bone screws (1.5 to 4.5 mm). Heads other than the diameter are
/// in the proportion of common ones; for others write the shape's measures.
inline constexpr std::array<ToolFamily, 10> kToolFamilies{{{"round", 0.6, 7, 8},
                                                           {"diamond", 0.6, 7, 0},
                                                           {"match-head", 1.5, 5, 8},
                                                           {"pear", 0.8, 4, 8},
                                                           {"cylinder", 0.8, 4, 6},
                                                           {"taper", 0.9, 4, 6},
                                                           {"barrel", 3, 8, 8},
                                                           {"disc", 3, 20, 24},
                                                           {"twist", 1, 6, 2},
                                                           {"reamer", 4, 14, 6}}};

namespace detail {

[[nodiscard]] inline RevolvedTool tool_of(std::string_view family, double radius) {
  // A head that is no thicker than the shank stands on a neck.
  Shank shank;
  if (radius < 1.5 * shank.radius) {
    shank.neck_radius = 0.6 * radius;
    shank.neck_length = 4 * radius;
  }
  if (family == "match-head") return MatchHead{.radius = radius, .length = 2.5 * radius, .shank = shank};
  if (family == "pear")
    return PearBurr{.radius = radius, .length = 3.4 * radius, .top_radius = 0.65 * radius, .shank = shank};
  if (family == "cylinder")
    return CylinderBurr{.radius = radius, .length = 5.5 * radius, .rim_radius = radius / 4, .shank = shank};
  if (family == "taper")
    return TaperBurr{.radius = radius, .end_radius = radius / 2, .length = 7 * radius, .shank = shank};
  if (family == "barrel")
    return BarrelBurr{
        .radius = radius, .end_radius = 0.7 * radius, .length = 2.5 * radius, .rim_radius = radius / 5, .shank = shank};
  if (family == "disc") return DiscBurr{.radius = radius, .thickness = radius / 5, .shank = shank};
  if (family == "twist")
    return TwistDrill{.radius = radius, .tip_radius = radius / 5, .rim_radius = radius / 5, .margin = radius / 8};
  if (family == "reamer")
    return Reamer{.radius = radius,
                  .front_radius = 0.85 * radius,
                  .chamfer = 0.35 * radius,
                  .length = 5 * radius,
                  .rim_radius = radius / 10,
                  .shank = {.radius = 0.75 * radius, .length = 0.120}};
  return RoundBurr{.radius = radius, .shank = shank};
}

}  // namespace detail

/// Returns the tool with a name such as "round-3", "match-head-3" or "twist-2.5": a family and a diameter in
/// millimetres. Throws std::invalid_argument, with all families and their diameters, for another name.
[[nodiscard]] inline NamedTool tool_by_name(std::string_view name) {
  for (const ToolFamily& family : kToolFamilies) {
    if (!name.starts_with(family.name) || name.size() < family.name.size() + 2 || name[family.name.size()] != '-')
      continue;
    const std::string_view number = name.substr(family.name.size() + 1);
    const std::optional<double> diameter = parse_number(number);
    if (!diameter || !(*diameter >= family.least && *diameter <= family.most)) continue;
    return {detail::tool_of(family.name, *diameter / 2000),
            {family.flutes > 0 ? CuttingEdges::Kind::kFluted : CuttingEdges::Kind::kDiamond, family.flutes,
             family.name == "twist"}};
  }
  std::string rule = "the name must be a family and a diameter in mm, as round-3:";
  for (const ToolFamily& family : kToolFamilies) {
    rule += (&family == kToolFamilies.data() ? " " : ", ") + std::string(family.name) + "-" +
            number_text(family.least) + " to " + number_text(family.most);
  }
  refuse("tool_by_name", rule, name);
}

}  // namespace trephine
