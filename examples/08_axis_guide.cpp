// SPDX-License-Identifier: MIT
// Guides a pedicle drill along a planned axis, and stops it at a depth. The hand is 1 mm and 5 degrees off.
// See the guide pull sideways and turn, nothing along the axis until the depth, and then the stop.
#include <trephine/structures.hpp>
#include <trephine/tools.hpp>
#include <trephine/trephine.hpp>

#include <cstdint>
#include <cstdio>
#include <numbers>
#include <vector>

using namespace trephine;

int main() {
  std::vector<std::int16_t> hounsfield(64 * 64 * 40, 900);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 64, -1000);                   // air above
  VoxelGrid<std::int16_t> bone({.size = {64, 64, 64}, .spacing = {0.6_mm, 0.6_mm, 0.6_mm}}, hounsfield);

  const NamedTool drill = tool_by_name("twist-3.2");
  const Vec3d entry(19_mm, 19_mm, 24_mm);  // of the plan, in the bone's frame
  const AxisGuide axis({.point_G = entry, .axis_G = Vec3d::UnitZ(), .stiffness = 400, .torque = 0.03, .damping = 2});
  const DepthStop stop({.point_G = entry - Vec3d(0, 0, 15_mm), .axis_G = Vec3d::UnitZ(), .stiffness = 800});
  HapticScene scene{bone,
                    300,
                    CoupledToolRenderer{drill, CoupledOptions{.stiffness = 800}},
                    Cutting{},
                    axis,
                    stop,
                    DeviceLimits{.force = 8.5, .torque = 0.2}};

  Posed X_WT = Posed::Identity();
  X_WT.linear() = Eigen::AngleAxisd(5 * std::numbers::pi / 180, Vec3d::UnitY()).toRotationMatrix();
  for (int tick = 0; tick < 4500; ++tick) {
    X_WT.translation() = Vec3d(20_mm, 19_mm, 26_mm - 4e-6 * tick);  // 4 mm/s
    const TickResult r = scene.tick({.X_WT = X_WT, .spindle_on = true}, 1e-3);
    if (tick % 500 == 499)
      std::printf("%5.1f mm deep: %5.2f N sideways, %5.2f N along, %5.1f N mm of turn\n",
                  24 - 1e3 * X_WT.translation().z(), r.wrench.force.x(), r.wrench.force.z(), 1e3 * r.wrench.torque.y());
  }
}
