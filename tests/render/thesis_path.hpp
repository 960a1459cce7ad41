// SPDX-License-Identifier: MIT
#pragma once

#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

/// A path through bone on which the thesis' renderers have stored values.
namespace trephine::test {

[[nodiscard]] inline auto block_with_hole_and_rib(const RasterOptions& o) {
  const Vec3d m = o.middle();
  return Either{Both{HalfSpace{m - Vec3d(0, 0, 0.001), Vec3d::UnitZ()},
                     Hollow{Rod{m + Vec3d(0.001, 0, 0), Vec3d::UnitZ(), 0.0022}}},
                Plate{m - Vec3d(0.005, 0, 0), Vec3d::UnitX(), 2 * kVoxel}};
}

/// Sums over a path's ticks.
struct PathSums {
  int touching = 0, shaft = 0, started_inside = 0;
  double force = 0, torque = 0;  ///< Σ |F| [N], Σ |T| [N·m]
};

/// Leads a renderer in and out of the bone and along it, and compares the sums.
template <class Renderer, class Field>
void check_path(Renderer renderer, const Field& field, const RasterOptions& o, const PathSums& stored) {
  Random random(11);
  Posed X = tool_at(o.middle() + Vec3d(0, 0, 0.004), Vec3d::UnitZ());
  PathSums sums;
  for (int motion = 0; motion < 40; ++motion) {
    const Posed from = X;
    const double x = random.uniform(-1, 1), y = random.uniform(-1, 1), z = random.uniform(-1.5, 1);
    const Vec3d place = o.middle() + 0.004 * Vec3d(x, y, z);
    const Posed to = tool_at(place, (random.unit() + 1.5 * Vec3d::UnitZ()).normalized());
    if (motion % 20 == 19) renderer.reset();
    for (int i = 0; i < 50; ++i) {
      X = between(from, to, std::min(1.0, i / 45.0));
      const auto out = render_at(renderer, field, X);
      sums.touching += out.contact.count > 0 ? 1 : 0;
      sums.shaft += out.contact.shaft ? 1 : 0;
      sums.started_inside += out.status == Status::kStartedInside ? 1 : 0;
      sums.force += static_cast<double>(out.wrench.force.norm());
      sums.torque += static_cast<double>(out.wrench.torque.norm());
    }
  }
  constexpr double kRounding = 1e-9;  // other compilers and processors round otherwise
  CHECK(sums.touching == stored.touching);
  CHECK(sums.shaft == stored.shaft);
  CHECK(sums.started_inside == stored.started_inside);
  CHECK(sums.force == near(stored.force, kRounding));
  CHECK(sums.torque == near(stored.torque, kRounding));
}

}  // namespace trephine::test
