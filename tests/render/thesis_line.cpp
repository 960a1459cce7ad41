// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "render/thesis_path.hpp"
#include "support/near.hpp"

#include <trephine/render/thesis/line.hpp>

#include <doctest/doctest.h>

/// The thesis' Line: equations 1 to 14 in closed form, its own answers to its open questions, and values that are
/// stored.
namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.020};

template <class Scalar>
using Tool = ToolDiscretization<LineCounts, Scalar>;

TEST_CASE("Eq. 1 and 2: where a vertex meets the isosurface within a step") {
  CHECK(eq_1_fraction(-30.0, 10.0) == 0.75);
  CHECK(eq_1_fraction(-30.0, 0.0) == 1);
  CHECK(eq_1_fraction(5.0, 10.0) == 0);  // in bone before: not as printed
  CHECK(eq_2_intersection<double>(0.75, Vec3d(0, 0, 4), Vec3d(8, 0, 0)) == Vec3d(6, 0, 1));
}

TEST_CASE("Eq. 3, 4, 5: translated, rotated, and cast lines") {
  const Centreline<double> from{Vec3d(1, 2, 3), Vec3d::UnitZ()}, to{Vec3d(5, 2, 3), Vec3d::UnitX()};
  const auto moved = eq_3_translated(from, to, 0.25);
  CHECK(moved.tip == Vec3d(2, 2, 3));
  CHECK(moved.direction == from.direction);
  const auto turned = eq_4_rotated(from, to, 1.0 / 3);
  CHECK(turned.tip == to.tip);
  CHECK((turned.direction - Vec3d(0.5, 0, std::sqrt(0.75))).norm() < 1e-15);
  CHECK((eq_4_rotated(from, to, 1.0).direction - to.direction).norm() < 1e-15);
  // Half a turn about some perpendicular axis.
  const Centreline<double> back{to.tip, -Vec3d::UnitZ()};
  CHECK(std::abs(eq_4_rotated(from, back, 0.5).direction.z()) < 1e-15);
  const auto cast = eq_5_ray_cast(from, to, 0.5);
  for (const double h : {0.0, 0.7, 2.0}) CHECK((cast.at(h) - 0.5 * (from.at(h) + to.at(h))).norm() < 1e-15);
}

TEST_CASE_TEMPLATE("Eq. 6, 7, 13: the tip on a plane has stiffness times depth, and is drawn on the surface", Scalar,
                   float, double) {
  const Vec3d n = Vec3d(0.2, -0.1, 1).normalized();
  const ShapeField<Scalar, HalfSpace> field({Vec3d::Zero(), n}, kVoxel);
  ThesisLine<Scalar> renderer(Tool<Scalar>(kBurr, {}), {.stiffness = 600});
  const Vec3d lean = (n + 0.4 * n.unitOrthogonal()).normalized();
  const auto out = lead(renderer, field, tool_at(1e-3 * n, lean), tool_at(-4e-4 * n, lean), 60);
  CHECK(out.status == Status::kOk);
  CHECK((in_double(out.wrench).force - 600 * 4e-4 * n).norm() < 600 * 2e-3 * kVoxel);
  CHECK(out.wrench.torque.norm() == 0);
  CHECK(renderer.visual_pose().translation().template cast<double>().dot(n) ==
        near(kBurr.tip_radius, 2e-3 * kVoxel / kBurr.tip_radius));
  CHECK(angle_deg(renderer.visual_pose().linear().col(2).template cast<double>(), lean) < 1e-3);
}

TEST_CASE("friction: dragged along a plane the tip's force stays on Coulomb's cone") {
  constexpr double kFriction = 0.3;
  const ShapeField<double, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  ThesisLine<double> renderer(Tool<double>(kBurr, {}), {.friction = kFriction});
  lead(renderer, field, tool_at(Vec3d(0, 0, 1e-3), Vec3d::UnitZ()), tool_at(Vec3d(0, 0, -5e-4), Vec3d::UnitZ()), 40);
  const auto out = lead(renderer, field, tool_at(Vec3d(0, 0, -5e-4), Vec3d::UnitZ()),
                        tool_at(Vec3d(4e-3, 0, -5e-4), Vec3d::UnitZ()), 80);
  CHECK(-out.wrench.force.x() / out.wrench.force.z() == near(kFriction, 0.01));
}

