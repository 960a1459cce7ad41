// SPDX-License-Identifier: MIT
// Tools of other shapes in the window: how they are drawn, chosen and changed, and sliders that outlast a change.
#include "support/near.hpp"
#include "window_bench.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/tool/named_tools.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

using trephine::test::near;

namespace {

using namespace live_test;

/// Distance along a ray [m] at which it meets a tool's outline, stepped finely enough for any; -1: nowhere.
double meets(const trephine::RevolvedTool& tool, const Vec3d& origin, const Vec3d& direction) {
  double t = 0;
  for (int i = 0; i < 4000 && t < 0.3; ++i) {
    const Vec3d p = origin + t * direction;
    const double d = tool.outline().signed_distance(p.head<2>().norm(), p.z());
    if (d < 1e-6) return t;
    t += 0.8 * d;
  }
  return -1;
}

TEST_SUITE("picture") {
  TEST_CASE("tools: each is drawn where its outline is") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    for (const char* name : {"match-head-3", "pear-2.3", "disc-6", "cylinder-3", "barrel-4", "twist-3.2", "round-2"}) {
      const std::string tool_name = name;
      CAPTURE(tool_name);
      b.bench.choose_tool(tool_name);
      REQUIRE(b.bench.note() == "");
      SceneView v = b.bench.scene_view();
      REQUIRE(v.shape.has_value());
      v.sprites.clear();
      v.triangles.clear();
      v.ghost_opacity = 0;
      // Before the bone, askew.
      v.camera.distance = 0.03;
      const Vec3d middle = v.camera.eye_W() + 0.5 * v.camera.distance * -v.camera.axes().col(2);
      v.tool_W = trephine::make_pose<double>(
          Mat3d(v.camera.axes() * trephine::rotation_from_vector<double>(Vec3d(0.9, 0.4, 0.3))), middle);
      b.bench.picture().draw_moving(v, b.bench.texture(), b.bench.X_WG(), 160, 120);
      const std::vector<float> depth = b.bench.picture().depths();
      const Posed X_TW = v.tool_W.inverse(Eigen::Isometry);
      int shown = 0, different = 0;
      std::vector<double> apart;
      for (int y = 0; y < 120; ++y)
        for (int x = 0; x < 160; ++x) {
          const ViewRay ray = v.camera.ray(x + 0.5, y + 0.5, 160, 120);
          const double t = meets(*v.shape, X_TW * ray.origin, X_TW.linear() * ray.direction);
          if (t < 0) continue;
          ++shown;
          const double drawn = static_cast<double>(depth[static_cast<std::size_t>(y * 160 + x)]);
          const double off = std::abs(t * ray.direction.dot(-v.camera.axes().col(2)) - drawn);
          // At a grazed edge a pixel may show what lies behind.
          if (off > 0.5e-3)
            ++different;
          else
            apart.push_back(off);
        }
      REQUIRE(apart.size() > 300);
      std::sort(apart.begin(), apart.end());
      MESSAGE(tool_name, ": ", shown, " pixels, ", different, " differ; depth off by p99 ",
              1e3 * apart[apart.size() * 99 / 100], " mm");
      CHECK(different <= shown / 50);
      CHECK(apart[apart.size() * 99 / 100] <= 0.02e-3);
    }
  }

