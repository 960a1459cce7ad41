// SPDX-License-Identifier: MIT
// Distances of lanes of points, and the bound of a motion that they give.
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/poses.hpp"
#include "support/profile.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/render/coupled/clearance.hpp>
#include <trephine/render/coupled/tool_distances.hpp>
#include <trephine/tool/ball_and_shaft.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 335;
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

double distance(const BallAndShaft& shape, const Posed& X, const Vec3d& q) {
  const Vec3d in_T = X.inverse() * q;
  return profile_at(shape, in_T.head<2>().norm(), in_T.z()).distance;
}

TEST_CASE("tool distances: points and spheres in lanes have the tool's signed distance in its own frame") {
  CAPTURE(kSeed);
  constexpr double kSingle = 2e-8;  // [m] of places within 5 cm
  Random random(kSeed);
  const BallAndShaft shape(kDrill);
  constexpr std::size_t kSpheres = 37;  // no multiple of the lanes
  SphereLanes spheres;
  spheres.reserve(kSpheres);
  Figures off, arm_off;
  for (int i = 0; i < 50; ++i) {
    const Posed X = random_pose(random, Vec3d::Zero(), 0.01);
    const Vec3d origin = random.arrow(0, 0.01);  // of the points, in G
    const Vec3<float> shift = (origin - X.translation()).cast<float>(), axis = X.linear().col(2).cast<float>();
    std::array<Vec3d, kSpheres> at;
    std::array<float, kProfileLanes> x{}, y{}, z{}, d{};
    for (std::size_t k = 0; k < kSpheres; ++k) {
      at[k] = random.arrow(0, 0.02);
      spheres.set_centre(k, at[k].cast<float>());
      arm_off.add(std::abs(static_cast<double>(spheres.arm(k)) - at[k].norm()));
      if (k >= kProfileLanes) continue;
      x[k] = static_cast<float>(at[k].x());
      y[k] = static_cast<float>(at[k].y());
      z[k] = static_cast<float>(at[k].z());
    }
    spheres.measure(shape, axis, shift, kSpheres);
    compute_distances(shape, axis, shift, x.data(), y.data(), z.data(), d);
    for (std::size_t k = 0; k < kSpheres; ++k) {
      const double exact = distance(shape, X, origin + at[k]);
      off.add(std::abs(static_cast<double>(spheres.distance(k)) - exact));
      if (k < kProfileLanes) off.add(std::abs(static_cast<double>(d[k]) - exact));
    }
  }
  MESSAGE("distance off by [m] ", off);
  CHECK(off.worst() <= kSingle);
  CHECK(arm_off.worst() <= kSingle / 4);
}

TEST_CASE("tool distances: a batch of spheres tells those near a tool, of any number, and starts anew") {
  CAPTURE(kSeed);
  constexpr double kSingle = 2e-8;
  Random random(kSeed + 2);
  const BallAndShaft shape(kDrill);
  SphereBatch<int> batch;
  int near = 0, far = 0, wrong = 0, close_calls = 0;
  for (int i = 0; i < 200; ++i) {
    const Vec3d axis = random.unit();
    const Posed X = tool_at(Vec3d::Zero(), axis);
    const double most = random.uniform(0, 5e-3), turn = random.uniform(0, 0.2);
    const int count = i % (static_cast<int>(kProfileLanes) + 1);
    std::vector<Vec3d> at;
    for (int k = 0; k < count; ++k) {
      at.push_back(X * Vec3d(Vec3d(0, 0, random.uniform(0, 0.02)) + random.arrow(0, 0.012)));
      CHECK_FALSE(batch.is_full());
      batch.add(at.back().cast<float>(), 100 * i + k);
    }
    CHECK(batch.is_full() == (count == static_cast<int>(kProfileLanes)));
    std::vector<bool> told(at.size());
    std::vector<std::pair<int, Vec3<float>>> found;
    batch.flush(shape, axis.cast<float>(), static_cast<float>(most), static_cast<float>(turn),
                [&](int key, const Vec3<float>& centre) { found.emplace_back(key, centre); });
    for (const auto& [key, centre] : found) {
      const auto k = static_cast<std::size_t>(key - 100 * i);
      REQUIRE(k < at.size());
      wrong += centre != at[k].cast<float>() ? 1 : 0;
      told[k] = true;
    }
    CHECK_FALSE(batch.is_full());
    for (std::size_t k = 0; k < at.size(); ++k) {
      const double beyond = distance(shape, X, at[k]) - most - turn * at[k].norm();
      if (std::abs(beyond) < kSingle)
        ++close_calls;
      else
        wrong += told[k] != (beyond < 0) ? 1 : 0;
      (told[k] ? near : far) += 1;
    }
  }
  CHECK(wrong == 0);
  CHECK(near > 300);
  CHECK(far > 300);
  CHECK(close_calls < 5);
}

