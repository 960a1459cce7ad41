// SPDX-License-Identifier: MIT
#pragma once

#include "phantom.hpp"
#include "screen.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

/// Bones to drill in the window, and a window to drill them in, hidden in a virtual screen.
namespace live_test {

using namespace live;

/// A ball of bone of `radius` [m] in the middle of a cube of voxels, blurred over one.
inline drill::Bone ball(const Vec3d& spacing, double radius) {
  std::array<int, 3> n{};
  for (std::size_t a = 0; a < 3; ++a)
    n[a] = static_cast<int>(std::ceil(2.6 * radius / spacing[static_cast<Eigen::Index>(a)]));
  const Vec3d middle = 0.5 * spacing.cwiseProduct(Vec3d(n[0] - 1, n[1] - 1, n[2] - 1));
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double d = (spacing.cwiseProduct(Vec3d(i, j, k)) - middle).norm() - radius;
        voxels.push_back(static_cast<std::int16_t>(std::lround(600 * std::erfc(d / spacing.maxCoeff()))));
      }
  const Posed X_WG =
      trephine::make_pose<double>(trephine::rotation_from_vector<double>(Vec3d(0.2, 0.5, -0.3)), Vec3d(0.1, 0, -0.05));
  return {.name = "ball",
          .unit = "levels",
          .grid = drill::Grid({.size = n, .spacing = spacing, .X_WG = X_WG}, std::span<const std::int16_t>(voxels)),
          .isovalue = 600,
          .burr = {.tip_radius = 1.2e-3, .shaft_radius = 0.6e-3, .shaft_length = 30e-3},
          .notes = {}};
}

inline drill::Bone tooth() {
  return {.name = "tooth",
          .unit = "levels",
          .grid = drill::tooth_phantom<std::int16_t>({.size = {128, 128, 100}, .spacing = 0.2e-3}),
          .isovalue = drill::PhantomDensities::kIsovalue,
          .burr = {.tip_radius = 0.8e-3, .shaft_radius = 0.4e-3, .shaft_length = 30e-3},
          .notes = {}};
}

/// A workbench in a hidden window whose errors of OpenGL are caught.
struct Bench {
  /// Makes the structures of a bone whose drill starts at a spot.
  using Guard = std::function<std::shared_ptr<const GuardedBone>(const drill::Bone&, const drill::Spot&)>;

  explicit Bench(drill::Bone bone, int width = 320, int height = 240)
      : Bench(std::move(bone), Guard{}, width, height) {}
  Bench(drill::Bone bone, const Guard& guard, int width = 320, int height = 240)
      : window(width, height, true, true),
        spot(drill::find_spot(bone)),
        bench(loaded(std::move(bone), spot, guard), LiveOptions{}) {
    bench.update(0, width, height);
  }
  ~Bench() {
    CHECK(window.gl_errors() == "");
    CHECK(glGetError() == GL_NO_ERROR);
  }
  /// Frames as the program's loop has them, for a time [s]; longer where a busy machine leaves out ticks, until the
  /// haptic loop has had that time too, and at most ten times as long.
  void run(double seconds) {
    using Clock = std::chrono::steady_clock;
    const auto start = Clock::now();
    const std::uint64_t ticks =
        bench.view().tick + static_cast<std::uint64_t>(seconds * bench.session().options().rate);
    for (auto now = start; now - start < std::chrono::duration<double>(seconds) ||
                           (bench.view().tick < ticks && now - start < std::chrono::duration<double>(10 * seconds));
         now = Clock::now()) {
      bench.update(0.016, 320, 240);
      std::this_thread::sleep_for(std::chrono::milliseconds(8));
    }
  }
  /// The bone alone, at 160 x 120.
  void draw_bone() {
    SceneView v = bench.scene_view();
    v.only_bone = true;
    v.sprites.clear();
    v.triangles.clear();
    v.ghost_opacity = 0;
    v.tool_W.translation() += Vec3d(3, 0, 0);
    bench.picture().draw_moving(v, bench.texture(), bench.X_WG(), 160, 120);
  }
  std::vector<float> depths() {
    draw_bone();
    return bench.picture().depths();
  }

  static Loaded loaded(drill::Bone bone, const drill::Spot& spot, const Guard& guard) {
    std::shared_ptr<const GuardedBone> guarded = guard ? guard(bone, spot) : nullptr;
    return {std::move(bone), spot, std::move(guarded)};
  }

  Window window;
  drill::Spot spot;
  Workbench bench;
};

/// Takes the hand from one height over the spot to another, in burr radii along the surface's normal.
inline void go(Bench& b, double from, double to) {
  const double radius = b.bench.session().options().drill.burr.tip_radius;
  Event e;
  e.kind = Event::Kind::kHand;
  e.pose = b.bench.hand().pose();
  for (int i = 1; i <= 16; ++i) {
    e.pose.translation() = b.spot.p_W + radius * (from + (to - from) * i / 16) * b.spot.normal_W;
    b.bench.apply(e);
    b.run(0.06);
  }
}

/// Drills a hole as deep as the burr is wide, and withdraws.
inline void drill_in(Bench& b) {
  go(b, 3, 1.2);
  b.bench.act(Action::kSpindle);
  go(b, 1.2, -1);
  b.bench.act(Action::kSpindle);
  go(b, -1, 3);
}

}  // namespace live_test
