// SPDX-License-Identifier: MIT
// Rays of a picture end, and end on the bone, from wherever the eye looks.
#include <doctest/doctest.h>

#include <trephine/core/units.hpp>

#include "pictured_bone.hpp"
#include "support/random.hpp"

#include <algorithm>
#include <cmath>

using namespace trephine;

TEST_CASE("rays from half a metre away meet a ball of fine voxels where it is") {
  for (const double h : {0.35_mm, 0.1_mm, 0.02_mm}) {
    constexpr int n = 48;
    const Vec3d centre = h * Vec3d::Constant(0.5 * (n - 1));
    const double radius = 15 * h;
    std::vector<std::int16_t> voxels;
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const double above = 100 * (radius - (h * Vec3d(i, j, k) - centre).norm()) / h;
          voxels.push_back(static_cast<std::int16_t>(std::clamp(above, -1000.0, 1000.0)));
        }
    const VoxelGrid<std::int16_t> grid({.size = {n, n, n}, .spacing = Vec3d::Constant(h)}, voxels);
    const drill::PicturedBone bone(grid, 0);
    test::Random random(803);
    double worst = 0;
    int hits = 0;
    for (int i = 0; i < 20000; ++i) {
      const double far = random.uniform(0.3, 0.8);
      const Vec3d eye = centre + far * random.unit();
      const Vec3d through = centre + 1.2 * radius * random.arrow();
      const Vec3d direction = (through - eye).normalized();
      const Vec3d beside = (centre - eye) - (centre - eye).dot(direction) * direction;
      const auto hit = bone.hit({eye.cast<float>(), direction.cast<float>()}, 0, 2);
      if (std::abs(beside.norm() - radius) < h) continue;  // grazes
      REQUIRE(hit.has_value() == (beside.norm() < radius));
      if (!hit) continue;
      ++hits;
      const Vec3d p = eye + static_cast<double>(*hit) * direction;
      worst = std::max(worst, std::abs((p - centre).norm() - radius) / h);
    }
    CHECK(hits > 5000);
    CHECK(worst < 0.1 + 1e-7 / h);  // the image's share, and rounding of half a metre
  }
}
