// SPDX-License-Identifier: MIT
// Bone that comes to be around the drill: it never holds the drill, nor pulls at the hand.
#include "tool_body.hpp"
#include "window_bench.hpp"

#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace {

using namespace live_test;

TEST_CASE("tool bodies: a tool is free beside a plane of bone, and on it, but not half a voxel in it") {
  constexpr int kSide = 40;
  constexpr double kVoxel = 0.5e-3, kSurface = 20 * kVoxel;  // bone below it, along z
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kSide; ++k)
    for (int n = 0; n < kSide * kSide; ++n)
      voxels.push_back(static_cast<std::int16_t>(std::clamp(2000 - 100 * k, -1000, 2000)));
  const drill::Grid bone({.size = {kSide, kSide, kSide}, .spacing = Vec3d::Constant(kVoxel)}, voxels);
  const auto check = [&](const ToolBody& body, double lowest) {
    CHECK(body.points().size() > 100);
    CHECK(body.points().size() <= ToolBody::kMax);
    const auto free_at = [&](double below) {
      Posed X = Posed::Identity();
      X.translation() = Vec3d(10e-3, 10e-3, kSurface - lowest - below);
      return body.is_free(bone, 0, X);
    };
    CHECK(free_at(-1e-3));
    CHECK(free_at(0));
    CHECK(free_at(0.4 * kVoxel));
    CHECK(!free_at(1.6 * kVoxel));
    CHECK(!free_at(6e-3));
  };
  check(ToolBody(trephine::Burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 40e-3}, kVoxel), -1.5e-3);
  const trephine::RevolvedTool tool = trephine::tool_by_name("twist-3.2").tool;
  check(ToolBody(tool, kVoxel), tool.bounds().z_low);
  // A disc, thinner than a voxel and a half.
  const trephine::RevolvedTool disc = trephine::tool_by_name("disc-6").tool;
  Posed flat = Posed::Identity();
  flat.translation() = Vec3d(10e-3, 10e-3, kSurface - disc.bounds().z_low - 1e-3);
  CHECK(!ToolBody(disc, kVoxel).is_free(bone, 0, flat));
  // On its rim.
  flat.linear() = trephine::rotation_from_vector<double>(Vec3d(0, 1.5707963, 0));
  flat.translation() = Vec3d(5e-3, 10e-3, kSurface + 3e-3 - 0.4e-3);
  CHECK(!ToolBody(disc, kVoxel).is_free(bone, 0, flat));
  // Bone beside the shaft counts as much as bone at the head.
  Posed X = Posed::Identity();
  X.linear() = trephine::rotation_from_vector<double>(Vec3d(0, 1.9, 0));  // the shaft points down, into bone
  X.translation() = Vec3d(5e-3, 10e-3, kSurface + 3e-3);
  CHECK(!ToolBody(trephine::Burr{.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 40e-3}, kVoxel)
             .is_free(bone, 0, X));
}

TEST_CASE(
    "tool bodies: bone holds a tool from half a voxel's depth on, however it lies and whatever voxels its points are "
    "of") {
  // A half space, so that depth is exact: the tool's points nearest to it, by its own distance.
  std::mt19937 random(7);
  std::normal_distribution<double> normal;
  for (const double voxel : {0.1e-3, 0.3e-3, 0.4e-3, 0.6e-3})
    for (const double radius : {0.8e-3, 1.2e-3, 3e-3}) {
      if (radius < 2 * voxel) continue;
      CAPTURE(voxel);
      CAPTURE(radius);
      const ToolBody body(trephine::Burr{.tip_radius = radius, .shaft_radius = 0.5 * radius, .shaft_length = 40e-3},
                          voxel);
      double least = 1e9, most = 0;  // depth of the ball where the first of its points is reached
      for (int i = 0; i < 400; ++i) {
        Vec3d n = Vec3d(normal(random), normal(random), normal(random)).normalized();
        n.z() = std::abs(n.z());  // bone is below, the shaft goes up
        double lowest = 0;
        for (const Vec3d& p : body.points()) lowest = std::min(lowest, n.dot(p));
        least = std::min(least, radius + lowest);
        most = std::max(most, radius + lowest);
      }
      CHECK(least > 0.49 * voxel);
      CHECK(most < 0.95 * voxel);
    }
}

void use(Bench& b, Renderer renderer) {
  while (b.bench.session().options().drill.renderer != renderer) b.bench.act(Action::kRenderer);
  b.run(0.2);
}

/// Drills a hole and stays in it.
void stay_in_hole(Bench& b) {
  go(b, 3, 1.2);
  b.bench.act(Action::kSpindle);
  go(b, 1.2, -1);
  b.bench.act(Action::kSpindle);
  b.run(0.2);
}

/// Takes the hand along the spot's normal, as `go`, and returns the greatest force on the way [N].
double most_force(Bench& b, double from, double to) {
  const double radius = b.bench.session().options().drill.burr.tip_radius;
  Event e;
  e.kind = Event::Kind::kHand;
  e.pose = b.bench.hand().pose();
  double most = 0;
  for (int i = 1; i <= 32; ++i) {
    e.pose.translation() = b.spot.p_W + radius * (from + (to - from) * i / 32) * b.spot.normal_W;
    b.bench.apply(e);
    b.run(0.03);
    most = std::max(most, b.bench.view().wrench.force.norm());
  }
  return most;
}

