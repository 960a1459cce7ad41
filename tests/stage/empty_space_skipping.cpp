// SPDX-License-Identifier: MIT
#include "support/raster.hpp"

#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/voxel/clearance_map.hpp>

#include <doctest/doctest.h>

#include <cstring>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 31;
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
  };
  auto all = renderer<Deep>();
  HapticScene scene{skipped, iso, renderer<Deep>(), Milling{}, EmptySpaceSkipping{map}};
  std::uint64_t edits = skipped.edit_count();
  int touching = 0;
  int free = 0;
  Vec3d p(0, 0, 0);
  const Vec3d far(0.03, 0.025, 0.02);
  for (int tick = 0; tick < 20000; ++tick) {
    // Jumps anywhere, and then some ticks of slow motion.
    if (tick % 8 == 0)
      p = Vec3d{random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2), random.uniform(-0.2, 1.2)}.cwiseProduct(far);
    else
      p += 4e-4 * random.unit();
    const Posed X = make_pose<double>(random.rotation(), p);
    const auto found = all.render(Plain{DensityField<std::uint8_t, float>(looked, iso)},
                                  relative_pose(looked.X_WG(), X).cast<float>());
    const TickResult r = scene.tick({.X_WT = X, .spindle_on = tick % 3 == 0}, 1e-3);
    CAPTURE(tick);
    const Wrenchd w = found.wrench.template cast<double>();
    REQUIRE(w.force == r.wrench.force);
    REQUIRE(w.torque == r.wrench.torque);
    REQUIRE(found.status == r.status);
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
    if (tick == 10000) {
      skipped.restore();
      looked.restore();
      edits = skipped.edit_count();
    }
  }
  CHECK(touching > 400);
  CHECK(free > 5000);
}

TEST_CASE("A map of another grid or a higher isovalue is refused") {
  Grid one = bone();
  Grid other = bone();
  ClearanceMap<std::uint8_t> map(one, 100);
  using Scene = HapticScene<std::uint8_t, decltype(renderer<HoldForce>()), EmptySpaceSkipping<std::uint8_t>>;
  CHECK_THROWS_AS(Scene(other, 100, renderer<HoldForce>(), EmptySpaceSkipping{map}), std::invalid_argument);
  CHECK_THROWS_AS(Scene(one, 90, renderer<HoldForce>(), EmptySpaceSkipping{map}), std::invalid_argument);
}
