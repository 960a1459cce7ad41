// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"
#include "support/profile.hpp"
#include "support/raster.hpp"

#include <trephine/tool/ball_and_shaft.hpp>

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 301;
constexpr double kPi = 3.14159265358979323846;
constexpr double kRadius = 0.0015;

struct Named {
  std::string name;
  Burr burr;
};
const std::array<Named, 4> kBurrs{
    Named{"drill", {.tip_radius = kRadius, .shaft_radius = 0.0008, .shaft_length = 0.012}},
    Named{"ball alone", {.tip_radius = kRadius, .shaft_radius = 0.0008, .shaft_length = 0}},
    Named{"thick shaft", {.tip_radius = 0.0005, .shaft_radius = 0.001, .shaft_length = 0.005}},
    Named{"shaft as thick", {.tip_radius = 0.001, .shaft_radius = 0.001, .shaft_length = 0.005}}};

/// What the tool answers for one point.
ProfilePoint answer(const BallAndShaft& tool, double rho, double z) { return profile_at(tool, rho, z); }

struct InHalfPlane {
  double rho, z;
};

bool in_ball(const Burr& b, const InHalfPlane& p) { return std::hypot(p.rho, p.z) < b.tip_radius; }
bool in_shaft(const Burr& b, const InHalfPlane& p) {
  return b.has_shaft() && p.rho < b.shaft_radius && p.z > 0 && p.z < b.shaft_length;
}

/// The outline of ball and shaft together, a point every `step` at least.
std::vector<InHalfPlane> outline(const Burr& b, double step) {
  std::vector<InHalfPlane> all;
  const auto line = [&](const InHalfPlane& from, const InHalfPlane& to) {
    const int n = static_cast<int>(std::hypot(to.rho - from.rho, to.z - from.z) / step) + 1;
    for (int i = 0; i <= n; ++i) {
      const double s = static_cast<double>(i) / n;
      const InHalfPlane p{from.rho + s * (to.rho - from.rho), from.z + s * (to.z - from.z)};
      if (!in_ball(b, p)) all.push_back(p);
    }
  };
  const int n = static_cast<int>(kPi * b.tip_radius / step) + 1;
  for (int i = 0; i <= n; ++i) {
    const double angle = kPi * i / n;
    const InHalfPlane p{b.tip_radius * std::sin(angle), -b.tip_radius * std::cos(angle)};
    if (!in_shaft(b, p)) all.push_back(p);
  }
  if (!b.has_shaft()) return all;
  const double r = b.shaft_radius, L = b.shaft_length;
  line({0, 0}, {r, 0});
  line({r, 0}, {r, L});
  line({r, L}, {0, L});
  return all;
}

/// A point about the tool: from well inside to three radii outside.
InHalfPlane random_place(Random& random, const Burr& b) {
  const double wide = 3 * std::max(b.tip_radius, b.shaft_radius);
  return {random.uniform(0, wide), random.uniform(-wide, b.shaft_length + wide)};
}

// The nearest point of a surface of revolution lies in the half plane through the point asked about: a sampled outline
// is all of the surface. Samples a step apart overstate a distance d by step²/8 (1/d + 1/R) on an outline of radius R,
// and by half a step at most.
TEST_CASE("ball and shaft: the distance is the nearest point's of the surface outside, a bound of it inside") {
  CAPTURE(kSeed);
  constexpr double kStep = 2e-6, kSampling = kStep / 2, kRounding = 1e-17;
  for (const auto& case_of : kBurrs) {
    CAPTURE(case_of.name);
    const Burr& burr = case_of.burr;
    const BallAndShaft tool(burr);
    const auto surface = outline(burr, kStep);
    Random random(kSeed);
    Figures outside, on;
    int inside = 0, wrong_side = 0, beyond_bound = 0;
    double over = 0;  // of what sampling explains
    for (int i = 0; i < 3000; ++i) {
      const InHalfPlane p = random_place(random, burr);
      double nearest = 1;
      for (const InHalfPlane& q : surface) nearest = std::min(nearest, std::hypot(p.rho - q.rho, p.z - q.z));
      const double d = answer(tool, p.rho, p.z).distance;
      if (in_ball(burr, p) || in_shaft(burr, p)) {
        ++inside;
        wrong_side += d <= 0 ? 0 : 1;
        beyond_bound += -d <= nearest + kRounding ? 0 : 1;
        continue;
      }
      wrong_side += d >= 0 ? 0 : 1;
      beyond_bound += nearest - d >= -kRounding ? 0 : 1;
      const double by_sampling = kStep * kStep / 8 * (1 / std::max(d, 1e-9) + 1 / burr.tip_radius);
      over = std::max(over, nearest - d - std::min(kSampling, by_sampling));
      outside.add(std::abs(d - nearest));
    }
    CHECK(wrong_side == 0);
    CHECK(beyond_bound == 0);
    CHECK(over <= kRounding);
    for (const InHalfPlane& q : surface) on.add(std::abs(answer(tool, q.rho, q.z).distance));
    CHECK(on.worst() <= kRounding);
    CHECK(inside > 50);
    MESSAGE(case_of.name, ": off the sampled surface's distance [m] ", outside, "; of points on it ", on.worst());
  }
}

