// SPDX-License-Identifier: MIT
// The bone that the coupled tool's scene says it removed.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/isosurface_volume.hpp"

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 332;

TEST_CASE("coupled removed: plunges tell the volume that the isosurface loses") {
  CAPTURE(kSeed);
  constexpr double kBound = 2.3e-4, kSpeed = 10e-3;
  Random random(kSeed);
  Figures off;
  for (const double sigma : {0.5, 0.7, 1.0})
    for (const double depth : {5e-3, 8e-3}) {
      if (kSanitized && (sigma != 0.7 || depth > 5e-3)) continue;
      const ImageOptions o{.size = {24, 24, static_cast<int>((depth + 4e-3) / kH)}, .sigma = sigma};
      const Vec3d at = o.near_middle(random);
      const double top = (o.size[2] - 7 + random.uniform()) * kH;
      Bone bone = image(HalfSpace{Vec3d(0, 0, top), Vec3d::UnitZ()}, o);
      const LostVolume<std::int16_t> lost(bone, kIso);
      auto scene = coupled_scene(bone, kDrill, Frictionless{}, kGains, Cutting{});
      double told = 0;
      const int ticks = static_cast<int>(depth / (kSpeed * kDt));
      for (int i = -100; i < ticks + 100; ++i) {
        const Vec3d tip(at.x(), at.y(), top + kDrill.tip_radius - std::min(i, ticks) * kSpeed * kDt);
        told += scene.tick({.X_WT = tool_at(tip, Vec3d::UnitZ()), .spindle_on = true}, kDt).removed_mm3;
      }
      off.add(std::abs(told / lost.mm3() - 1));
    }
  CHECK(off.worst() <= kBound);
  MESSAGE("removed off by ", off);
}

}  // namespace
