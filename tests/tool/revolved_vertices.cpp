// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"

#include <trephine/render/surface/plane_law.hpp>
#include <trephine/tool/line_discretization.hpp>
#include <trephine/tool/named_tools.hpp>
#include <trephine/tool/revolved_vertices.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <type_traits>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

using SurfaceTool = ToolDiscretization<SurfaceCounts, double, RevolvedTool>;

/// Each family at its smallest, a middle and its largest diameter.
std::vector<std::string> names_of_tools() {
  std::vector<std::string> names;
  for (const ToolFamily& f : kToolFamilies)
    for (const double share : {0.0, 0.5, 1.0}) {
      char name[64];
      std::snprintf(name, sizeof(name), "%s-%.4g", std::string(f.name).c_str(), f.least + share * (f.most - f.least));
      names.emplace_back(name);
    }
  return names;
}

/// Unit normal out of the body, from the signed distance alone.
Vec3d normal_at(const ToolOutline& outline, const Vec3d& p) {
  constexpr double kStep = 1e-8;
  const auto distance = [&](const Vec3d& q) { return outline.signed_distance(std::hypot(q.x(), q.y()), q.z()); };
  Vec3d g;
  for (int a = 0; a < 3; ++a) g[a] = distance(p + kStep * Vec3d::Unit(a)) - distance(p - kStep * Vec3d::Unit(a));
  return g.normalized();
}

/// Area of the surface between two heights on the side, by many short cones: of those whose normal meets the axis
/// within the tool, or of all.
double side_area(const ToolOutline& outline, double from, double to, bool all) {
  constexpr int kParts = 20000;
  double area = 0, z = from, rho = outline.radius_at(from);
  for (int i = 1; i <= kParts; ++i) {
    const double next_z = from + (to - from) * i / kParts, next_rho = outline.radius_at(next_z);
    const double height = z + rho * (next_rho - rho) / (next_z - z);
    if (all || outline.signed_distance(0, height) < 0)
      area += std::numbers::pi * (rho + next_rho) * std::hypot(next_rho - rho, next_z - z);
    z = next_z;
    rho = next_rho;
  }
  return area;
}

TEST_CASE("vertices of every named tool lie on its surface, and their springs end on its axis") {
  Figures off_surface, off_normal;
  for (const std::string& name : names_of_tools()) {
    CAPTURE(name);
    const RevolvedTool shape = tool_by_name(name).tool;
    const SurfaceTool tool(shape, {.sphere = 200, .slices = 60, .per_slice = 8});
    const double R = shape.burr().tip_radius;
    REQUIRE(tool.groups().size() > 20);
    CHECK(!tool.has_ball());
    CHECK(tool.groups()[0].height == 0);
    CHECK(tool.groups()[0].radius == R);
    CHECK(tool.groups()[0].count > 20);
    CHECK(tool.count() == tool.periphery() + static_cast<int>(tool.groups().size()));
    int next = 0;
    for (std::size_t g = 0; g < tool.groups().size(); ++g) {
      const auto& group = tool.groups()[g];
      CHECK(group.first == next);
      next += group.count;
      const Vec3d c = tool.points()[group.centre];
      CHECK(c == Vec3d(0, 0, group.height));
      CHECK(shape.outline().signed_distance(0, group.height) < 0);
      for (int i = group.first; i < next; ++i) {
        const Vec3d p = tool.points()[i], d = tool.inward()[i];
        CHECK(tool.group_of(i) == g);
        CHECK(d.norm() == near(1, 1e-15));
        CHECK((p + tool.radius(i) * d - c).norm() < 1e-14 * R);
        CHECK(tool.areas()[static_cast<std::size_t>(i)] > 0);
        off_surface.add(std::abs(shape.outline().signed_distance(std::hypot(p.x(), p.y()), p.z())) / R);
        if (g == 0) {
          const bool is_ball = name.starts_with("round") || name.starts_with("diamond") || name.starts_with("pear");
          CHECK(p.z() <= (is_ball ? R : 1e-6 * R));
          continue;
        }
        off_normal.add((d + normal_at(shape.outline(), p)).norm());
        CHECK(tool.along(i).dot(d) == within(0, 1e-15));
        CHECK(tool.along(i).z() > 0);
        CHECK(tool.along(i).cross(Vec3d::UnitZ()).dot(Vec3d(-p.y(), p.x(), 0).cross(Vec3d::UnitZ())) ==
              within(0, 1e-17));
      }
    }
  }
  MESSAGE("off the surface, in radii: ", off_surface, "; springs of slices off the normal: ", off_normal);
  CHECK(off_surface.worst() < 5e-15);
  CHECK(off_normal.worst() < 4e-10);
}

TEST_CASE("areas of the vertices sum to the tool's surface, without faces that look to the handle") {
  Figures off;
  for (const std::string& name : names_of_tools()) {
    CAPTURE(name);
    const RevolvedTool shape = tool_by_name(name).tool;
    const ToolOutline& outline = shape.outline();
    const SurfaceTool tool(shape, {.sphere = 300, .slices = 200, .per_slice = 8});
    double tip = 0, side = 0;
    for (int i = 0; i < tool.periphery(); ++i)
      (tool.group_of(i) == 0 ? tip : side) += tool.areas()[static_cast<std::size_t>(i)];
    // The tip: a flat end, and what lies between its height and the tip's end by brute force.
    const trephine::detail::VertexPlaces places(shape);
    const double end = outline.place_at(places.tip_end()).z, low = outline.z_low();
    const double flat = outline.pieces()[0].z == outline.pieces()[0].end_z ? outline.pieces()[0].end_rho : 0;
    const double tiny = 1e-9 * (end - low);
    const double exact = std::numbers::pi * flat * flat + side_area(outline, low + tiny, end, true);
    CHECK(tip == near(exact, 4e-5));
    const double springs = side_area(outline, end, outline.z_high() - tiny, false);
    off.add(std::abs(side / springs - 1));
  }
  // A slice stands for all of its length of outline, 0.2 mm, even if a part looks to the handle.
  MESSAGE("sides' areas off: ", off);
  CHECK(off.worst() < 0.05);
}

