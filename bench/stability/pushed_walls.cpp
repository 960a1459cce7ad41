// SPDX-License-Identifier: MIT
// Scenario 17: a plate of few voxels, pushed until the hand gives all that the device bears. Who falls through?
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"
#include "stability/places.hpp"

#include <cmath>
#include <sstream>

namespace trephine::bench {
namespace {

constexpr double kMaxForce = 3.3;  // [N]

struct Push {
  bool through = false;
  double held = 0;  ///< greatest force before it fell through, or at all [N]
};

/// The device is driven along its path whatever the wall does, as a hand much stronger than the device would: down at
/// `speed` until the scene's force reaches the device's most.
Push push(const Setup& setup, Bone& bone, double thickness, double speed) {
  auto tool = make_tool(setup, bone, kPlaceIsovalue);
  const double radius = setup.renderer == "line" ? 0 : setup.burr.tip_radius;
  const double top = 0.5 * thickness + radius;
  Push p;
  double z = top + std::max(1e-3, 1.37 * speed * 1e-3);
  const double floor = -0.5 * thickness - radius - 1.5e-3;
  int gone = 0;
  for (int i = 0; i < 20000; ++i) {
    const Wrenchd w = tool->tick({tool_pose(Vec3d(0.1e-3, 0.05e-3, z), Vec3d::UnitZ()), false}, 1e-3).wrench;
    p.held = std::max(p.held, w.force.z());
    if (w.force.z() >= kMaxForce) return p;
    // Below the wall and pushed on, or not held at all any more.
    gone = z < floor && !(w.force.z() > 0) ? gone + 1 : 0;
    if (w.force.z() < -0.02 || gone > 3) {
      p.through = true;
      return p;
    }
    z -= speed * 1e-3;
    if (z < -8e-3) return p;
  }
  return p;
}

}  // namespace

void plan_thin_walls(const StabilityOptions& options, Plan& plan) {
  const std::vector<Setup> tools = usual_setups({{.renderer = "surface", .options = "thesis' counts"}});
  const std::vector<double> speeds = options.quick ? std::vector{0.01, 1.0} : std::vector{0.01, 0.03, 0.1, 0.3, 1.0};
  for (int voxels = 1; voxels <= 4; ++voxels) {
    const double thickness = voxels * kPlaceVoxel;
    const auto bone = make_bone([=](const Vec3d& p) { return std::abs(p.z() - 0.03e-3) - 0.5 * thickness; });
    for (const Setup& tool : tools)
      for (const double stiffness : {800.0, 3000.0})
        plan.push_back({tool.renderer + ", thin walls", [=] {
                          Measured m;
                          Setup s = tool;
                          s.stiffness = stiffness;
                          for (const double speed : speeds) {
                            const Push p = push(s, *bone, thickness, speed);
                            std::ostringstream name;
                            name << voxels << " voxels, " << speed << " m/s, " << stiffness << " N/m";
                            m.judge("17 falls through a thin wall (1: yes)", name.str(), s, p.through, 0, "", p.held);
                          }
                          return m;
                        }});
  }
}

}  // namespace trephine::bench
