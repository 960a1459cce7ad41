// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/raster.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/voxel/clearance_map.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cstring>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 35;  // its tool touches bone that is restored
using Grid = VoxelGrid<std::uint8_t>;

Grid bone() {
  const RasterOptions o{.size = {90, 70, 60}};
  return rasterise<std::uint8_t>(Either{Ball{o.middle(), 3e-3}, Ball{Vec3d(2e-3, 3e-3, 14e-3), 1.5e-3}}, o);
}

template <class Deep>
auto renderer() {
  const Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.03};
  return SurfaceApproxRenderer<float, AreaWeights, Deep>(ToolDiscretization{burr, SurfaceCounts::thesis()});
}

}  // namespace

TEST_CASE_TEMPLATE("A scene that skips what is far finds what one that looks at all finds", Deep, HoldForce,
                   ExtendAlongSurface) {
  CAPTURE(kSeed);
  Random random(kSeed);
  Grid looked = bone();
  Grid skipped = bone();
  const double iso = RasterOptions{}.isovalue();
  ClearanceMap<std::uint8_t> map(skipped, iso);
  // A field that only samples.
  struct Plain {
    DensityField<std::uint8_t, float> f;
    using Scalar [[maybe_unused]] = float;
    float value(const Vec3<float>& p) const noexcept { return f.value(p); }
    Vec3<float> gradient(const Vec3<float>& p) const noexcept { return f.gradient(p); }
    bool normal(const Vec3<float>& p, Vec3<float>& n) const noexcept { return f.normal(p, n); }
    void values(const Pose<float>& X, const float* x, const float* y, const float* z, float* o, int n) const noexcept {
      f.values(X, x, y, z, o, n);
    }
    void gradients(const Pose<float>& X, const float* x, const float* y, const float* z, float* gx, float* gy,
                   float* gz, int n) const noexcept {
      f.gradients(X, x, y, z, gx, gy, gz, n);
    }
    float voxel() const noexcept { return f.voxel(); }
    auto smooth() const noexcept { return f.smooth(); }
  };
  auto all = renderer<Deep>();
  HapticScene scene{skipped, iso, renderer<Deep>(), Milling{}, EmptySpaceSkipping{map}};
  std::uint64_t edits = skipped.edit_count();
  int touching = 0;
  int free = 0;
  Vec3d p(0, 0, 0);
  Mat3d R = Mat3d::Identity();
  const Vec3d far(0.03, 0.025, 0.02);
  constexpr int kRestored = 10000;  // tick after which all bone is whole again
  for (int tick = 0; tick < 20000; ++tick) {
    // Jumps anywhere, and then some ticks of slow motion.
    const bool jumps = tick % 8 == 0;
    R = jumps ? random.rotation() : Mat3d(rotation_from_vector(Vec3d(0.02 * random.unit())) * R);
    if (jumps)
      p = Vec3d{random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2)}.cwiseProduct(far);
    else
      p += 4e-4 * random.unit();
    const Posed X = make_pose<double>(R, p);
    const auto found = all.render(Plain{DensityField<std::uint8_t, float>(looked, iso)},
                                  relative_pose(looked.X_WG(), X).cast<float>());
    const TickResult r = scene.tick({.X_WT = X, .spindle_on = tick % 3 == 0}, 1e-3);
    CAPTURE(tick);
    const Wrenchd w = found.wrench.template cast<double>();
    REQUIRE(w.force == r.wrench.force);
    REQUIRE(w.torque == r.wrench.torque);
    // Bone may be new at the first tick and after `restore`: then a scene that feels it says so.
    const bool is_new = tick == 0 || tick == kRestored + 1;
    Status expected = found.status;
    if (is_new && !(w == Wrenchd::zero())) expected = worse(expected, Status::kStartedInside);
    if (jumps && tick > 0) expected = worse(expected, Status::kJump);  // the scene compares poses, too
    REQUIRE(r.status == expected);
    REQUIRE(found.contact.count == r.contact.count);
    REQUIRE(found.contact.tip == r.contact.tip);
    REQUIRE(found.contact.shaft == r.contact.shaft);
    REQUIRE(found.contact.depth == r.contact.depth);
    for (std::size_t g = 0; g < all.groups().size(); ++g) {
      const auto& a = all.groups()[g];
      const auto& b = scene.renderer().groups()[g];
      REQUIRE((a.contacts == b.contacts && a.deep == b.deep && a.lever_m == b.lever_m && a.force == b.force &&
               a.torque == b.torque));
    }
    (r.contact.count > 0 ? touching : free) += 1;
    // The other bone loses what this one lost.
    if (skipped.edit_count() != edits) {
      for (int k = 0; k < 60; ++k)
        for (int j = 0; j < 70; ++j)
          looked.lower_row(j, k, 0, 89, [&](int i, std::uint8_t) { return skipped.at(i, j, k); });
      looked.commit();
    }
    edits = skipped.edit_count();
    if (tick % 500 == 0) map.refresh();
    if (tick == kRestored) {
      skipped.restore();
      looked.restore();
      edits = skipped.edit_count();
    }
  }
  CHECK(touching > 400);
  CHECK(free > 5000);
}