// Listed points around the drill, and unlisted ones beyond a reach: the fraction brings none deeper than the depth.
TEST_CASE("clearance: a fraction of a motion brings no free point deeper than allowed, and is no smaller than needed") {
  CAPTURE(kSeed);
  constexpr double kRounding = 1e-12;
  Random random(kSeed + 1);
  const BallAndShaft shape(kDrill);
  const double arm = shape.bounds().arm();
  int deeper = 0, tested = 0;
  Figures used;
  for (int i = 0; i < 400; ++i) {
    const Posed X = random_pose(random, Vec3d::Zero(), 0.01);
    const ToolMotion reach{random.uniform(5e-4, 3e-3), random.uniform(0.02, 0.1)};
    Clearance c{.listed_distance = 1, .listed_arm = 0, .unlisted_motion = reach, .unlisted_arm = arm};
    std::vector<Vec3d> points;
    for (int k = 0; k < 60; ++k) {
      const Vec3d q = X * Vec3d(Vec3d(0, 0, random.uniform(-2e-3, 0.021)) + random.arrow(0, 6e-3));
      const double d = distance(shape, X, q), from_origin = (q - X.translation()).norm();
      if (!(d > 0)) continue;
      points.push_back(q);
      // A point that the reach could bring into contact is listed.
      if (d > reach.shift + reach.turn * from_origin) continue;
      c.listed_distance = std::min(c.listed_distance, d);
      c.listed_arm = std::max(c.listed_arm, from_origin);
    }
    const double depth = i % 2 == 0 ? 0 : 4e-4;
    const Vec3d shift = random.arrow(0, 4e-3), rotation = random.arrow(0, 0.15);
    const Posed end = make_pose<double>(rotation_from_vector(rotation) * X.linear(), X.translation() + shift);
    const double fraction = std::min(1.0, c.max_step_fraction(motion_between(X, end), depth));
    const Posed reached = make_pose<double>(rotation_from_vector(Vec3d(fraction * rotation)) * X.linear(),
                                            X.translation() + fraction * shift);
    // A part of a rotation moves the axis by more than that part of the chord, by a thousandth at these angles.
    const double slack = 2e-3 * motion_between(X, reached).at(0.03);
    for (const Vec3d& q : points) deeper += distance(shape, reached, q) < -depth - slack - kRounding ? 1 : 0;
    tested += static_cast<int>(points.size());
    used.add(fraction);
  }
  MESSAGE("fractions ", used, ", least ", used.least(), "; points ", tested);
  CHECK(deeper == 0);
  CHECK(tested > 5000);
  CHECK(used.least() < 0.2);
  // In closed form.
  const Clearance c{.listed_distance = 2e-3, .listed_arm = 0.01, .unlisted_motion = {4e-3, 0.1}, .unlisted_arm = 0.02};
  CHECK(c.max_step_fraction({1e-3, 0}) == near(2));
  CHECK(c.max_step_fraction({0, 0.1}) == near(1));
  CHECK(c.max_step_fraction({1e-3, 0.3}) == near(1.0 / 3));
  CHECK(c.max_step_fraction({1e-3, 0}, 1e-3) == near(3));
  CHECK(c.max_step_fraction({0, 0}) == std::numeric_limits<double>::infinity());
}

}  // namespace
