// SPDX-License-Identifier: MIT
#pragma once

#include "structure/label_shapes.hpp"
#include "support/poses.hpp"

#include <trephine/everything.hpp>
#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/soft_structures.hpp>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <stdexcept>
#include <vector>

/// Membranes that a tool presses until they rupture, in a whole scene.
namespace trephine::bench {

/// Where a membrane ruptured.
struct Ruptured {
  double depth = 0;   ///< of the dent [m]
  double force = 0;   ///< on the tool, the true one [N]
  double stress = 0;  ///< the largest in the membrane [Pa]
};

/// Presses a tool at 4 mm/s into a membrane that no bone covers, by half a device's usual force.
[[nodiscard]] inline Ruptured press_until_rupture(const RevolvedTool& tool, const Membrane& membrane) {
  constexpr double kPlane = 24.2e-3, kVoxel = 0.4e-3, kMiddle = 15e-3;
  const double R = tool.burr().tip_radius;
  const std::vector<std::optional<Membrane>> soft{membrane};
  test::Labels labels({75, 75, 70}, Vec3d::Constant(kVoxel));
  labels.fill([](const Vec3d& p) { return p.z() - kPlane; }, 1);
  const std::shared_ptr<const StructureField> field =
      build_structure_field(labels.view(), {.reach = SoftStructures::required_reach(tool, soft)});
  VoxelGrid<std::int16_t> air({.size = {40, 40, 40}, .spacing = Vec3d::Constant(0.75e-3)},
                              std::vector<std::int16_t>(40 * 40 * 40, -1000));
  // The coupling's largest force limits what is felt, not the true force.
  const double scale = std::min(1.0, 1 / membrane.law(R).rupture_force);
  HapticScene scene{air, 350, CoupledToolRenderer{tool, CoupledOptions{.stiffness = 2000}},
                    SoftStructures{field, Posed::Identity(), tool, soft, {.force_scale = scale}}};
  const auto& part = scene.template part<SoftStructures>();
  Ruptured out;
  for (int i = 0; part.tears().count(0) == 0; ++i) {
    if (i > 5000) throw std::runtime_error("the membrane does not rupture");
    static_cast<void>(
        scene.tick({.X_WT = test::tool_at(Vec3d(kMiddle, kMiddle, kPlane + R - 4e-6 * i), Vec3d::UnitZ())}, 1e-3));
    out.depth = std::max(out.depth, part.report().depth);
    out.force = std::max(out.force, part.report().force);
  }
  out.stress = std::sqrt(out.force * membrane.modulus / (4 * std::numbers::pi * R * membrane.thickness));
  return out;
}

}  // namespace trephine::bench