// The air that a map proves serves some ticks of the coupled tool, whatever is cut or restored meanwhile.
TEST_CASE("The coupled tool feels the same with a map of air and without") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  Grid looked = bone(), skipped = bone();
  const double iso = RasterOptions{}.isovalue();
  ClearanceMap<std::uint8_t> map(skipped, iso);
  const CoupledToolRenderer tool{Burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.01}};
  HapticScene without{looked, iso, tool};
  HapticScene with{skipped, iso, tool, EmptySpaceSkipping{map}};
  // Either search ends within a quarter of the device's motion, which counts as half a voxel at most. A tool that
  // misses bone for a tick is a whole motion in.
  const double bound =
      0.25 * CoupledOptions{}.stiffness * CoupledConstants::kMaxCountedMotion * RasterOptions{}.spacing.minCoeff();
  const Vec3d far(0.03, 0.025, 0.02), middle = RasterOptions{.size = {90, 70, 60}}.middle();
  Posed X = Posed::Identity();
  bool touches = false;
  int touching = 0, free = 0, differ = 0;
  Figures off;
  for (int tick = 0; tick < 12000; ++tick) {
    // Jumps anywhere, and then moves toward the larger ball until it touches.
    if (tick % 20 == 0 || touches) {
      const Vec3d share(random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2));
      X = make_pose<double>(random.rotation(), share.cwiseProduct(far));
    } else {
      X.translation() += random.uniform(0, 1e-3) * (middle - X.translation()).normalized() + 2e-4 * random.unit();
      X.linear() = rotation_from_vector(Vec3d(0.05 * random.unit())) * Mat3d(X.linear());
    }
    if (tick % 60 == 0) {
      const Vec3d at = middle + 3e-3 * random.unit();
      for (Grid* const grid : {&looked, &skipped}) static_cast<void>(carve(*grid, iso, SphereCutter(at, at, 5e-4)));
    }
    const TickResult a = without.tick({.X_WT = X}, 1e-3), b = with.tick({.X_WT = X}, 1e-3);
    // A search that reached its work bound is on its way.
    if (std::max(without.renderer().steps(), with.renderer().steps()) <= CoupledConstants::kMaxSteps) {
      off.add((a.wrench.force - b.wrench.force).norm());
      differ += a.status == b.status ? 0 : 1;
    }
    touches = a.contact.count > 0;
    (touches ? touching : free) += 1;
    if (tick % 500 == 0) map.refresh();
    if (tick % 1777 == 1776) {
      looked.restore();
      skipped.restore();
    }
  }
  MESSAGE("ticks in contact ", touching, ", free ", free, "; forces differ [N] by ", off);
  CHECK(differ == 0);
  CHECK(off.worst() <= bound);
  CHECK(touching > 150);
  CHECK(free > 4000);
}

TEST_CASE("The coupled tool feels bone that is restored where a map proved air") {
  Grid grid = bone();
  const double iso = RasterOptions{}.isovalue();
  ClearanceMap<std::uint8_t> map(grid, iso);
  HapticScene scene{grid, iso,
                    CoupledToolRenderer{Burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.01}},
                    EmptySpaceSkipping{map}};
  const Vec3d ball(2e-3, 3e-3, 14e-3);
  static_cast<void>(carve(grid, iso, SphereCutter(ball, ball, 2.5e-3)));
  map.refresh();
  const Posed X = make_pose<double>(Mat3d::Identity(), ball + Vec3d(0, 0, 2.7e-3));
  for (int tick = 0; tick < 3; ++tick) CHECK(scene.tick({.X_WT = X}, 1e-3).contact.count == 0);
  grid.restore();
  CHECK(scene.tick({.X_WT = X}, 1e-3).contact.count > 0);
}

TEST_CASE("A map of another grid or a higher isovalue is refused") {
  Grid one = bone();
  Grid other = bone();
  ClearanceMap<std::uint8_t> map(one, 100);
  using Scene = HapticScene<std::uint8_t, decltype(renderer<HoldForce>()), EmptySpaceSkipping<std::uint8_t>>;
  CHECK_THROWS_AS(Scene(other, 100, renderer<HoldForce>(), EmptySpaceSkipping{map}), std::invalid_argument);
  CHECK_THROWS_AS(Scene(one, 90, renderer<HoldForce>(), EmptySpaceSkipping{map}), std::invalid_argument);
}
