// SPDX-License-Identifier: MIT
// The coupled tool with tools of every shape.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/near.hpp"
#include "support/revolved_tools.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <optional>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 907;

TEST_CASE("coupled, any shape: measures make a renderer with their tool") {
  static_assert(std::same_as<decltype(CoupledToolRenderer{MatchHead{}}), CoupledToolRenderer<RevolvedTool>>);
  static_assert(std::same_as<decltype(CoupledToolRenderer{TwistDrill{}, CoupledOptions{}, Coulomb(0.3, 0.3)}),
                             CoupledToolRenderer<RevolvedTool, Coulomb>>);
  static_assert(std::same_as<decltype(CoupledToolRenderer{Burr{}}), CoupledToolRenderer<BallAndShaft>>);
}

// A plane yields by the stiffness whatever touches it. Depth counts from where the exact tool touches the plane, which
// a point or a rim sinks into: over a contact smaller than a voxel a third of a voxel yields less force.
TEST_CASE("coupled, any shape: pressed on a plane it gives stiffness times depth along the normal") {
  CAPTURE(kSeed);
  Random random(kSeed);
  CoupledOptions no_torque = kGains;
  no_torque.torque = 0;
  Figures directions, forces;
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    const RevolvedTool& tool = t.tool;
    CAPTURE(name);
    Figures direction, force;
    for (int n = 0; n < cases(9); ++n) {
      const ImageOptions o{.size = {60, 60, 60}, .sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1};
      const Vec3d normal = random.unit(), at = o.near_middle(random);
      Bone bone = image(HalfSpace{at, normal}, o);
      HapticScene scene{bone, kIso, CoupledToolRenderer{tool, no_torque}};
      Vec3d axis = (normal + random.arrow(0, 1)).normalized();
      if (axis.dot(normal) < 0.2) axis = (axis + normal).normalized();
      const Mat3d R = tool_at(Vec3d::Zero(), axis).linear();
      const double low = lowest_height(tool, axis, normal);
      for (int i = -50; i <= 200; ++i) {
        const double depth = i * 1e-5;
        const TickResult r = scene.tick({.X_WT = make_pose<double>(R, at - (low + depth) * normal)}, kDt);
        CHECK(r.status == Status::kOk);
        if (depth < 5e-4) continue;
        direction.add(180 / kPi * std::acos(std::min(1.0, r.wrench.force.normalized().dot(normal))));
        force.add(r.wrench.force.norm() / (kK * depth));
      }
    }
    MESSAGE(name, ": off the normal by [deg] ", direction, ", force over stiffness times depth ", force, ", least ",
            force.least());
    for (const double d : direction.all()) directions.add(d);
    for (const double f : force.all()) forces.add(f);
    CHECK(direction.worst() <= 7);
    CHECK(force.least() >= 0.9);
    CHECK(force.worst() <= 1.1);
    if (kSanitized) continue;  // a median of few planes is another figure
    CHECK(direction.median() <= 1.5);
    CHECK(force.median() >= 0.95);
    CHECK(force.median() <= 1.02);
  }
  documented("tool_quality", "Force over stiffness times depth, on a plane, least", forces.least());
  documented("tool_quality", "Force over stiffness times depth, on a plane, greatest", forces.worst());
  documented("tool_quality", "Direction on a plane, median", directions.median());
  documented("tool_quality", "Direction on a plane, worst", directions.worst());
}