double from_hand(const Bench& b) {
  return (b.bench.view().tool.translation() - b.bench.hand().pose().translation()).norm();
}

TEST_SUITE("picture") {
  TEST_CASE("bone that comes to be around the drill lets it out without a pull, and then holds it again") {
    for (const Renderer renderer : {Renderer::kCoupled, Renderer::kLine, Renderer::kSurface})
      for (const Action action : {Action::kUndo, Action::kRestore}) {
        CAPTURE(static_cast<int>(renderer));
        CAPTURE(static_cast<int>(action));
        Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
        use(b, renderer);
        stay_in_hole(b);
        REQUIRE(b.bench.view().removed_mm3 > 1);
        CHECK(!b.bench.view().passes);
        b.bench.act(action);
        b.run(0.3);
        CHECK(b.bench.view().passes);
        CHECK(b.bench.view().contact_count == 0);
        CHECK(b.bench.view().wrench.force.norm() == 0);
        // A turning burr cuts nothing meanwhile.
        b.bench.act(Action::kSpindle);
        b.run(0.2);
        CHECK(b.bench.view().removed_mm3 == 0);
        b.bench.act(Action::kSpindle);
        CHECK(most_force(b, -1, 3) < 0.2);
        b.run(0.3);
        CHECK(!b.bench.view().passes);
        CHECK(from_hand(b) < 0.5e-3);
        CHECK(b.bench.view().wrench.force.norm() < 0.05);
        CHECK(most_force(b, 3, -0.7) > 0.1);
        CHECK(b.bench.view().contact.count > 0);
      }
  }

  TEST_CASE("a tool that is too large for its hole comes out of it without a pull") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    stay_in_hole(b);
    b.bench.act(Action::kLargerBurr);
    b.bench.act(Action::kLargerBurr);
    b.bench.choose_tool("disc-6");
    b.run(0.3);
    CHECK(b.bench.view().passes);
    CHECK(b.bench.view().wrench.force.norm() == 0);
    CHECK(most_force(b, -0.5, 2) < 0.2);
    b.run(0.3);
    CHECK(!b.bench.view().passes);
    CHECK(from_hand(b) < 0.5e-3);
  }

  TEST_CASE("another stiffness or renderer while the drill presses on bone leaves it there") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    (void)most_force(b, 3, -1);  // 2.4 mm into whole bone
    REQUIRE(b.bench.view().contact.count > 0);
    const Vec3d before = b.bench.view().tool.translation();
    SessionOptions o = b.bench.session().options();
    o.drill.stiffness = 600;
    b.bench.session().change(o);
    b.run(0.5);
    CHECK(!b.bench.view().passes);
    CHECK(b.bench.view().wrench.force.norm() > 0.2);
    CHECK((b.bench.view().tool.translation() - before).norm() < 0.4e-3);
    b.bench.act(Action::kRenderer);  // line
    b.run(0.5);
    CHECK((b.bench.view().tool.translation() - before).norm() < 0.8e-3);
    (void)most_force(b, -1, 3);
    b.run(0.3);
    CHECK(from_hand(b) < 0.5e-3);
  }

  TEST_CASE("a hand that is set elsewhere takes the drill with it, out of any hole") {
    for (const Renderer renderer : {Renderer::kCoupled, Renderer::kLine, Renderer::kSurface}) {
      CAPTURE(static_cast<int>(renderer));
      Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
      use(b, renderer);
      stay_in_hole(b);
      // Beside the hole, behind its wall.
      double apart = 0;
      for (const double x : {60.0, 100.0, 140.0, 180.0, 220.0}) {
        const auto p = b.bench.bone_under(x, 150);
        if (!p || (*p - b.spot.p_W).norm() < 4e-3) continue;
        b.bench.mouse_at(x, 150);
        apart = (*p - b.spot.p_W).norm();
        break;
      }
      REQUIRE(apart > 0);
      b.bench.act(Action::kPlace);
      double most = 0;
      for (int i = 0; i < 40; ++i) {
        b.run(0.025);
        most = std::max(most, b.bench.view().wrench.force.norm());
      }
      CHECK(most < 0.2);
      CHECK(!b.bench.view().passes);
      CHECK(from_hand(b) < 0.5e-3);
      CHECK(b.bench.view().wrench.force.norm() < 0.05);
      CHECK((b.bench.view().tool.translation() - b.spot.p_W).norm() > 2e-3);
    }
  }

  TEST_CASE("the volume removed is that of the bone as it is: an undo takes its stroke out") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    const auto removed = [&] { return b.bench.view().removed_mm3; };
    drill_in(b);
    const double first = removed();
    go(b, 3, 0);
    b.bench.act(Action::kSpindle);
    go(b, 0, -2.5);
    b.bench.act(Action::kSpindle);
    go(b, -2.5, 3);
    REQUIRE(removed() > first + 0.5);
    b.bench.act(Action::kUndo);
    b.run(0.3);
    CHECK(removed() == first);
    b.bench.act(Action::kUndo);
    b.run(0.3);
    CHECK(removed() == 0);
  }
}

}  // namespace
