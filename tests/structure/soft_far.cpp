// SPDX-License-Identifier: MIT
// Soft structures beyond their reach change no bit of a scene that cuts.
#include "stage/pushed_cut.hpp"
#include "structure/phantom.hpp"
#include "support/cases.hpp"
#include "support/poses.hpp"
#include "support/random.hpp"

#include <trephine/core/units.hpp>
#include <trephine/device/replay.hpp>
#include <trephine/stage/cutting_vibration.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

TEST_CASE("soft structures beyond their reach change no bit, on random cutting paths") {
  constexpr unsigned seed = 1961;
  CAPTURE(seed);
  Random random(seed);
  const NamedTool tool = tool_by_name("round-3");
  const std::vector<std::optional<Membrane>> soft{dura()};
  const double reach = SoftStructures::required_reach(tool.tool, soft);
  for (int n = 0; n < cases(6); ++n) {
    CAPTURE(n);
    const cutting::LayeredBone layers{.layers = {{1_mm, 1700}, {1_mm, 1200}}};
    const Vec3d top = layers.top();
    // A ball below, as near as its reach lets it; the burr's end goes 1 mm deep.
    const double radius = random.uniform(1.5_mm, 2.5_mm);
    const Vec3d middle(top.x(), top.y(), top.z() - 1.01_mm - reach - radius);
    const LabelledTubes below{
        .tubes = {{middle, middle, radius}}, .structure = {0}, .size = {40, 40, 50}, .voxel = 0.25_mm};
    const std::shared_ptr<const StructureField> field = below.field(reach);
    auto bone = layers.image(), same = layers.image();
    const CoupledToolRenderer renderer{tool.tool, CoupledOptions{}, Coulomb{0.2, 0.15}};
    const Cutting law{PressureCut{}, CuttingVibration{CuttingForce({.edges = tool.edges, .speed = rpm(10'000)}), {}}};
    HapticScene with{bone, cutting::LayeredBone::kIso, renderer, law,
                     SoftStructures{field, Posed::Identity(), tool.tool, soft}};
    HapticScene without{same, cutting::LayeredBone::kIso, renderer, law};
    std::array<Vec3d, 6> waves;  // of the way and of the axis, at three frequencies
    for (std::size_t i = 0; i < 6; ++i) waves[i] = random.arrow(0, i < 3 ? 0.8_mm : 0.1);
    int differ = 0, cuts = 0;
    double nearest = 1;
    for (int i = 0; i < 2000; ++i) {
      Vec3d p(top.x(), top.y(), top.z() + tool.tool.burr().tip_radius + 1_mm - 1e-6 * i), axis = Vec3d::UnitZ();
      for (std::size_t w = 0; w < 3; ++w) {
        const double s = std::sin(2e-3 * static_cast<double>(w + 1) * i);
        p += s * waves[w];
        axis += s * waves[w + 3];
      }
      p.z() = std::max(p.z(), top.z() + tool.tool.burr().tip_radius - 1_mm);
      const TickInput input{.X_WT = tool_at(p, axis), .spindle_on = i % 700 < 600};
      const TickResult a = with.tick(input, 2.5e-4), b = without.tick(input, 2.5e-4);
      differ += same_bits(a, b) ? 0 : 1;
      cuts += a.removed_mm3 > 0 ? 1 : 0;
      nearest = std::min(nearest, below.distance(0, p) - tool.tool.burr().tip_radius);
    }
    CHECK(differ == 0);
    CHECK(cuts > 100);
    CHECK(nearest >= reach);
    CHECK(nearest < 1.5 * reach);
  }
}
