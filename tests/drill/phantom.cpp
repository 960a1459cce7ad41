// SPDX-License-Identifier: MIT
// The made tooth: its voxels beside the formula, each for itself.
#include "phantom.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

using drill::PhantomOptions;
using trephine::Vec3d;

TEST_CASE("tooth: each voxel has the density of its place, although most are filled by blocks") {
  using D = drill::PhantomDensities;
  const std::array<PhantomOptions, 3> all{PhantomOptions{.size = {90, 67, 71}, .spacing = 0.2e-3},
                                          PhantomOptions{.size = {41, 52, 63}, .spacing = 0.35e-3, .blur = 2.5},
                                          PhantomOptions{.size = {65, 66, 95}, .spacing = 0.25e-3, .blur = 0.3}};
  for (const PhantomOptions& options : all) {
    const auto grid = drill::tooth_phantom<float>(options);
    const double mm = 1e3 * options.spacing, sigma = options.blur * mm;
    double worst = 0;
    int bone = 0;
    for (int k = 0; k < options.size[2]; ++k)
      for (int j = 0; j < options.size[1]; ++j)
        for (int i = 0; i < options.size[0]; ++i) {
          const Vec3d from_middle =
              Vec3d(i, j, k) - 0.5 * Vec3d(options.size[0] - 1, options.size[1] - 1, options.size[2] - 1);
          const Vec3d p = mm * from_middle - Vec3d(0, 0, 1.8);
          double expected = D::kAir;
          if (p.head<2>().norm() < 7 && std::abs(p.z()) < 12) {
            const drill::phantom::Tooth t = drill::phantom::tooth_at(p);
            expected += (D::kEnamel - D::kAir) * drill::phantom::blurred_step(t.outside, sigma) +
                        (D::kDentine - D::kEnamel) * drill::phantom::blurred_step(t.dentine, sigma) +
                        (D::kPulp - D::kDentine) * drill::phantom::blurred_step(t.pulp, sigma);
          }
          worst = std::max(worst, std::abs(grid.at(i, j, k) - expected));
          bone += expected > D::kIsovalue ? 1 : 0;
        }
    CHECK(worst < 0.01);               // the blur ends at four deviations, where 3e-5 of an edge is left
    CHECK(bone * mm * mm * mm > 300);  // mm³
  }
}
