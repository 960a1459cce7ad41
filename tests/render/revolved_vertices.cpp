// SPDX-License-Identifier: MIT
// Line and Surface with tools of every shape.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"
#include "support/revolved_tools.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/tool/revolved_vertices.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <utility>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 911;

TEST_CASE("any shape: measures make Line and Surface renderers that cut with the tool's head") {
  using Line = decltype(LineApproxRenderer{ToolDiscretization{MatchHead{}, LineCounts{}}, LineOptions{}});
  using Surface = decltype(SurfaceApproxRenderer{ToolDiscretization{TwistDrill{}, SurfaceCounts{}}});
  static_assert(std::same_as<std::remove_cvref_t<decltype(std::declval<Line>().cutting_head())>, CuttingHead>);
  static_assert(std::same_as<std::remove_cvref_t<decltype(std::declval<Surface>().cutting_head())>, CuttingHead>);
  static_assert(
      std::same_as<decltype(LineApproxRenderer{ToolDiscretization{Burr{}, LineCounts{}}}), LineApproxRenderer<float>>);
  static_assert(std::same_as<decltype(SurfaceApproxRenderer{ToolDiscretization{Burr{}, SurfaceCounts{}}}),
                             SurfaceApproxRenderer<float>>);
}

// Pressed straight down, each place of the tip bears its depth times its area: the renderer's constant is chosen so
// that this is the stated stiffness at half a radius.
TEST_CASE("Surface, any shape: pressed down on a plane it gives the outline's force") {
  CAPTURE(kSeed);
  Random random(kSeed);
  Figures force, direction;
  for (const ToolOfShape& t : revolved_tools()) {
    CAPTURE(t.name);
    const ToolOutline& outline = t.tool.outline();
    const double R = t.tool.burr().tip_radius;
    const auto outline_force = [&](double depth) {
      constexpr int kParts = 20000;
      const double step = outline.side_length() / kParts;
      double sum = 0;
      for (int i = 0; i < kParts; ++i) {
        const ToolOutline::Place at = outline.place_at((i + 0.5) * step);
        const double below = depth - (at.z - outline.z_low());
        if (below > 0 && at.normal_z < -0.1) sum += at.rho * below;
      }
      return sum;
    };
    for (int n = 0; n < cases(9); ++n) {
      const ImageOptions o{.size = {60, 60, 60}, .sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1};
      const Vec3d normal = random.unit(), at = o.near_middle(random);
      Bone bone = image(HalfSpace{at, normal}, o);
      const ToolDiscretization<SurfaceCounts, double, RevolvedTool> tool(t.tool, SurfaceCounts{});
      HapticScene scene{bone, kIso, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = kK}}};
      const Mat3d frame = tool_at(Vec3d::Zero(), normal).linear();
      const auto press = [&](double depth) {
        return scene.tick({.X_WT = make_pose<double>(frame, at + (R - depth) * normal)}, kDt);
      };
      press(-3 * kH);
      for (const double share : {0.2, 0.35, 0.5}) {
        const double depth = share * R;
        const TickResult r = press(depth);
        CHECK(r.status == Status::kOk);
        const double expected = kK * R / 2 * outline_force(depth) / outline_force(R / 2);
        force.add(std::abs(r.wrench.force.norm() / expected - 1));
        direction.add(180 / kPi * std::acos(std::min(1.0, r.wrench.force.normalized().dot(normal))));
      }
    }
  }
  MESSAGE("force off the outline's ", force, "; off the normal by [deg] ", direction);
  documented("surface_tools", "Force straight down, against the outline's", force, 100);
  CHECK(force.worst() <= 0.1);
  CHECK(direction.worst() <= 3);
}