  TEST_CASE("tools: one is chosen, drills, grows and shrinks, and gives way to a burr for line and surface") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    Workbench& w = b.bench;
    const auto drill = [&] { return w.session().options().drill; };
    CHECK(family_of(drill().tool_name) == kBurrName);
    w.choose_tool("match-head-2.5");
    CHECK(drill().tool_name == "match-head-2.5");
    CHECK(drill().shape() != nullptr);
    drill_in(b);
    MESSAGE("a match head removed ", w.view().removed_mm3, " mm3");
    CHECK(w.view().removed_mm3 > 1);
    w.act(Action::kLargerBurr);
    CHECK(drill().tool_name == "match-head-3.1");
    w.act(Action::kSmallerBurr);
    w.act(Action::kSmallerBurr);
    CHECK(drill().tool_name == "match-head-2");
    for (int i = 0; i < 9; ++i) w.act(Action::kSmallerBurr);
    CHECK(drill().tool_name == "match-head-1.5");
    // Another family, as wide as it has it.
    w.choose_family("cylinder");
    CHECK(drill().tool_name == "cylinder-1.5");
    w.choose_family("barrel");
    CHECK(drill().tool_name == "barrel-3");
    b.run(0.3);
    CHECK(!w.session().failed());
    // What cannot be leaves all as it is.
    w.choose_tool("disc-20");
    CHECK(drill().tool_name == "barrel-3");
    CHECK(w.note().find("disc-20") != std::string::npos);
    w.choose_tool("nail-3");
    CHECK(drill().tool_name == "barrel-3");
    CHECK(w.note().find("reamer-4 to 14") != std::string::npos);
    // Line and surface drill with a burr as wide; the tool comes back with the coupled renderer.
    w.act(Action::kRenderer);
    CHECK(drill().shape() == nullptr);
    CHECK(drill().burr.tip_radius == near(1.5e-3));
    CHECK(!w.scene_view().shape.has_value());
    w.act(Action::kRenderer);
    w.act(Action::kRenderer);
    CHECK(drill().shape() != nullptr);
    w.choose_tool(std::string(kBurrName));
    CHECK(drill().shape() == nullptr);
    CHECK(w.note() == "");
    b.run(0.3);
    CHECK(!w.session().failed());
  }

  TEST_CASE("law: a key and the sliders mill by the law of cutting, and the view has the true forces") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    Workbench& w = b.bench;
    const auto drill = [&] { return w.session().options().drill; };
    // In whole bone.
    const auto most_thrust = [&] {
      double thrust = 0, torque = 0;
      w.act(Action::kRestore);
      b.run(0.3);
      w.act(Action::kSpindle);
      Event e;
      e.kind = Event::Kind::kHand;
      e.pose = w.hand().pose();
      for (int i = 0; i < 40; ++i) {
        e.pose.translation() = b.spot.p_W + (3 - 0.1 * i) * 1.2e-3 * b.spot.normal_W;
        w.apply(e);
        b.run(0.03);
        thrust = std::max(thrust, w.view().cutting.thrust);
        torque = std::max(torque, w.view().cutting.torque);
      }
      w.act(Action::kSpindle);
      w.act(Action::kHome);
      b.run(0.3);
      CHECK((torque > 1e-4) == drill().mills_by_law());
      return thrust;
    };
    CHECK(most_thrust() == 0);
    w.act(Action::kRenderer);  // line
    w.act(Action::kLaw);
    CHECK(drill().mills_by_law());
    CHECK(drill().renderer == Renderer::kCoupled);
    CHECK(drill().cutting().speed == trephine::rpm(40'000));
    const double burr = most_thrust();
    CHECK(burr > 0.3);
    CHECK(w.view().removed_mm3 > 0);
    // A drill turns slowly, and the hand feels a sixtieth of what it takes.
    w.choose_tool("twist-3.2");
    CHECK(drill().cutting().speed == trephine::rpm(1000));
    CHECK(drill().cutting().edges.chisel);
    const double twist = most_thrust();
    CHECK(twist > 5 * burr);
    CHECK(w.view().removed_mm3 > 0);
    Tuning tuning = drill().tuning;
    tuning.turns = 2000;
    tuning.force_scale = 0.5;
    w.session().tune(tuning);
    b.run(0.1);
    CHECK(w.view().cutting.spindle == 0);
    w.act(Action::kSpindle);
    b.run(0.2);
    CHECK(w.view().cutting.spindle == near(trephine::rpm(2000)));
    w.act(Action::kLaw);
    b.run(0.2);
    CHECK(!drill().mills_by_law());
    CHECK(w.view().cutting.spindle == 0);
    CHECK(!w.session().failed());
  }

  TEST_CASE("sliders: a drill that is made anew has what they show") {
    Bench b(ball(Vec3d::Constant(0.4e-3), 8e-3));
    Workbench& w = b.bench;
    const double limit = 0.4;
    Tuning tuning = w.session().options().drill.tuning;
    CHECK(tuning.feed == near(w.bone().burr.tip_radius / kRadiusTime));
    tuning.force = limit;
    w.session().tune(tuning);
    const auto most_force = [&] {
      double most = 0;
      w.act(Action::kHome);
      b.run(0.3);
      Event e;
      e.kind = Event::Kind::kHand;
      e.pose = w.hand().pose();
      for (int i = 0; i < 40; ++i) {
        e.pose.translation() = b.spot.p_W + (3 - 0.2 * i) * 1.2e-3 * b.spot.normal_W;
        w.apply(e);
        b.run(0.03);
        most = std::max(most, w.view().wrench.force.norm());
      }
      return most;
    };
    CHECK(most_force() == near(limit, 1e-6));
    w.choose_tool("match-head-2.5");
    CHECK(most_force() == near(limit, 1e-6));
    w.act(Action::kRenderer);
    CHECK(most_force() == near(limit, 1e-6));
    w.act(Action::kLargerBurr);
    CHECK(most_force() == near(limit, 1e-6));
    CHECK(w.session().options().drill.tuning == tuning);
  }
}

}  // namespace