// All within one part of the tool: where the nearest part changes inside, the distance has a crease.
bool same_part(const ProfilePoint& a, const ProfilePoint& b) {
  return a.central == b.central && (a.curvature == 0) == (b.curvature == 0) &&
         (a.normal_rho == 0) == (b.normal_rho == 0) && a.normal_rho * b.normal_rho + a.normal_z * b.normal_z > 0.9;
}

TEST_CASE("ball and shaft: normal and curvature are the distance's derivatives") {
  CAPTURE(kSeed);
  // Central differences over 1 µm leave step²/6 of the third derivative, 2/r³ with r the distance from what the level
  // lines are round: at .1 mm that is 3e-4 per mm. Rounding of 1e-18 m over step² is 1e-6 of 1/m.
  constexpr double kStep = 1e-6, kNearest = 1e-4, kNormalError = 7e-5, kCurvatureError = 2e-4, kUnit = 6e-16;
  for (const auto& case_of : kBurrs) {
    CAPTURE(case_of.name);
    const Burr& burr = case_of.burr;
    const BallAndShaft tool(burr);
    Random random(kSeed + 1);
    Figures normal, curvature, length;
    int creases = 0;
    for (int i = 0; i < 5000; ++i) {
      InHalfPlane p = random_place(random, burr);
      p.rho += kNearest;
      const ProfilePoint at = answer(tool, p.rho, p.z);
      if (at.curvature > 1 / kNearest) continue;
      const ProfilePoint e = answer(tool, p.rho + kStep, p.z), w = answer(tool, p.rho - kStep, p.z);
      const ProfilePoint n = answer(tool, p.rho, p.z + kStep), s = answer(tool, p.rho, p.z - kStep);
      if (!same_part(at, e) || !same_part(at, w) || !same_part(at, n) || !same_part(at, s)) {
        ++creases;
        continue;
      }
      length.add(std::abs(std::hypot(at.normal_rho, at.normal_z) - 1));
      normal.add(std::hypot((e.distance - w.distance) / (2 * kStep) - at.normal_rho,
                            (n.distance - s.distance) / (2 * kStep) - at.normal_z));
      // Of a unit normal the divergence is the level line's curvature.
      const double bend = (e.normal_rho - w.normal_rho + n.normal_z - s.normal_z) / (2 * kStep);
      curvature.add(std::abs(bend - at.curvature) / std::max(at.curvature, 1.0));
    }
    MESSAGE(case_of.name, ": normal off its difference ", normal, "; curvature ", curvature);
    CHECK(normal.count() > 4000);
    CHECK(creases < 18);
    CHECK(length.worst() <= kUnit);
    CHECK(normal.worst() <= kNormalError);
    CHECK(curvature.worst() <= kCurvatureError);
  }
}

TEST_CASE("ball and shaft: a part is central where the nearest is the ball") {
  for (const auto& case_of : kBurrs) {
    CAPTURE(case_of.name);
    const Burr& burr = case_of.burr;
    const BallAndShaft tool(burr);
    CHECK(answer(tool, 0, -burr.tip_radius).central);
    CHECK(answer(tool, 0, -2 * burr.tip_radius).central);
    if (!burr.has_shaft()) continue;
    CHECK_FALSE(answer(tool, burr.shaft_radius, 0.8 * burr.shaft_length).central);
    CHECK_FALSE(answer(tool, 0, burr.shaft_length).central);
  }
  // The centre has no direction: what is answered is finite.
  const ProfilePoint centre = answer(BallAndShaft(kBurrs[1].burr), 0, 0);
  CHECK(centre.distance == -kRadius);
  CHECK(std::isfinite(centre.curvature));
  CHECK(std::hypot(centre.normal_rho, centre.normal_z) <= 1);
}

