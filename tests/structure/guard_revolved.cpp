// SPDX-License-Identifier: MIT
// A guard round tools of every shape: it misses no part of them, and how much it takes for a part.
#include "structure/phantom.hpp"
#include "support/figures.hpp"
#include "support/random.hpp"

#include <trephine/core/units.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr unsigned kSeed = 419;
constexpr double kReach = 11_mm, kMargin = 1_mm, kRadius = 1.6_mm;
const Vec3d kCentre = Vec3d::Constant(10.05e-3);
// What a guard's distance to this ball may be off: its labels, and the smoothing, which is .06 mm here.
constexpr double kError = 0.15_mm;

const std::shared_ptr<const StructureField>& ball() {
  static const std::shared_ptr<const StructureField> field =
      LabelledTubes{.tubes = {{kCentre, kCentre, kRadius}}, .structure = {0}, .size = {68, 68, 68}}.field(kReach);
  return field;
}

/// Least distance of the tool from the ball [m]: exact.
double distance_of(const RevolvedTool& tool, const Posed& X_ST) {
  const Vec3d p = X_ST.inverse(Eigen::Isometry) * kCentre;
  return tool.outline().signed_distance(p.head<2>().norm(), p.z()) - kRadius;
}

/// A pose in which a random place of the tool's surface is about `distance` from the ball.
Posed pose_at(const RevolvedTool& tool, double distance, Random& random) {
  const ToolBounds b = tool.bounds();
  // Half of the places are on the head.
  const double top = random.uniform() < 0.5 ? b.head_top : b.z_high;
  const double z = b.z_low + (top - b.z_low) * random.uniform();
  const double from = 2 * b.radius, a = 2 * std::acos(-1.0) * random.uniform();
  const double lean = std::acos(-1.0) * (random.uniform() - 0.5);
  // From the axis outward until the ball is as far as asked for.
  Vec3d out(std::cos(a) * std::cos(lean), std::sin(a) * std::cos(lean), std::sin(lean));
  double lo = 0, hi = from + kRadius + distance + b.z_high;
  const auto off = [&](double t) {
    const Vec3d p = Vec3d(0, 0, z) + t * out;
    return tool.outline().signed_distance(p.head<2>().norm(), p.z()) - kRadius - distance;
  };
  for (int i = 0; i < 60; ++i) {
    const double t = (lo + hi) / 2;
    (off(t) < 0 ? lo : hi) = t;
  }
  const Mat3d R = random.rotation();
  return make_pose<double>(R, Vec3d(kCentre - R * (Vec3d(0, 0, z) + lo * out)));
}

/// How deep a guard takes the tool to be in the margin [m]; 0: not at all.
double depth_of(const GuardPotential& guard, const Posed& X_ST) {
  std::vector<GuardPotential::Push> pushes(guard.most_pushes());
  std::vector<AxisProbe> probes(guard.most_probes());
  const std::size_t count = guard.find(X_ST, pushes, probes).pushes;
  double depth = 0;
  for (std::size_t i = 0; i < count; ++i) depth = std::max(depth, pushes[i].depth);
  return depth;
}

}  // namespace

TEST_CASE("a guard holds all of a tool: nothing of it comes into a margin unseen") {
  CAPTURE(kSeed);
  Random random(kSeed);
  const std::vector<GuardedStructure> guarded{{.margin = kMargin}};
  // By how much its balls may reach beyond the tool, from the tip to 5 mm below the chuck [mm].
  struct Bound {
    std::string name;
    double beyond;
  };
  for (const Bound& bound : std::vector<Bound>{{"round-3", 0.15},
                                               {"round-1", 0.45},
                                               {"match-head-3", 0.35},
                                               {"match-head-1.5", 0.35},
                                               {"pear-2.3", 0.35},
                                               {"cylinder-2", 0.35},
                                               {"taper-2", 0.5},
                                               {"barrel-6", 0.8},
                                               {"disc-10", 5.8},
                                               {"twist-3.2", 0.3},
                                               {"reamer-8", 1}}) {
    const std::string& tool_name = bound.name;
    CAPTURE(tool_name);
    const RevolvedTool tool = tool_by_name(tool_name).tool;
    const GuardPotential guard(ball(), Posed::Identity(), tool, guarded);
    int in_margin = 0;
    double least = 1, most = -1, short_by = 0;
    for (int n = 0; n < 2000; ++n) {
      const Posed X = pose_at(tool, random.uniform(-0.5_mm, 1.5_mm), random);
      const double distance = distance_of(tool, X), depth = depth_of(guard, X);
      if (distance < kMargin - kError) {
        ++in_margin;
        CHECK(depth > 0);
        least = std::min(least, depth - (kMargin - distance));
      }
      const bool at_chuck = (X.inverse(Eigen::Isometry) * kCentre).z() > tool.bounds().z_high - 5.0_mm;
      if (depth > 0 && !at_chuck) most = std::max(most, depth - (kMargin - distance));
      const double told = tool_distance(*ball(), guard.burr(), X).distance;
      CHECK(told <= distance + kError);
      if (!at_chuck) short_by = std::max(short_by, distance - told);
    }
    documented("guarded_tools", tool_name + " / Balls beyond it", 1e3 * most);
    documented("guarded_tools", tool_name + " / Distance short by", 1e3 * short_by);
    MESSAGE(tool_name, ": deeper than it is by ", 1e3 * least, " to ", 1e3 * most, " mm");
    CHECK(in_margin > 500);
    CHECK(least >= -kError);
    CHECK(1e3 * most <= bound.beyond);
  }
}

TEST_CASE("a guard of a burr's measures misses what is beside its ball: another tool must be given itself") {
  const RevolvedTool disc = tool_by_name("disc-6").tool;
  const std::vector<GuardedStructure> guarded{{.margin = kMargin}};
  const GuardPotential whole(ball(), Posed::Identity(), disc, guarded);
  const GuardPotential of_burr(ball(), Posed::Identity(), disc.burr(), guarded);
  // The disc's rim over the ball.
  const Posed X = make_pose<double>(Mat3d::Identity(), Vec3d(kCentre + Vec3d(-3.0_mm, 0, kRadius + 0.5_mm + 3.0_mm)));
  CHECK(distance_of(disc, X) < kMargin - kError);
  CHECK(depth_of(whole, X) > 0);
  CHECK(depth_of(of_burr, X) == 0);
}

TEST_CASE("a guard takes measures of a tool, and tells the reach that it needs") {
  const std::vector<GuardedStructure> guarded{{.margin = kMargin}};
  const MatchHead measures{};
  const RevolvedTool tool = measures;
  const GuardPotential a(ball(), Posed::Identity(), measures, guarded), b(ball(), Posed::Identity(), tool, guarded);
  CHECK(a.burr().tip_radius == b.burr().tip_radius);
  CHECK(a.stiffness() == b.stiffness());
  for (const char* name : {"round-3", "disc-10", "reamer-8"}) {
    const RevolvedTool named = tool_by_name(name).tool;
    const double reach = GuardPotential::required_reach(named, kMargin, 0.6_mm);
    const auto field = LabelledTubes{.tubes = {{kCentre, kCentre, kRadius}}, .structure = {0}, .size = {68, 68, 68}};
    CHECK_NOTHROW(GuardPotential(field.field(reach), Posed::Identity(), named, guarded));
    CHECK_THROWS_AS(GuardPotential(field.field(0.9 * reach), Posed::Identity(), named, guarded), std::invalid_argument);
  }
}
