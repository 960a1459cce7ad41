// SPDX-License-Identifier: MIT
#include "structure/label_shapes.hpp"
#include "support/random.hpp"

#include <trephine/structure/build_structure_field.hpp>
#include <trephine/structure/near_splines.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("near splines are those that have a distance at a point, and no others") {
  Random rng(33);
  for (const Vec3d& h : {Vec3d(3e-4, 3e-4, 3e-4), Vec3d(2e-4, 2e-4, 5e-4)}) {
    Labels labels({60, 50, 40}, h);
    for (int s = 0; s < 7; ++s) {
      const Vec3d centre = labels.end().cwiseProduct(Vec3d{rng.uniform(), rng.uniform(), rng.uniform()});
      labels.fill(random_shape(s % kShapes, centre, 0.5 * h.maxCoeff(), rng).distance, s + 1);
    }
    const auto field = build_structure_field(labels.view(), {.threads = 2});
    const double spacing = 6e-4;
    std::vector<SmoothDistance> all;
    // Some have no zone and are empty.
    for (int s = 0; s < field->structures(); ++s) all.emplace_back(*field, s, spacing, s % 3 == 2 ? -1 : 1e-3);
    const NearSplines near(all);
    CHECK(near.bytes() > 0);
    int found = 0, several = 0;
    for (int n = 0; n < 40000; ++n) {
      const Vec3d p =
          labels.end().cwiseProduct(Vec3d{rng.uniform(-0.5, 1.5), rng.uniform(-0.5, 1.5), rng.uniform(-0.5, 1.5)});
      const SmoothDistance::Place place(p, spacing);
      std::vector<std::uint8_t> expected;
      Vec3d gradient;
      for (std::size_t i = 0; i < all.size(); ++i)
        if (all[i].at(place, gradient)) expected.push_back(static_cast<std::uint8_t>(i));
      const std::span<const std::uint8_t> is = near.at(place);
      REQUIRE(std::equal(is.begin(), is.end(), expected.begin(), expected.end()));
      found += expected.empty() ? 0 : 1;
      several += expected.size() > 1 ? 1 : 0;
    }
    CHECK(found > 1000);
    CHECK(several > 100);
    CHECK(near.at(SmoothDistance::Place(Vec3d::Constant(std::numeric_limits<double>::quiet_NaN()), spacing)).empty());
    CHECK(near.at(SmoothDistance::Place(Vec3d::Constant(1e30), spacing)).empty());
  }
  CHECK(NearSplines().at(SmoothDistance::Place(Vec3d::Zero(), 1e-3)).empty());
}
