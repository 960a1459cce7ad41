// SPDX-License-Identifier: MIT
// The whole chain for ten seconds: stand-in, adapter, servo loop, a scene that drills a block, a hand that presses.
#include "openhaptics/fixture.hpp"

#include <trephine/device/servo_loop.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <sstream>

TEST_CASE("OpenHaptics servo: ten seconds of drilling against the stand-in") {
  using namespace trephine;
  using namespace std::chrono_literals;
  // A block 24 mm a side, its top at z = 0 in W.
  constexpr int n = 64;
  std::vector<std::int16_t> voxels(static_cast<std::size_t>(n * n * n), 0);
  for (int k = 2; k < 50; ++k)
    for (int j = 8; j < 56; ++j)
      for (int i = 8; i < 56; ++i) voxels[static_cast<std::size_t>((k * n + j) * n + i)] = 200;
  const double h = 0.5e-3;
  const Posed X_WG(Eigen::Translation3d(-31.5 * h, -31.5 * h, -49.5 * h));
  VoxelGrid<std::int16_t> bone{{.size = {n, n, n}, .spacing = {h, h, h}, .X_WG = X_WG}, voxels};
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.04};
  const ToolDiscretization tool{burr, SurfaceCounts::thesis()};

  // D is W turned so that its y is up.
  Mat3d R_WD;
  R_WD << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  const Registration registration(make_pose<double>(R_WD, Vec3d::Zero()));
  // Down to 3 mm below the surface and up again, twice a run; the spindle turns for the second half.
  const auto hand = [&registration](double time) {
    const double z = 0.0025 - 0.0055 * 0.5 * (1 - std::cos(2 * 3.14159265358979 * time / 5));
    return HandTarget(registration.handle_pose(Posed(Eigen::Translation3d(0, 0, z))), time > 5 ? 1U : 0U);
  };
  hd_standin::Model model{.hand = hand};
  model.mechanics.X_DH = hand(0).X_DH;
  hd_standin::plug({model});

  openhaptics::Device device;
  HapticScene scene{bone,
                    100,
                    SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = 500}},
                    Cutting{RateLimitedCut<>{.rate = 400}},
                    Damping{{.linear = 1, .angular = 1e-4}},
                    DeviceLimits{.force = 3.3, .torque = 0.1}};
  ServoLoop loop(device, scene, registration);
  double removed = 0, removed_with_spindle_off = 0;
  const RunReport report = loop.run_for(10s, [&](const TickRecord& t) {
    removed += t.result.removed_mm3;
    if (!t.input.spindle_on) removed_with_spindle_off += t.result.removed_mm3;
  });
  std::ostringstream text;
  text << report;
  MESSAGE(text.str());
  CHECK(report.end == RunEnd::kFinished);
  CHECK(report.zeroed);
  CHECK(report.wall_time >= 9.9);
  CHECK(report.ticks + report.missed_deadlines >= 9500);
  // 1 kHz is the driver's to keep; on a machine that is busy with other things half of it must do.
  CHECK(report.ticks >= 5000);
  CHECK(report.safety_trips == 0);
  CHECK(removed_with_spindle_off == 0);
  CHECK(removed > 1);
  const hd_standin::Witness witness = hd_standin::witness("Default Device");
  CHECK(witness.frames >= report.ticks + 1);
  CHECK(witness.most_force > 0.3);
  CHECK(witness.most_force <= 3.3 * (1 + 1e-9));
  CHECK(witness.felt == Wrenchd::zero());
  CHECK(hd_standin::errors().empty());
}
