// SPDX-License-Identifier: MIT
// Compiled with -ffast-math, where compilers take every number for finite.
#include "support/near.hpp"

#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <doctest/doctest.h>

#include <bit>
#include <cstdint>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

// Not from the compiler, which may fold what it computes of constants.
double not_a_number() {
  volatile std::uint64_t bits = 0x7ff8'0000'0000'0000;
  return std::bit_cast<double>(static_cast<std::uint64_t>(bits));
}
double infinite() {
  volatile std::uint64_t bits = 0x7ff0'0000'0000'0000;
  return std::bit_cast<double>(static_cast<std::uint64_t>(bits));
}

bool is_zero(const Wrenchd& w) {
  for (int i = 0; i < 3; ++i)
    if (std::bit_cast<std::uint64_t>(w.force[i]) != 0 || std::bit_cast<std::uint64_t>(w.torque[i]) != 0) return false;
  return true;
}

constexpr double kTop = 5.5e-3 + 5e-4 * 900 / 2200;  // where the densities cross the isovalue [m]

// `reach`: of what touches below the tool's origin.
Posed at_depth(double depth, double reach) {
  Posed X = Posed::Identity();
  X.translation() = Vec3d(8e-3, 8e-3, kTop + reach - depth);
  return X;
}

template <class Renderer, class... Parts>
void bad_input_gives_zero(double reach, const Renderer& renderer, const Parts&... parts) {
  std::vector<std::int16_t> hounsfield(32 * 32 * 12, 1200);
  hounsfield.resize(32 * 32 * 24, -1000);
  VoxelGrid<std::int16_t> bone({.size = {32, 32, 24}, .spacing = {5e-4, 5e-4, 5e-4}}, hounsfield);
  HapticScene scene{bone, 300, renderer, parts..., DeviceLimits{.force = 3.3, .torque = 0.1}};
  double depth = -1e-4;
  const auto press = [&] {
    TickResult r;
    for (int i = 0; i < 200; ++i) {
      depth = depth < 2.5e-4 ? depth + 4e-6 : depth;
      r = scene.tick({.X_WT = at_depth(depth, reach)}, 1e-3);
      REQUIRE(is_finite(r.wrench));
    }
    return r;
  };
  const TickResult before = press();
  CHECK(before.wrench.force.z() > 0.05);
  CHECK(before.wrench.force.z() <= 3.3 * (1 + 1e-9));
  for (const double bad : {not_a_number(), infinite(), -infinite()})
    for (int entry = 0; entry < 12; ++entry) {
      CAPTURE(entry);
      Posed X = at_depth(depth, reach);
      X.matrix()(entry % 3, entry / 3) = bad;
      const TickResult r = scene.tick({.X_WT = X, .spindle_on = true}, 1e-3);
      CHECK(r.status == Status::kBadInput);
      CHECK(is_zero(r.wrench));
      CHECK(r.removed_mm3 == 0);
    }
  // A dt of no length is one of the shortest.
  const TickResult late = scene.tick({.X_WT = at_depth(depth, reach)}, not_a_number());
  CHECK(is_finite(late.wrench));
  const TickResult after = press();
  CHECK(after.status == Status::kOk);
  CHECK(after.wrench.force.z() == near(before.wrench.force.z(), 0.02));
}

const Burr kBurr{.tip_radius = 1.5e-3, .shaft_radius = 8e-4, .shaft_length = 40e-3};

TEST_CASE("under -ffast-math a pose that is not finite gives zero and its status: coupled tool") {
  bad_input_gives_zero(1.5e-3,
                       CoupledToolRenderer{kBurr, CoupledOptions{.stiffness = 800, .force = 3.3, .torque = 0.1}},
                       Cutting{}, Damping{{.linear = 0.5}});
}

TEST_CASE("under -ffast-math a pose that is not finite gives zero and its status: Line") {
  bad_input_gives_zero(0, LineApproxRenderer{ToolDiscretization{kBurr, LineCounts{}}, LineOptions{.stiffness = 800}});
}

TEST_CASE("under -ffast-math a pose that is not finite gives zero and its status: Surface") {
  bad_input_gives_zero(
      1.5e-3, SurfaceApproxRenderer{ToolDiscretization{kBurr, SurfaceCounts{}}, SurfaceOptions{.stiffness = 800}});
}

TEST_CASE("under -ffast-math finiteness is told by bits") {
  CHECK(is_finite(1.0));
  CHECK(is_finite(1e308));
  CHECK(is_finite(0.0F));
  CHECK(!is_finite(not_a_number()));
  CHECK(!is_finite(infinite()));
  CHECK(!is_finite(static_cast<float>(infinite())));
  CHECK(is_nan(not_a_number()));
  CHECK(!is_nan(infinite()));
  CHECK(!is_nan(-1.0));
}

}  // namespace
