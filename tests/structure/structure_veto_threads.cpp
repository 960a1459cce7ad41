// SPDX-License-Identifier: MIT
// Floors made on one thread while another cuts the bone: run again under ThreadSanitizer.
#include "structure/phantom.hpp"

#include <trephine/core/units.hpp>
#include <trephine/structure/structure_veto.hpp>
#include <trephine/voxel/carving.hpp>

#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <thread>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

TEST_CASE("a floor is made while another thread cuts, and is that of the bone away from the cut") {
  constexpr int kSize = 48;
  constexpr double kVoxel = 0.35e-3, kIso = 300;
  const std::vector<std::int16_t> solid(static_cast<std::size_t>(kSize) * kSize * kSize, 1200);
  VoxelGrid<std::int16_t> bone({.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = -1000},
                               solid);
  const auto field = canals().field(4_mm);
  const std::array<StructureVeto, 3> vetoes{StructureVeto{.margin = 0.5_mm}, StructureVeto{}, StructureVeto{}};
  const auto expected = make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes);

  // The burr goes along the first tube, in its margin: cells there are sealed as they are found, cut or not.
  std::atomic<bool> done{false};
  std::atomic<int> cuts{0};
  constexpr double kRadius = 1.2e-3;
  const auto at = [](int n) { return Vec3d(3_mm + 0.02_mm * n, 8_mm, 9.5_mm); };
  std::thread cutter([&] {
    for (int n = 0; !done; ++n, ++cuts) {
      if (n % 400 == 399) bone.restore();
      carve(bone, kIso, SphereCutter(at(n % 400), at(n % 400 + 1), kRadius, n % 400 > 0));
    }
  });
  while (cuts < 10) std::this_thread::yield();
  int different = 0, near = 0;
  for (int made = 0; made < 4; ++made) {
    const auto floor = make_cut_floor(*field, Posed::Identity(), bone, kIso, vetoes);
    for (int k = 0; k < kSize; ++k)
      for (int j = 0; j < kSize; ++j)
        for (int i = 0; i < kSize; ++i) {
          const Vec3d p = kVoxel * Vec3d(i, j, k);
          const Vec3d across(0, p.y() - at(0).y(), p.z() - at(0).z());
          const bool cut = across.norm() < kRadius + 4 * kVoxel;
          if (cut)
            ++near;
          else
            different += floor->floor_at(i, j, k) != expected->floor_at(i, j, k) ? 1 : 0;
          // Protected voxels are protected, whatever the thread saw.
          different += expected->is_protected(i, j, k) && !floor->is_protected(i, j, k) ? 1 : 0;
        }
  }
  done = true;
  cutter.join();
  CHECK(different == 0);
  CHECK(near > 0);
  CHECK(cuts > 100);
}
