// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"

#include <string>
#include "support/malloc_hook.hpp"

using namespace trephine;
using namespace trephine::test;

namespace {

/// Heap calls of a second of drilling, the first tick included, with hostile ticks in between.
template <class Density, class R>
void drill_without_heap(R renderer, const std::string& name) {
  CAPTURE(name);
  auto bone = make_block<Density>();
  auto scene = make_full_scene(bone, std::move(renderer));
  double removed = 0;
  double most_force = 0;
  const auto calls = heap_calls([&] {
    for (int i = 0; i < 1000; ++i) {
      const double t = 1e-3 * i;
      TickInput input{.X_WT = drilling_pose(t), .spindle_on = t > 0.3};
      const TickResult r = scene.tick(input, 1e-3);
      removed += r.removed_mm3;
      most_force = std::max(most_force, r.wrench.force.norm());
      if (i % 100 != 50) continue;
      input.X_WT.translation().x() = std::numeric_limits<double>::quiet_NaN();
      static_cast<void>(scene.tick(input, 1e-3));
      input.X_WT.translation() = Vec3d(500, 0, 0);  // a jump, and back at the next tick
      static_cast<void>(scene.tick(input, 1e-3));
    }
  });
  if (AllocationGuard::available()) CHECK(calls == 0);
  CHECK(removed > 1.0);      // it did drill …
  CHECK(most_force > 0.05);  // … and feel
  CHECK(bone.restore() == 0);
}

template <class Density, class S>
void drill_with_all() {
  drill_without_heap<Density>(make_line<S>(), "line");
  drill_without_heap<Density>(make_thesis_line<S>(), "thesis line");
  drill_without_heap<Density>(make_surface<S>(), "surface");
  drill_without_heap<Density>(make_thesis_surface<S>(), "thesis surface");
  drill_without_heap<Density>(make_coupled(), "coupled");
}

}  // namespace

TEST_CASE("a tick takes nothing from the heap: all renderers, every stage, both scalars, every kind of density") {
  if (!AllocationGuard::available())
    MESSAGE("the allocator cannot be watched here: forces and removal alone are checked");
  drill_with_all<std::uint8_t, float>();
  drill_with_all<std::uint8_t, double>();
  drill_with_all<std::int16_t, float>();
  drill_with_all<float, double>();
}
