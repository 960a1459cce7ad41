// SPDX-License-Identifier: MIT
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/clearance_map.hpp>
#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <thread>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("A worker makes maps of air while the haptic thread cuts, restores and asks") {
  constexpr unsigned kSeed = 99;
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  constexpr double kIso = 100;
  const double h = 3e-4;
  auto grid = make_grid<std::uint8_t>({.size = {40, 40, 40}, .spacing = Vec3d::Constant(h), .outside = 0},
                                      [](int i, int, int) { return i < 12 ? 200.0 : 10.0; });
  const DensityField<std::uint8_t, double> field(grid, kIso);
  ClearanceMap<std::uint8_t> map(grid, kIso);
  std::atomic<bool> stop{false};
  std::atomic<int> made{0};
  std::thread worker([&] {
    while (!stop) {
      map.refresh();
      ++made;
    }
  });
  int wrong = 0;
  int clear_ticks = 0;
  for (int tick = 0; tick < 300 || made < 20; ++tick) {
    const Vec3d c = random_point(rng, Vec3d::Zero(), Vec3d::Constant(40 * h));
    carve(grid, kIso, SphereCutter(c, c, 4 * h));
    if (tick % 50 == 49) grid.restore(4);
    map.begin_tick();
    for (int n = 0; n < 20; ++n) {
      const Vec3d p = random_point(rng, Vec3d::Constant(-5 * h), Vec3d::Constant(45 * h));
      const double clear = map.clearance_at(p);
      if (clear > 0) ++clear_ticks;
      for (int i = 0; clear > 0 && i < 20; ++i) wrong += field.value(p + clear * random_direction(rng)) >= 0 ? 1 : 0;
    }
  }
  stop = true;
  worker.join();
  CHECK(wrong == 0);
  CHECK(clear_ticks > 0);
}
