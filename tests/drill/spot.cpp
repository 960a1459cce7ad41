// SPDX-License-Identifier: MIT
// Where the drill goes in: on bone that is jagged at the place asked for.
#include "spot.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstdint>
#include <exception>
#include <span>
#include <string>
#include <vector>

using trephine::test::near;

namespace {

using trephine::Vec3d;

constexpr double kVoxel = 0.3e-3;

/// A plate, 6 mm thick, with a spike of 2 x 2 voxels on its middle, 3 mm high.
drill::Bone spiked_plate() {
  const std::array<int, 3> n{60, 60, 50};
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const bool spike = (i == 29 || i == 30) && (j == 29 || j == 30) && k < 30;
        voxels.push_back(k < 20 || spike ? 1000 : -1000);
      }
  return {.name = "plate",
          .unit = "levels",
          .grid = drill::Grid({.size = n, .spacing = Vec3d::Constant(kVoxel)}, std::span<const std::int16_t>(voxels)),
          .isovalue = 0,
          .burr = {.tip_radius = 1e-3, .shaft_radius = 0.5e-3, .shaft_length = 30e-3},
          .notes = {}};
}

TEST_CASE("a place on a spike leads to the plane beside it") {
  const drill::Bone bone = spiked_plate();
  const Vec3d top = kVoxel * Vec3d(29.5, 29.5, 29);
  const drill::Spot spot = drill::spot_near(bone, top);
  CHECK(spot.p_W.z() == near(19.5 * kVoxel, 0.02));
  CHECK(spot.normal_W.z() > 0.99);
  CHECK((spot.p_W - top).norm() < 6e-3);
}

TEST_CASE("no bone near the place is said with the place") {
  const drill::Bone bone = spiked_plate();
  std::string said;
  try {
    (void)drill::spot_near(bone, Vec3d(0.1, 0.2, 0.3));
  } catch (const std::exception& e) {
    said = e.what();
  }
  CHECK(said == "no open bone surface within 10 mm of 100 200 300 (choose another place, --at)");
}

}  // namespace
