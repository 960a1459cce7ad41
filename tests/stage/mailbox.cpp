// SPDX-License-Identifier: MIT
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/first_order_filter.hpp>
#include <trephine/stage/hunt_crossley.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/remote.hpp>

#include "fakes.hpp"
#include "support/malloc_hook.hpp"
#include "support/near.hpp"

using namespace trephine;
using namespace trephine::test;

static_assert(Tunable<Damping> && Tunable<HuntCrossley> && Tunable<MillingVibration> && Tunable<FirstOrderFilter> &&
              Tunable<DeviceLimits> && Tunable<Cutting<RateLimitedCut<>>>);
static_assert(!Tunable<Add>);
static_assert(Stage<Remote<Damping>> && !std::is_copy_constructible_v<Mailbox<int>>);

TEST_CASE("mailbox: the latest value, once") {
  Mailbox<int> box;
  CHECK(box.take() == nullptr);
  box.post(1);
  const int* got = box.take();
  REQUIRE(got != nullptr);
  CHECK(*got == 1);
  CHECK(box.take() == nullptr);
  CHECK(*got == 1);  // still there: nothing newer was taken
  for (int i = 2; i <= 9; ++i) box.post(i);
  got = box.take();
  REQUIRE(got != nullptr);
  CHECK(*got == 9);
  CHECK(box.take() == nullptr);
}

TEST_CASE("mailbox: any order of posts and takes gives what a plain variable would") {
  Mailbox<unsigned> box;
  unsigned seed = 1;
  unsigned last = 0;
  bool fresh = false;
  for (unsigned i = 1; i < 10000; ++i) {
    seed = seed * 1664525U + 1013904223U;
    if ((seed >> 24) % 3 != 0) {
      box.post(i);
      last = i;
      fresh = true;
    } else {
      const unsigned* got = box.take();
      CHECK((got != nullptr) == fresh);
      if (got != nullptr) CHECK(*got == last);
      fresh = false;
    }
  }
}

TEST_CASE("mailbox: refuses invalid options where they are posted") {
  Mailbox<Damping::Options> box;
  CHECK(refusal([&] { box.post({.linear = -1}); }).find("linear") != std::string::npos);
  CHECK(box.take() == nullptr);
  static_assert(noexcept(Mailbox<int>{}.post(1)));
  static_assert(!noexcept(box.post({})));
}

TEST_CASE("mailbox: a posted option takes effect at the next tick, without memory") {
  auto bone = small_grid();
  Mailbox<Damping::Options> knob;
  auto scene = HapticScene{bone, 300, Floor<>{}, Remote{Damping{{.linear = 1}}, knob}, DeviceLimits{.force = 10}};
  double x = 0;
  const auto force = [&] {
    x += 1e-3;  // 1 m/s
    return scene.tick({.X_WT = at(x, 0, 1)}, kTick).wrench.force.x();
  };
  CHECK(force() == 0);
  CHECK(force() == near(-1));
  knob.post({.linear = 2});
  knob.post({.linear = 3});
  double with_news = 0;
  CHECK(heap_calls([&] { with_news = force(); }) == 0);
  CHECK(with_news == near(-3));
  CHECK(force() == near(-3));
  knob.post({.linear = 4});
  (void)scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick);  // read even where the input is bad
  CHECK(scene.part<Damping>().options().linear == 4);
}

TEST_CASE("remote milling: another cut policy cuts from the next tick on") {
  Mailbox<RateLimitedCut<>> rate;
  const std::vector<std::int16_t> voxels(20 * 20 * 20, 1000);
  VoxelGrid<std::int16_t> bone({.size = {20, 20, 20}, .spacing = Vec3d::Constant(1e-3)}, voxels);
  auto scene = HapticScene{bone, 300, Floor<>{}, Remote{Cutting{RateLimitedCut<>{.rate = 1e5}}, rate}};
  const auto ticks_to_cut = [&](double x) {
    for (int i = 1; i < 100; ++i)
      if (scene.tick({.X_WT = at(x, 10e-3, 10e-3), .spindle_on = true}, kTick).removed_mm3 > 0) return i;
    return 100;
  };
  // 700 densities above the isovalue, 100 a tick where the ball covers a voxel wholly.
  const int slow = ticks_to_cut(5e-3);
  rate.post({.rate = 1e6});
  CHECK(slow >= 8);
  CHECK(slow <= 10);
  CHECK(ticks_to_cut(14e-3) == 2);  // the jump there cuts nothing
}
