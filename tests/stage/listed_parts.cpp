// SPDX-License-Identifier: MIT
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/contact/friction.hpp>
#include <trephine/guide/guides.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/passivity_controller.hpp>
#include <trephine/stage/wrench_rate_limit.hpp>

#include <doctest/doctest.h>

#include <bit>
#include <string>
#include <vector>

/// A part that does nothing by its numbers, beside the scene that does not list it: the same bits along a path in and
/// out of contact, for each renderer; and a scene is as large as its parts.
namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kListedBurr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.02};

using ListedGrid = VoxelGrid<std::uint8_t>;

/// Zeros of either sign are the same force.
bool same_bits(const Vec3d& a, const Vec3d& b) {
  for (int i = 0; i < 3; ++i)
    if (std::bit_cast<std::uint64_t>(a[i] + 0.0) != std::bit_cast<std::uint64_t>(b[i] + 0.0)) return false;
  return true;
}

struct Listed {
  const RasterOptions raster{.size = {60, 60, 60}};
  ListedGrid grid = rasterise<std::uint8_t>(Ball{raster.middle(), 4e-3}, raster);

  /// Over the ball, leaning; in and out of it every 80 ticks or so, tip and shaft.
  [[nodiscard]] Posed pose(int i, double reach) const {
    const double t = 1e-3 * i;
    const Vec3d axis(std::sin(9 * t), 0.4 * std::cos(7 * t), 1);
    const Vec3d p(2e-3 * std::sin(11 * t), 2e-3 * std::cos(5 * t), 4e-3 + reach + 6e-4 * std::sin(40 * t) - 2e-4);
    return tool_at(raster.middle() + p, axis, 3 * t);
  }

  template <class Bare, class With>
  void compare(const std::string& name, Bare bare, With with, double reach, bool spindle = false) {
    CAPTURE(name);
    int differ = 0, touching = 0;
    for (int i = 0; i < 1200; ++i) {
      const TickInput input{.X_WT = pose(i, reach), .spindle_on = spindle};
      const TickResult a = bare.tick(input, 1e-3), b = with.tick(input, 1e-3);
      const bool same = same_bits(a.wrench.force, b.wrench.force) && same_bits(a.wrench.torque, b.wrench.torque) &&
                        a.status == b.status && bare.proxy_pose_W().matrix() == with.proxy_pose_W().matrix();
      differ += same ? 0 : 1;
      touching += a.contact.count > 0 ? 1 : 0;
    }
    CHECK(differ == 0);
    CHECK(touching > 200);
    CHECK(touching < 1150);
  }

  template <class Renderer>
  void all(const std::string& name, const Renderer& renderer, double reach) {
    const auto with = [&](auto... parts) { return HapticScene{grid, raster.isovalue(), renderer, parts...}; };
    const Cutting milling{};
    const HuntCrossley hunt_crossley{{.lambda = 0}};
    const Damping damping{Damping::Options{}};
    const FirstOrderFilter filter{{.cutoff = 1e9}};
    const PassivityController passivity{{.damping = 0, .angular_damping = 0}};
    const AxisGuide guide{{.force = 0, .torque = 0}};
    const DepthStop stop{{.force = 0}};
    const WrenchRateLimit rate{{.force = 1e12, .torque = 1e12}};
    const DeviceLimits limits{.force = 1e12, .torque = 1e12};
    compare(name + ", Milling", with(), with(milling), reach);
    compare(name + ", MillingVibration", with(), with(MillingVibration{{.per_force = 0}}), reach, true);
    compare(name + ", HuntCrossley", with(), with(hunt_crossley), reach);
    compare(name + ", Damping", with(), with(damping), reach);
    compare(name + ", FirstOrderFilter", with(), with(filter), reach);
    compare(name + ", PassivityController", with(), with(passivity), reach);
    compare(name + ", AxisGuide", with(), with(guide), reach);
    compare(name + ", DepthStop", with(), with(stop), reach);
    compare(name + ", WrenchRateLimit", with(), with(rate), reach);
    compare(name + ", DeviceLimits", with(), with(limits), reach);
    compare(name + ", all of them", with(),
            with(milling, hunt_crossley, damping, filter, guide, stop, passivity, rate, limits), reach);
    // A part of no bytes costs none, and a part costs its own.
    CHECK(sizeof(with(ForceOnly{})) == sizeof(with()));
    CHECK(sizeof(with(limits)) <= sizeof(with()) + sizeof(limits) + alignof(std::max_align_t));
  }

  template <class Plain, class Rough>
  void friction(const std::string& name, const Plain& plain, const Rough& rough, double reach) {
    compare(name + ", friction of 0", HapticScene{grid, raster.isovalue(), plain},
            HapticScene{grid, raster.isovalue(), rough}, reach);
    CHECK(sizeof(Plain) < sizeof(Rough));
  }
};

TEST_CASE("a part that does nothing changes no bit: Line") {
  const ToolDiscretization tool{kListedBurr, LineCounts{.shaft = 25}};
  const LineApproxRenderer plain{tool};
  Listed scene;
  scene.all("Line", plain, 0);
  scene.friction("Line", plain, LineApproxRenderer{tool, LineOptions{}, TranslateRotate{}, Coulomb{0, 0}}, 0);
}

TEST_CASE("a part that does nothing changes no bit: Surface") {
  Listed().all("Surface", SurfaceApproxRenderer{ToolDiscretization{kListedBurr, SurfaceCounts::thesis()}},
               kListedBurr.tip_radius);
}

TEST_CASE("a part that does nothing changes no bit: Coupled") {
  const CoupledToolRenderer plain{kListedBurr, CoupledOptions{}};
  Listed scene;
  scene.all("Coupled", plain, kListedBurr.tip_radius);
  scene.friction("Coupled", plain, CoupledToolRenderer{kListedBurr, CoupledOptions{}, Coulomb{0, 0}},
                 kListedBurr.tip_radius);
}

}  // namespace