// A tilted tool touches with its rim or its side. Springs of the tip point to T's origin, not along the normal: a flat
// end's by up to 45° off it.
TEST_CASE("Surface, any shape: tilted on a plane it pushes out of the bone") {
  CAPTURE(kSeed);
  Random random(kSeed + 2);
  Figures balls, flats, tapers;
  for (const ToolOfShape& t : revolved_tools()) {
    CAPTURE(t.name);
    Figures direction;
    for (int n = 0; n < cases(24); ++n) {
      const ImageOptions o{.size = {60, 60, 60}, .sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1};
      const Vec3d normal = random.unit(), at = o.near_middle(random);
      const double tilt = (10 + 60 * random.uniform()) * kPi / 180;
      const Vec3d axis = std::cos(tilt) * normal + std::sin(tilt) * normal.cross(random.unit()).normalized();
      const Mat3d frame = tool_at(Vec3d::Zero(), axis).linear();
      Bone bone = image(HalfSpace{at, normal}, o);
      const ToolDiscretization<SurfaceCounts, double, RevolvedTool> tool(t.tool, SurfaceCounts{});
      HapticScene scene{bone, kIso, SurfaceApproxRenderer{tool, SurfaceOptions{.stiffness = kK}}};
      const double low = lowest_height(t.tool, axis, normal);
      for (int i = -20; i <= 40; ++i) {
        const double depth = i * 2e-5;
        const TickResult r = scene.tick({.X_WT = make_pose<double>(frame, at - (low + depth) * normal)}, kDt);
        CHECK(r.status == Status::kOk);
        if (depth < 3e-4) continue;
        CHECK(r.wrench.force.dot(normal) > 0);
        direction.add(180 / kPi * std::acos(std::min(1.0, r.wrench.force.normalized().dot(normal))));
      }
    }
    MESSAGE(t.name, ": off the normal by [deg] ", direction);
    const bool has_ball = t.name == "match head" || t.name == "pear";
    CHECK(direction.worst() <= (has_ball ? 3 : 45));
    for (const double d : direction.all()) (has_ball ? balls : t.name == "taper" ? tapers : flats).add(d);
  }
  documented("surface_tools", "Tilted 10 to 70°, off the normal: match head, pear", balls);
  documented("surface_tools", "– cylinder, barrel, disc, drill, reamer", flats);
  documented("surface_tools", "– taper", tapers);
}

template <class Renderer>
auto milled(Bone& bone, const Renderer& renderer, const Vec3d& from, const Mat3d& frame, const Vec3d& way) {
  HapticScene scene{bone, kIso, renderer, Cutting{}};
  TickResult r;
  constexpr int kTicks = 400;
  for (int i = 0; i <= kTicks; ++i)
    r = scene.tick({.X_WT = make_pose<double>(frame, from + (i * 1.0 / kTicks) * way), .spindle_on = true}, kDt);
  return r;
}

TEST_CASE("Line and Surface, any shape: a plunge leaves the hole of the tool's own head" *
          doctest::test_suite("long")) {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  Figures holes;
  for (const ToolOfShape& t : revolved_tools()) {
    CAPTURE(t.name);
    Figures line_off, surface_off;
    for (int n = 0; n < cases(3); ++n) {
      const ImageOptions o{.size = {60, 60, 60}};
      const Vec3d normal = random.unit(), at = o.near_middle(random);
      const Mat3d frame = tool_at(Vec3d::Zero(), normal).linear();
      const double R = t.tool.burr().tip_radius;
      const Vec3d from = at + R * normal, way = -2e-3 * normal;
      const auto off = [&](const auto& renderer, Figures& figures) {
        Bone bone = image(HalfSpace{at, normal}, o);
        milled(bone, renderer, from, frame, way);
        // Below the surface the bone's isosurface is the swept head: at places of the head's tip, at the last pose.
        const ToolOutline& head = renderer.cutting_head().outline;
        const DensityField<std::int16_t, double> field(bone, kIso);
        for (int i = 0; i < 60; ++i) {
          const ToolOutline::Place p = head.place_at(random.uniform() * head.side_length());
          const double turn = 2 * kPi * random.uniform();
          const Vec3d out(std::cos(turn), std::sin(turn), 0);
          const Vec3d place = from + way + frame * (p.rho * out + p.z * Vec3d::UnitZ());
          if (p.normal_z > -0.2 || normal.dot(place - at) > -4 * kH) continue;
          const Vec3d n_T = p.normal_rho * out + p.normal_z * Vec3d::UnitZ();
          const Vec3d step = 0.25 * kH * (frame * n_T);
          // The crossing from air to bone along the normal.
          double before = field.value(place - 8 * step);
          int k = -8;
          for (; k < 8; ++k) {
            const double next = field.value(place + (k + 1) * step);
            if (next >= 0) {
              figures.add(std::abs(0.25 * (k + before / (before - next))));
              break;
            }
            before = next;
          }
          CHECK(k < 8);
        }
      };
      off(LineApproxRenderer{ToolDiscretization<LineCounts, double, RevolvedTool>(t.tool, LineCounts{})}, line_off);
      off(SurfaceApproxRenderer{ToolDiscretization<SurfaceCounts, double, RevolvedTool>(t.tool, SurfaceCounts{})},
          surface_off);
    }
    MESSAGE(t.name, ": hole off the head [voxels]: line ", line_off, ", surface ", surface_off);
    // A rim or a point with a radius of one voxel is rounded off by the cut's slope.
    for (const Figures* off : {&line_off, &surface_off}) {
      for (const double d : off->all()) holes.add(d);
      CHECK(off->median() <= 0.1);
      CHECK(off->worst() <= 0.3);
    }
  }
  documented("surface_tools", "Hole of a plunge off the head", holes);
}

}  // namespace
