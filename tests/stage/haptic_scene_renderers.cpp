// SPDX-License-Identifier: MIT
#include <trephine/core/rotation.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/render/thesis/line.hpp>
#include <trephine/render/thesis/surface.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/hunt_crossley.hpp>

#include "fakes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

#include <algorithm>

using namespace trephine;
using namespace trephine::test;

// The scene with the library's own renderers in place of the fakes: what they promise arrives in the world.
namespace {

constexpr Burr kBall{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0};
constexpr double kStiffness = 800;                   // [N/m], the secant at R/2
constexpr double kPressed = kBall.tip_radius / 2;    // [m]
constexpr double kExpected = kStiffness * kPressed;  // [N]
constexpr double kSurface = 10e-3;                   // bone below this z of G [m]

/// A block with a flat top, its density falling by 100 a voxel through 300 there.
VoxelGrid<std::int16_t> block(const Posed& X_WG) {
  constexpr int kSize = 32;
  constexpr double kSpacing = 0.5e-3;
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kSize; ++k)
    voxels.insert(voxels.end(), kSize * kSize,
                  static_cast<std::int16_t>(std::clamp(300 + 100 * (kSurface / kSpacing - k), -1000.0, 2000.0)));
  return {{.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kSpacing), .X_WG = X_WG}, voxels};
}

/// `make` makes a renderer whose tip touches a plane with T's origin `touches` above it [m].
template <class Make>
void check_press(const Make& make, double touches) {
  const Posed X_WG = turned({0.4, -0.7, 2}, {1, -2, 0.5});
  auto bone = block(Posed::Identity());
  auto turned_bone = block(X_WG);
  auto scene = HapticScene{bone, 300, make(), HuntCrossley{{.lambda = 0}}, DeviceLimits{.force = 5, .torque = 1}};
  auto turned_scene =
      HapticScene{turned_bone, 300, make(), HuntCrossley{{.lambda = 0}}, DeviceLimits{.force = 5, .torque = 1}};
  TickResult r;
  TickResult t;
  std::int64_t calls = 0;
  for (int k = 0; k <= 100; ++k) {  // from the air, slowly
    const double z = kSurface + touches + 1e-3 - (1e-3 + kPressed) * k / 100;
    const TickInput input{.X_WT = at(8e-3, 8e-3, z)};
    const TickInput turned_input{.X_WT = X_WG * input.X_WT};
    calls += heap_calls([&] {
      r = scene.tick(input, kTick);
      t = turned_scene.tick(turned_input, kTick);
    });
    if (k == 0) CHECK(r.wrench == Wrenchd{});
    CHECK((X_WG.linear() * r.wrench.force - t.wrench.force).norm() < 3.3e-16);
  }
  CHECK(calls == 0);
  CHECK(r.status == Status::kOk);
  CHECK(r.contact.tip);
  CHECK(r.wrench.force.z() == near(kExpected, 4.9e-4));
  CHECK(r.wrench.force.head<2>().norm() < 0.0039 * kExpected);
  CHECK(r.wrench.torque.norm() < 0.05 * kExpected * kBall.tip_radius);
  std::array<ContactPoint<double>, 256> points;
  const auto found = turned_scene.contacts_W(points);
  REQUIRE(found >= 1);
  // The one that carries most: those at the contact's rim graze.
  const auto strongest = std::max_element(points.begin(), points.begin() + static_cast<std::ptrdiff_t>(found),
                                          [](const auto& a, const auto& b) { return a.force.norm() < b.force.norm(); });
  CHECK(strongest->normal.dot(X_WG.linear().col(2)) > 0.5);
}

}  // namespace

TEST_CASE("surface renderer in a scene: pressed by R/2 it gives its stiffness, in any pose of the grid") {
  check_press(
      [] {
        return SurfaceApproxRenderer{
            ToolDiscretization{kBall, SurfaceCounts{.sphere = 200, .slices = 0, .per_slice = 0}},
            {.stiffness = kStiffness}};
      },
      kBall.tip_radius);
}

TEST_CASE("line renderer in a scene: pressed by R/2 it gives its stiffness, in any pose of the grid") {
  check_press(
      [] {
        return LineApproxRenderer{ToolDiscretization{kBall, LineCounts{}}, LineOptions{.stiffness = kStiffness}};
      },
      0);  // its tip is a point
}

namespace {

/// Two scenes of the same renderer along a path that presses tip and shaft, one for forces alone.
template <class Renderer>
void check_forces_alone(const Renderer& renderer) {
  auto bone = block(Posed::Identity());
  auto all = HapticScene{bone, 300, renderer};
  auto forces = HapticScene{bone, 300, renderer, ForceOnly{}};
  double torque = 0;
  for (int k = 0; k <= 400; ++k) {
    const double phase = 0.03 * k;
    const TickInput input{.X_WT = make_pose<double>(rotation_from_vector(Vec3d(0, 1.2 + 0.5 * std::sin(phase), 0)),
                                                    Vec3d(8e-3, 8e-3, kSurface + 1e-3 * std::cos(0.7 * phase)))};
    const TickResult a = all.tick(input, kTick), f = forces.tick(input, kTick);
    REQUIRE(a.wrench.force == f.wrench.force);
    REQUIRE(f.wrench.torque == Vec3d::Zero());
    torque = std::max(torque, a.wrench.torque.norm());
  }
  CHECK(torque > 1e-4);
}

}  // namespace

TEST_CASE("a scene for forces alone has no torque, and the same bits of force") {
  constexpr Burr kDrill{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 6e-3};
  const ToolDiscretization line{kDrill, LineCounts{}};
  const ToolDiscretization surface{kDrill, SurfaceCounts::thesis()};
  check_forces_alone(LineApproxRenderer{line});
  check_forces_alone(SurfaceApproxRenderer{surface});
  check_forces_alone(ThesisLine{line});
  check_forces_alone(ThesisSurface{surface});
}
