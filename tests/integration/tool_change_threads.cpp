// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include <trephine/everything.hpp>
#include <trephine/tool/named_tools.hpp>

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>
#include <thread>
#include <vector>

using namespace trephine;

TEST_CASE("tool change: another thread posts tools while the haptic thread drills") {
  constexpr int kSide = 32;
  constexpr double kVoxel = 0.5e-3;
  std::vector<std::int16_t> voxels(std::size_t{kSide} * kSide * kSide / 2, 1200);
  voxels.resize(std::size_t{kSide} * kSide * kSide, -1000);
  VoxelGrid<std::int16_t> bone({.size = {kSide, kSide, kSide}, .spacing = Vec3d::Constant(kVoxel)}, voxels);
  Mailbox<std::optional<RevolvedTool>> tools;
  HapticScene scene{bone, 300.0, Remote{CoupledToolRenderer{MatchHead{}}, tools}, Cutting{}};
  const std::array<const char*, 4> names{"pear-2.3", "disc-6", "match-head-3", "twist-3.2"};
  std::atomic<bool> done{false};
  std::thread window([&] {
    for (int i = 0; !done.load(std::memory_order_acquire); ++i) {
      tools.post(tool_by_name(names[static_cast<std::size_t>(i) % names.size()]).tool);
      std::this_thread::yield();
    }
  });
  double removed = 0;
  int changes = 0, ramps = 0;
  double radius = scene.renderer().tool().bounds().radius;
  for (int tick = 0; tick < 400 || (changes < 20 && tick < 100000); ++tick) {
    TickInput input{.X_WT = Posed::Identity(), .spindle_on = true};
    input.X_WT.translation() = Vec3d(8e-3, 8e-3, 11e-3 - 5e-6 * std::min(tick, 800));
    const TickResult r = scene.tick(input, 1e-3);
    removed += r.removed_mm3;
    ramps += needs_ramp(r.status) ? 1 : 0;
    // A tool comes whole: the outline ends where its bounds do.
    const RevolvedTool& tool = scene.renderer().tool();
    CHECK(tool.outline().largest_radius() == tool.bounds().radius);
    changes += tool.bounds().radius != radius ? 1 : 0;
    radius = tool.bounds().radius;
  }
  done.store(true, std::memory_order_release);
  window.join();
  CHECK(changes >= 20);
  CHECK(ramps > 0);
  CHECK(removed > 1);
}