// A hole of 2 mm radius in a flat face, and a tool whose tip is free in it.
struct Hole {
  double radius = 0.002, depth = 0.004;
  Vec3d top = Vec3d(0.0144, 0.0144, 0.0120);
  [[nodiscard]] auto shape() const {
    return Both{HalfSpace{top, Vec3d::UnitZ()}, Hollow{Rod{top, Vec3d::UnitZ(), radius}}};
  }
  [[nodiscard]] double rim_lean() const { return std::atan2(radius, depth); }
  [[nodiscard]] Posed leaning(double lean) const {
    return tool_at(top - Vec3d(0, 0, depth), {std::sin(lean), 0, std::cos(lean)});
  }
};

TEST_CASE_TEMPLATE("Eq. 8 to 12: a shaft that leans on a hole's rim has torque k r² 2 sin(Δ/2) cos(Δ/2), no force",
                   Scalar, float, double) {
  const Hole hole;
  const ShapeField<Scalar, decltype(hole.shape())> field(hole.shape(), kVoxel);
  for (const bool cast : {false, true})
    for (const double beyond : {0.02, 0.1}) {
      CAPTURE(cast);
      CAPTURE(beyond);
      ThesisLine<Scalar> renderer(Tool<Scalar>(kBurr, {.shaft = 800}), {.stiffness = 700, .ray_casting = cast});
      const auto out = lead(renderer, field, hole.leaning(0.1), hole.leaning(hole.rim_lean() + beyond), 60);
      const auto& report = renderer.report();
      REQUIRE(report.shaft_contact);
      CHECK(out.contact.shaft);
      CHECK_FALSE(out.contact.tip);
      CHECK(out.wrench.force.norm() == 0);
      // IntP slides along the wall of the hole: at its own lever the law is exact.
      const Vec3d tip = hole.leaning(0).translation(), r = report.intersection.template cast<double>() - tip;
      const double angle =
          std::acos(std::clamp(r.normalized().dot(hole.leaning(hole.rim_lean() + beyond).linear().col(2)), -1.0, 1.0));
      const double torque = 700 * r.squaredNorm() * 2 * std::sin(angle / 2) * std::cos(angle / 2);
      CHECK(static_cast<double>(report.lever_m) == near(r.norm(), 1e-6));
      CHECK(static_cast<double>(report.torque_Nm) == near(torque, 1e-4));
      CHECK(static_cast<double>(report.reaction_N) == near(700 * static_cast<double>(report.spring_m), 1e-6));
      CHECK(out.wrench.torque.y() < 0);  // back, against the lean
      // Eq. 14: the drawn axis passes the shaft's radius inside IntP.
      const Posed drawn = renderer.visual_pose().template cast<double>();
      const Vec3d off = report.intersection.template cast<double>() - drawn.translation();
      CHECK(off.cross(drawn.linear().col(2)).norm() == near(kBurr.shaft_radius, 0.1));
    }
}

TEST_CASE_TEMPLATE("at rest IntP is kept, though bone is carved there", Scalar, float, double) {
  const Hole hole;
  const RasterOptions o{.size = {96, 96, 64}};
  auto grid = rasterise<std::uint8_t>(hole.shape(), o);
  const auto field = field_of<Scalar, CentralGradient>(grid, o);
  ThesisLine<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  const Posed end = hole.leaning(hole.rim_lean() + 0.15);
  lead(renderer, field, hole.leaning(0.1), end, 40);
  REQUIRE(renderer.report().shaft_contact);
  const auto rested = render_at(renderer, field, end);
  const Vec3d intp = renderer.report().intersection.template cast<double>();
  for (int k = 0; k < o.size[2]; ++k)
    for (int j = 0; j < o.size[1]; ++j)
      grid.lower_row(j, k, 0, o.size[0] - 1, [&](int i, std::uint8_t v) {
        return (kVoxel * Vec3d(i, j, k) - intp).norm() < 5e-4 ? std::uint8_t{0} : v;
      });
  grid.commit();
  CHECK(field.value(Vec3<Scalar>(intp.template cast<Scalar>())) < Scalar(-50));
  CHECK(render_at(renderer, field, end).wrench == rested.wrench);
  CHECK(rested.wrench.torque.norm() > Scalar(1e-3));
}

TEST_CASE_TEMPLATE("a wall that is crossed within a tick is not noticed, by tip or shaft", Scalar, float, double) {
  const ShapeField<Scalar, Plate> field({Vec3d(0.0007, 0, 0), Vec3d::UnitX(), kVoxel}, kVoxel);
  ThesisLine<Scalar> thesis(Tool<Scalar>(kBurr, {}));
  LineApproxRenderer<Scalar> ours(Tool<Scalar>(kBurr, {}));
  for (const double x : {0.0, 0.0014}) {
    const Posed X = tool_at(Vec3d(x, 0, 0), Vec3d::UnitZ());
    CHECK(render_at(thesis, field, X).contact.count == 0);
    CHECK(render_at(ours, field, X).contact.count == (x > 0 ? 1 : 0));
  }
}