TEST_CASE("ball and shaft: every lane answers for its own point, distances alone are the profile's") {
  CAPTURE(kSeed);
  // A rounding of lengths up to 20 mm.
  constexpr double kRounding = 0.02 * static_cast<double>(std::numeric_limits<float>::epsilon());
  for (const auto& case_of : kBurrs) {
    CAPTURE(case_of.name);
    const Burr& burr = case_of.burr;
    const BallAndShaft tool(burr);
    Random random(kSeed + 2);
    Figures off;
    int differ = 0;
    for (int round = 0; round < 100; ++round) {
      ProfileLanes<double> rho, z;
      ProfileLanes<float> rho_f, z_f, distance;
      for (std::size_t i = 0; i < kProfileLanes; ++i) {
        const InHalfPlane p = random_place(random, burr);
        rho_f[i] = static_cast<float>(p.rho);
        z_f[i] = static_cast<float>(p.z);
        rho[i] = static_cast<double>(rho_f[i]);
        z[i] = static_cast<double>(z_f[i]);
      }
      Profile many;
      tool.profile(rho, z, many);
      tool.distances(rho_f, z_f, distance);
      for (std::size_t i = 0; i < kProfileLanes; ++i) {
        const ProfilePoint one = answer(tool, rho[i], z[i]);
        differ += many.distance[i] == one.distance && many.normal_rho[i] == one.normal_rho &&
                          many.normal_z[i] == one.normal_z && many.curvature[i] == one.curvature &&
                          many.central[i] == (one.central ? 1 : 0)
                      ? 0
                      : 1;
        off.add(std::abs(static_cast<double>(distance[i]) - one.distance));
      }
    }
    MESSAGE(case_of.name, ": distances alone against the profile's [m] ", off);
    CHECK(differ == 0);
    CHECK(off.worst() <= kRounding);
  }
}

TEST_CASE("ball and shaft: its bounds hold its surface, its core lies that deep") {
  for (const auto& case_of : kBurrs) {
    CAPTURE(case_of.name);
    const Burr& burr = case_of.burr;
    const BallAndShaft tool(burr);
    const ToolBounds b = tool.bounds();
    constexpr double kRounding = 1e-15;
    double low = 1, high = -1, radius = 0, core = 1;
    for (const InHalfPlane& p : outline(burr, 1e-5)) {
      low = std::min(low, p.z);
      high = std::max(high, p.z);
      radius = std::max(radius, p.rho);
      // The axis' part that is core_radius inside of both ends.
      const double along = std::clamp(p.z, b.z_low + b.core_radius, std::max(b.z_high - b.core_radius, 0.0));
      core = std::min(core, std::hypot(p.rho, p.z - along));
    }
    CHECK(b.z_low <= low + kRounding);
    CHECK(b.z_high >= high - kRounding);
    CHECK(b.radius >= radius - kRounding);
    CHECK(b.z_low == near(low));
    CHECK(b.z_high == near(high));
    CHECK(b.radius == near(radius));
    // Within the outline's step.
    CHECK(core >= b.core_radius - 1e-7);
  }
}

TEST_CASE("ball and shaft: burrs that are none are refused") {
  const double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -1e-3, nan, inf}) {
    CHECK_THROWS_AS(BallAndShaft(Burr{.tip_radius = bad}), std::invalid_argument);
    CHECK_THROWS_AS(BallAndShaft(Burr{.shaft_radius = bad}), std::invalid_argument);
    if (bad != 0) CHECK_THROWS_AS(BallAndShaft(Burr{.shaft_length = bad}), std::invalid_argument);
  }
  CHECK_THROWS_AS(BallAndShaft(Burr{.shaft_length = 0.0015}), std::invalid_argument);  // within the ball
  CHECK_NOTHROW(BallAndShaft(Burr{.shaft_radius = nan, .shaft_length = 0}));           // a ball needs none
  CHECK(answer(BallAndShaft(Burr{.shaft_radius = nan, .shaft_length = 0}), 0.002, 0).distance == near(0.0005));
}

}  // namespace
