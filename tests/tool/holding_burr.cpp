// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "support/random.hpp"
#include "support/revolved_tools.hpp"

#include <trephine/tool/ball_and_shaft.hpp>
#include <trephine/tool/holding_burr.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 733;

/// Points of a tool's outline, close together: along level pieces too.
std::vector<std::array<double, 2>> outline_points(const RevolvedTool& tool) {
  constexpr int kSteps = 40000;
  std::vector<std::array<double, 2>> points;
  const ToolOutline& o = tool.outline();
  for (int i = 1; i < kSteps; ++i) {
    const double z = o.z_low() + (o.z_high() - o.z_low()) * i / kSteps;
    points.push_back({o.radius_at(z), z});
  }
  for (const ToolOutline::Piece& p : o.pieces()) {
    points.push_back({p.rho, p.z});
    points.push_back({p.end_rho, p.end_z});
  }
  return points;
}

double distance_to(const Burr& burr, double rho, double z) {
  const double ball = std::hypot(rho, z) - burr.tip_radius;
  if (!burr.has_shaft()) return ball;
  return std::min(ball, std::max({rho - burr.shaft_radius, z - burr.shaft_length, -z}));
}

/// Checks by brute force that a burr holds a tool, and that neither its ball nor its shaft can be smaller.
void check_holds(const RevolvedTool& tool) {
  const Burr burr = holding_burr(tool);
  burr.validate();
  double most = -1, tip = 0, shaft = 0;
  for (const auto& [rho, z] : outline_points(tool)) {
    most = std::max(most, distance_to(burr, rho, z));
    if (z <= 0) tip = std::max(tip, std::hypot(rho, z));
    if (z > 0 && std::hypot(rho, z) > burr.tip_radius * (1 + 1e-8)) shaft = std::max(shaft, rho);
  }
  const double length = tool.outline().z_high() - tool.outline().z_low();
  CHECK(most <= 1e-17);
  CHECK(burr.tip_radius == near(tip, 1.5e-5));
  CHECK(burr.tip_radius >= tip * (1 - 1e-12));
  CHECK(burr.has_shaft() == (shaft > 0));
  if (!burr.has_shaft()) return;
  // A point of the brute force is half a step from a corner at most, where the outline is less steep than an arc's end.
  CHECK(burr.shaft_radius - shaft <= std::sqrt(length / 40000 * burr.tip_radius) / 100);
  // A shaft ends outside its ball, by 1e-9 of it.
  CHECK(burr.shaft_length == near(std::max(tool.outline().z_high(), burr.tip_radius), 1.1e-9));
}

struct RandomPiece {
  bool is_arc;
  double rho, z, centre_rho, centre_z;
};

ToolOutline outline_of(const std::vector<RandomPiece>& pieces, double low) {
  ToolOutline outline(pieces.front().rho, low);
  for (const RandomPiece& p : pieces)
    p.is_arc ? outline.arc_to(p.rho, low + p.z, p.centre_rho, low + p.centre_z) : outline.line_to(p.rho, low + p.z);
  return outline.close();
}

/// A tool of random lines and arcs, and where it begins.
RevolvedTool random_tool(Random& random) {
  for (;;) {
    std::vector<RandomPiece> pieces{{false, random.uniform() < 0.5 ? 0 : 2e-3 * random.uniform(), 0, 0, 0}};
    const int count = 2 + static_cast<int>(6 * random.uniform());
    for (int i = 0; i < count; ++i) {
      const RandomPiece& last = pieces.back();
      const double rho = 3e-3 * random.uniform(), z = last.z + 2e-3 * random.uniform();
      // An arc's centre lies on the bisector of its ends.
      const double off = 8 * random.uniform() - 4;
      pieces.push_back({random.uniform() < 0.5, rho, z, (last.rho + rho) / 2 + off * (z - last.z),
                        (last.z + z) / 2 - off * (rho - last.rho)});
    }
    try {
      const double radius = outline_of(pieces, 0).largest_radius();
      const ToolOutline outline = outline_of(pieces, -radius);
      return RevolvedTool(outline, outline.z_high());
    } catch (const std::invalid_argument&) {
      // No outline: an arc whose centre lies between its ends' radii.
    }
  }
}

}  // namespace