TEST_CASE_TEMPLATE("fixed counts of steps can step over a wall", Scalar, float, double) {
  // The shaft ends in a wall, and a rib stands before it: at 0, 0.667, 1.333 and 2 mm a vertex is in the rib, at 0, 1
  // and 2 mm it is not.
  const auto shape =
      Either{Plate{Vec3d(0.0007, 0, 0), Vec3d::UnitX(), kVoxel}, Plate{Vec3d(0.002, 0, 0), Vec3d::UnitX(), kVoxel}};
  // Above the ball alone, so that the tip is free.
  const auto above = Both{shape, HalfSpace{Vec3d(0, 0, 0.003), -Vec3d::UnitZ()}};
  const ShapeField<Scalar, decltype(above)> field(above, kVoxel);
  const auto found_at = [&](int steps) {
    ThesisLine<Scalar> renderer(Tool<Scalar>(kBurr, {}), {.translation_steps = steps, .rotation_steps = 1});
    static_cast<void>(render_at(renderer, field, tool_at(Vec3d::Zero(), Vec3d::UnitZ())));
    static_cast<void>(render_at(renderer, field, tool_at(Vec3d(0.002, 0, 0), Vec3d::UnitZ())));
    REQUIRE(renderer.report().shaft_contact);
    return static_cast<double>(renderer.report().intersection.x());
  };
  CHECK(found_at(3) == near(0.00055, 0.2));  // Eq. 1 over a step of 0.7 mm
  CHECK(found_at(2) == near(0.0015, 0.2));
}

TEST_CASE_TEMPLATE("a shaft that starts in bone waits until it was free", Scalar, float, double) {
  const Hole hole;
  const ShapeField<Scalar, decltype(hole.shape())> field(hole.shape(), kVoxel);
  ThesisLine<Scalar> renderer(Tool<Scalar>(kBurr, {}));
  const Posed in = hole.leaning(hole.rim_lean() + 0.2), out = hole.leaning(0.1);
  CHECK(render_at(renderer, field, in).status == Status::kStartedInside);
  CHECK(render_at(renderer, field, in).wrench == Wrench<Scalar>{});
  CHECK(lead(renderer, field, in, out, 30).status == Status::kStartedInside);
  const auto again = lead(renderer, field, out, in, 30);
  CHECK(again.status == Status::kOk);
  CHECK(again.contact.shaft);
  // A jump starts anew, and is said.
  Posed far = in;
  far.translation() += Vec3d(0.008, 0, 0);
  CHECK(render_at(renderer, field, far).status == Status::kJump);
}

TEST_CASE("the thesis' Line: options outside their range are refused") {
  const auto make = [](const ThesisLineOptions& o) { ThesisLine<float> renderer(Tool<float>(kBurr, {}), o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.stiffness = 0}), "trephine::ThesisLineOptions: stiffness must be > 0 N/m, got 0");
  CHECK_THROWS_WITH(make({.friction = -1}), "trephine::Coulomb: the kinetic coefficient must be >= 0, got -1");
  CHECK_THROWS_WITH(make({.raycast_steps = 0}), "trephine::ThesisLineOptions: step counts must be 1 to 100000, got 0");
  CHECK_THROWS_WITH(make({.proxy = {.iterations = 0}}), "trephine::ProxyOptions: iterations must be 1 to 1000, got 0");
}

// Recorded from the main renderer with the thesis' choices, before it had none: projected tracking, collision at t,
// torque without force, IntP kept at rest.
TEST_CASE("stored values of a path through a block with a hole and a rib: Line") {
  const RasterOptions o{.size = {56, 56, 56}};
  const auto grid = rasterise<std::uint8_t>(block_with_hole_and_rib(o), o);
  const auto field = field_of<double, CentralGradient>(grid, o);
  const Tool<double> tool(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012}, {.shaft = 30});
  const auto check = [&](const ThesisLineOptions& options, const PathSums& stored) {
    check_path(ThesisLine<double>(tool, options), field, o, stored);
  };
  check({.stiffness = 700}, {658, 369, 6, 594.954488838, 2.76225337869});
  check({.stiffness = 700, .friction = 0.3}, {658, 357, 6, 629.175546504, 2.37672232063});
  check({.stiffness = 700, .ray_casting = true}, {658, 369, 6, 594.954488838, 2.7650052274});
}

}  // namespace