TEST_CASE("a round burr as a surface of revolution has the vertices of its ball, below the neck") {
  const RevolvedTool shape = RoundBurr{.radius = 1.5e-3};
  const SurfaceCounts counts{.sphere = 400, .slices = 20, .per_slice = 8};
  const SurfaceTool tool(shape, counts);
  const ToolDiscretization<SurfaceCounts, double> ball(Burr{.tip_radius = 1.5e-3, .shaft_length = 0}, counts);
  int i = 0;
  for (int j = 0; j < ball.periphery(); ++j) {
    const Vec3d p = ball.points()[j];
    if (i == tool.groups()[0].count || (tool.points()[i] - p).norm() > 1e-12) continue;
    CHECK(tool.areas()[static_cast<std::size_t>(i)] == near(ball.areas()[static_cast<std::size_t>(j)], 3e-3));
    ++i;
  }
  CHECK(i == tool.groups()[0].count);
  CHECK(i > 300);
}

/// Force over k of all groups pressed straight down into a half space by `depth`, along its normal.
template <class Tool>
double pressed(const Tool& tool, double depth) {
  double sum = 0;
  for (std::size_t g = 0; g < tool.groups().size(); ++g) {
    const auto& group = tool.groups()[g];
    // Group g's own depth counts from its foremost place along the normal.
    const double own = depth - tool.groups()[0].radius - group.height + group.radius;
    sum += plane_law(tool, g, own, Vec3d::UnitZ()).z();
  }
  return sum;
}

/// The same in the continuum: each place's depth times its area, where it faces the half space.
double pressed_continuum(const ToolOutline& outline, double depth) {
  constexpr int kParts = 20000;
  const double step = outline.side_length() / kParts;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const ToolOutline::Place at = outline.place_at((i + 0.5) * step);
    const double below = depth - (at.z - outline.z_low());
    if (below > 0 && at.normal_z < -0.01) sum += 2 * std::numbers::pi * at.rho * step * below;
  }
  return sum;
}

TEST_CASE("Surface's law of a tip pressed straight down is the continuum's") {
  Figures off;
  for (const std::string& name : names_of_tools()) {
    CAPTURE(name);
    const RevolvedTool shape = tool_by_name(name).tool;
    const SurfaceTool tool(shape, {.sphere = 4000, .slices = 200, .per_slice = 16});
    const double R = shape.burr().tip_radius;
    for (const double share : {0.1, 0.2, 0.35}) {
      const double exact = pressed_continuum(shape.outline(), share * R);
      CAPTURE(share);
      const double found = pressed(tool, share * R);
      CHECK(found == near(exact, 0.012));
      off.add(std::abs(found / exact - 1));
    }
  }
  MESSAGE("force off the continuum's: ", off);
  // A half ball and a flat end in closed form: kπRδ², and at least kπ(R − r)²δ within the rim r.
  const double R = 1.5e-3, depth = 0.3 * R;
  CHECK(pressed_continuum(static_cast<RevolvedTool>(MatchHead{.radius = R}).outline(), depth) ==
        near(std::numbers::pi * R * depth * depth, 1.5e-6));
  CHECK(pressed_continuum(static_cast<RevolvedTool>(CylinderBurr{.radius = R, .rim_radius = R / 1000}).outline(),
                          depth) == near(std::numbers::pi * R * R * depth, 3e-3));
}

TEST_CASE("Line's vertices of a tool are those of a burr of its size, and its head cuts") {
  const NamedTool named = tool_by_name("match-head-3");
  const ToolDiscretization line{named.tool, LineCounts{.shaft = 30}};
  static_assert(std::is_same_v<decltype(line), const ToolDiscretization<LineCounts, float, RevolvedTool>>);
  const ToolDiscretization burr{named.tool.burr(), LineCounts{.shaft = 30}};
  CHECK(line.heights() == burr.heights());
  CHECK(line.cutting_head().outline.z_high() == named.tool.cutting_head(0).outline.z_high());

  const ToolDiscretization surface{PearBurr{}, SurfaceCounts{}};
  static_assert(std::is_same_v<decltype(surface), const ToolDiscretization<SurfaceCounts, float, RevolvedTool>>);
}

TEST_CASE("counts out of range are refused for a tool as for a burr") {
  const RevolvedTool tool = MatchHead{};
  const auto surface = [&](int sphere, int slices, int per_slice) {
    (void)SurfaceTool(tool, {.sphere = sphere, .slices = slices, .per_slice = per_slice});
  };
  CHECK_THROWS_WITH(surface(3, 10, 8), "trephine::ToolDiscretization: sphere vertices must be 4 to 100000, got 3");
  CHECK_THROWS_AS(surface(26, 0, 8), std::invalid_argument);
  CHECK_THROWS_AS(surface(26, 10, 2), std::invalid_argument);
}

}  // namespace