TEST_CASE("holding burr: closed forms") {
  // A ball on a shank is the burr itself.
  const Burr round = holding_burr(RoundBurr{.radius = 2e-3, .shank = {.radius = 1e-3, .length = 0.03}});
  CHECK(round.tip_radius == near(2e-3, 1e-12));
  CHECK(round.shaft_radius == near(1e-3, 1e-12));
  CHECK(round.shaft_length == near(0.03, 1e-12));
  // Half a ball, then a head as wide.
  const Burr match = holding_burr(MatchHead{.radius = 1.5e-3});
  CHECK(match.tip_radius == near(1.5e-3, 1e-12));
  CHECK(match.shaft_radius == near(1.5e-3, 1e-12));
  // A flat end: the rim's arc is farthest along its own centre's direction.
  const Burr flat = holding_burr(CylinderBurr{.radius = 2e-3, .length = 8e-3, .rim_radius = 0.5e-3});
  CHECK(flat.tip_radius == near(1.5e-3 * std::sqrt(2.0) + 0.5e-3, 1e-12));
  CHECK(flat.shaft_radius == near(2e-3, 1e-12));
  // A rod below T's origin, and nothing above it.
  ToolOutline low(1e-3, -1e-3);
  const Burr short_rod = holding_burr(RevolvedTool(low.line_to(1e-3, 0).close(), 0));
  CHECK(short_rod.tip_radius == near(std::sqrt(2.0) * 1e-3, 1e-12));
  CHECK_FALSE(short_rod.has_shaft());
  // A rod that ends where its ball does: the shaft is longer than the rod.
  ToolOutline rod(1e-3, -1e-3);
  const Burr stub = holding_burr(RevolvedTool(rod.line_to(1e-3, 1.2e-3).close(), 1.2e-3));
  CHECK(stub.shaft_radius == near(1e-3, 1e-12));
  CHECK(stub.shaft_length >= stub.tip_radius);
}

TEST_CASE("holding burr: it holds every tool, and neither its ball nor its shaft can be smaller") {
  CAPTURE(kSeed);
  for (const ToolOfShape& t : revolved_tools()) {
    CAPTURE(t.name);
    check_holds(t.tool);
  }
  for (const ToolFamily& family : kToolFamilies)
    for (int i = 0; i <= 8; ++i) {
      const double mm = family.least + (family.most - family.least) * i / 8;
      const std::string name = std::string(family.name) + "-" + std::to_string(mm);
      CAPTURE(name);
      check_holds(tool_by_name(name).tool);
    }
  Random random(kSeed);
  for (int n = 0; n < 300; ++n) {
    CAPTURE(n);
    check_holds(random_tool(random));
  }
}

TEST_CASE("holding burr: how far it reaches beyond each named tool") {
  // Largest distance of the burr's surface from the tool: in front of T's origin, and behind it [mm].
  struct Reach {
    const char* name;
    double front, behind;
  };
  for (const Reach& reach : {Reach{"round-3", 0, 0.28},
                             {"round-1", 0, 0.88},
                             {"diamond-3", 0, 0.28},
                             {"match-head-3", 0, 0.61},
                             {"pear-2.3", 0, 0.49},
                             {"cylinder-2", 0.32, 0.58},
                             {"taper-2", 0.47, 0.64},
                             {"barrel-6", 0.61, 1.73},
                             {"disc-10", 4.6, 5.6},
                             {"twist-3.2", 0.29, 0.1},
                             {"reamer-8", 0.96, 1.01}}) {
    const std::string tool_name = reach.name;
    CAPTURE(tool_name);
    const RevolvedTool tool = tool_by_name(tool_name).tool;
    const Burr burr = holding_burr(tool);
    double front = 0, behind = 0;
    constexpr int kSteps = 4000;
    for (int i = 0; i <= kSteps; ++i) {
      const double a = std::acos(-1.0) * i / kSteps;
      const double rho = burr.tip_radius * std::sin(a), z = burr.tip_radius * std::cos(a);
      double& part = z <= 0 ? front : behind;
      part = std::max(part, tool.outline().signed_distance(rho, z));
      if (burr.has_shaft())
        behind = std::max(behind, tool.outline().signed_distance(burr.shaft_radius, burr.shaft_length * i / kSteps));
    }
    CHECK(1e3 * front <= reach.front + 1e-12);
    CHECK(1e3 * behind <= reach.behind);
  }
}