TEST_CASE("coupled, any shape: a plunge cuts room for the tool, which rests in it") {
  CAPTURE(kSeed);
  constexpr double kDepth = 5e-3, kSpeed = 5e-3;
  Random random(kSeed + 1);
  double greatest_rest = 0;
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    const RevolvedTool& tool = t.tool;
    CAPTURE(name);
    const ToolBounds b = tool.bounds();
    const int wide = static_cast<int>(2 * b.radius / kH) + 20;
    const ImageOptions o{.size = {wide, wide, static_cast<int>((kDepth + 4e-3) / kH)}};
    const double top = (o.size[2] - 7 + random.uniform()) * kH;
    Bone bone = image(HalfSpace{Vec3d(0, 0, top), Vec3d::UnitZ()}, o);
    const Vec3d at = o.near_middle(random);
    HapticScene scene{bone, kIso, CoupledToolRenderer{tool, kGains}, Cutting{}};
    double removed = 0, rest = 0, behind = 0;
    const int ticks = static_cast<int>(kDepth / (kSpeed * kDt));
    for (int i = -100; i < ticks + 300; ++i) {
      const Vec3d tip(at.x(), at.y(), top - b.z_low - std::min(i, ticks) * kSpeed * kDt);
      const TickResult r = scene.tick({.X_WT = tool_at(tip, Vec3d::UnitZ()), .spindle_on = true}, kDt);
      CHECK(r.status == Status::kOk);
      removed += r.removed_mm3;
      if (i > 0) behind = std::max(behind, (scene.proxy_pose_W().translation() - tip).norm());
      if (i >= ticks + 200) rest = std::max(rest, r.wrench.force.norm());
    }
    // The hole is as wide at each height as the head below it.
    const ToolOutline head = tool.cutting_head(0).outline;
    double volume = 0, widest = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double z = b.z_low + kDepth * (i + 0.5) / kSteps;
      if (z < head.z_high()) widest = std::max(widest, head.radius_at(z));
      volume += kPi * widest * widest * kDepth / kSteps * 1e9;
    }
    MESSAGE(name, ": at rest ", rest, " N, behind ", behind / kH, " voxels, removed over swept ", removed / volume);
    greatest_rest = std::max(greatest_rest, rest);
    CHECK(rest <= 0.04);
    CHECK(behind <= 0.5 * kH);
    CHECK(removed == near(volume, 0.05));
    // A drill's flank and a burr's shank do not cut: pushed sideways in its hole, the tool is held by the wall.
    if (name != "twist drill") continue;
    double sideways = 0;
    Vec3d force = Vec3d::Zero();
    for (int i = 0; i <= 300; ++i) {
      const Vec3d tip(at.x() + std::min(i, 200) * 2.5e-6, at.y(), top - b.z_low - kDepth);
      const TickResult r = scene.tick({.X_WT = tool_at(tip, Vec3d::UnitZ()), .spindle_on = true}, kDt);
      sideways += r.removed_mm3;
      force = r.wrench.force;
    }
    MESSAGE(name, ": pushed sideways by .5 mm ", force.transpose(), " N, removes ", sideways, " mm3");
    CHECK(-force.x() >= 0.25);
    CHECK(sideways <= 1);  // 8 mm3 if the flank cut
  }
  documented("tool_quality", "Force at rest in the tool's own hole of 5 mm", greatest_rest);
}

// Without friction the force has one energy: a closed path in contact returns what it took.
TEST_CASE("coupled, any shape: closed paths in contact gain nothing") {
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  double worst = 0;
  for (const ToolOfShape& t : revolved_tools()) {
    const std::string& name = t.name;
    const RevolvedTool& tool = t.tool;
    CAPTURE(name);
    const ImageOptions o{.size = {50, 50, 50}};
    const Vec3d normal = random.unit(), at = o.near_middle(random);
    Bone bone = image(HalfSpace{at, normal}, o);
    HapticScene scene{bone, kIso, CoupledToolRenderer{tool, kGains}};
    const Vec3d axis = (normal + random.arrow(0, 0.5)).normalized(), u = normal.unitOrthogonal(), v = normal.cross(u);
    const Mat3d R = tool_at(Vec3d::Zero(), axis).linear();
    const Vec3d touch = at - (lowest_height(tool, axis, normal) + 4e-4) * normal;
    std::optional<PathWork> work;
    constexpr int kTicks = 2000;
    for (int i = -200; i <= kTicks; ++i) {
      const double a = 2 * kPi * std::max(i, 0) / kTicks;
      const Vec3d aside = 8e-4 * (std::sin(a) * u + (1 - std::cos(a)) * v) + 2e-4 * std::sin(2 * a) * normal;
      const double away = i < 0 ? -i * 5e-6 : 0;
      const Mat3d turn = rotation_from_vector(Vec3d(0.1 * std::sin(a) * u + 0.05 * std::sin(3 * a) * v));
      const Posed X = make_pose<double>(turn * R, touch + aside + away * normal);
      const TickResult r = scene.tick({.X_WT = X}, kDt);
      if (i == 0) work.emplace(X, r.wrench);
      if (i > 0) work->go(X, r.wrench);
    }
    MESSAGE(name, ": net work over work ", work->net / work->length);
    CHECK(std::abs(work->net) <= 2.8e-7 * work->length);
    worst = std::max(worst, std::abs(work->net) / work->length);
  }
  documented("tool_quality", "Net work of a closed path, share of the work", worst);
}

}  // namespace
