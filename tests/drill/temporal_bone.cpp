// SPDX-License-Identifier: MIT
// The temporal bone of formulas: its distances, its voxels and labels, and the ways to its structures.
#include "temporal_bone.hpp"

#include "support/random.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace {

using namespace drill;
using namespace trephine::test;
using trephine::Vec3d;

constexpr int kCount = temporal_bone::kCount;

Vec3d somewhere(Random& random) {
  return 1e-3 * Vec3d{random.uniform(-16, 16), random.uniform(-13, 13), random.uniform(-22, -1)};
}

}  // namespace

TEST_CASE("temporal bone: outside of a structure its distance is one, and structures do not touch") {
  Random random(12);
  double steepest = 0, flattest = 2, nearest = 1;
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p = somewhere(random);
    std::array<double, kCount> d{};
    for (int s = 0; s < kCount; ++s) {
      d[static_cast<std::size_t>(s)] = temporal_bone::distance(s, p);
      const double here = d[static_cast<std::size_t>(s)];
      if (here < 1e-4) continue;
      // Down its gradient lies its surface.
      Vec3d gradient;
      for (int a = 0; a < 3; ++a) {
        const Vec3d h = 1e-7 * Vec3d::Unit(a);
        gradient[a] = (temporal_bone::distance(s, p + h) - temporal_bone::distance(s, p - h)) / 2e-7;
      }
      if (gradient.norm() < 0.99) continue;  // equally near to two parts
      const double there = temporal_bone::distance(s, p - here * gradient.normalized());
      steepest = std::max(steepest, there);
      flattest = std::min(flattest, there);
    }
    std::sort(d.begin(), d.end());
    nearest = std::min(nearest, d[0] + d[1]);  // at least the gap between two structures
  }
  CHECK(std::max(steepest, -flattest) < 4e-14);
  CHECK(nearest > 0.3e-3);
}

TEST_CASE("temporal bone: voxels and labels are of the formulas") {
  const Bone bone = temporal_bone::bone({});
  const MadeStructures made =
      temporal_bone::structures({.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.04});
  Random random(13);
  const trephine::Posed X_SW = made.labels.X_WS().inverse();
  int soft = 0, solid = 0, wrong = 0;
  for (int n = 0; n < 20000; ++n) {
    const Vec3d p = somewhere(random);
    int within = -1;
    double nearest = 1;
    for (int s = 0; s < kCount; ++s) {
      const double d = temporal_bone::distance(s, p);
      if (d < 0) within = s;
      nearest = std::min(nearest, d);
    }
    // A label's voxel is up to half a diagonal from the point.
    if (std::abs(nearest) > 0.3e-3) wrong += made.labels.label_at(X_SW * p) != within + 1;
    const Vec3d u = (bone.grid.X_WG().inverse() * p).cwiseQuotient(bone.grid.spacing()).array().round();
    const int density = bone.grid.at(static_cast<int>(u.x()), static_cast<int>(u.y()), static_cast<int>(u.z()));
    if (nearest < -1.2e-3) {
      ++soft;
      wrong += density >= bone.isovalue;
    } else if (nearest > 1.2e-3 && p.z() < -11e-3) {  // below the air cells
      ++solid;
      wrong += density < 1250;
    }
  }
  CHECK(wrong == 0);
  CHECK(soft > 100);
  CHECK(solid > 1000);
}

TEST_CASE("temporal bone: each way meets its structure at its depth, with room to all others") {
  const trephine::Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0.04};
  const MadeStructures made = temporal_bone::structures(burr);
  REQUIRE(made.count() == kCount);
  for (int s = 0; s < kCount; ++s) {
    CAPTURE(s);
    const Approach& way = made.approaches[static_cast<std::size_t>(s)];
    double room = 1;
    for (double depth = 0; depth <= way.depth; depth += 0.05e-3)
      for (int other = 0; other < kCount; ++other)
        if (other != s) room = std::min(room, temporal_bone::distance(other, way.entry_W - depth * Vec3d::UnitZ()));
    CHECK(room > burr.tip_radius + 0.9e-3);
    CHECK(std::abs(temporal_bone::distance(s, way.entry_W - way.depth * Vec3d::UnitZ())) < 2.9e-6);
  }
  CHECK_THROWS_AS((void)temporal_bone::structures({.tip_radius = 8e-3}), std::runtime_error);
}

TEST_CASE("what lies apart from the largest piece is left out where that is asked for, and noted") {
  Options options;
  options.phantom = Phantom::kTemporalBone;
  const Bone whole = load_bone(options);
  options.largest_piece = true;
  const Bone cleaned = load_bone(options);
  REQUIRE(cleaned.notes.size() == whole.notes.size() + 1);
  CHECK(cleaned.notes.back().starts_with("left out: 1 piece apart from the largest one, "));
  const auto voxels = [](const Bone& bone) {
    int count = 0;
    for (int k = 0; k < bone.grid.size()[2]; ++k)
      for (int j = 0; j < bone.grid.size()[1]; ++j)
        for (int i = 0; i < bone.grid.size()[0]; ++i) count += bone.grid.at(i, j, k) >= bone.isovalue ? 1 : 0;
    return count;
  };
  CHECK(voxels(cleaned) > voxels(whole) / 2);
  CHECK(voxels(whole) - voxels(cleaned) > 1000);
}
