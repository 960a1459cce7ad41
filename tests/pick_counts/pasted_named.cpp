// SPDX-License-Identifier: MIT
// As pasted_code.cpp, for a tool and a device by name.
#include "pasted.hpp"
#include "pick_study.hpp"
#include "volumes.hpp"

#include <trephine/everything.hpp>

#include <doctest/doctest.h>

#include "support/near.hpp"

using namespace pick;
using namespace pick::test;
using trephine::test::near;

namespace {

const Scene kNamed{.burr = trephine::tool_by_name("match-head-3").tool.burr(),
                   .stiffness = 800,
                   .isovalue = kIsovalue,
                   .max_force = 8.5,
                   .max_torque = 0.188,
                   .tool_name = "match-head-3",
                   .device = "Premium 1.5 6DOF"};

/// Leads the tool down to a third of a millimetre below the place at `height`, slowly. Returns the last force.
template <class AScene>
double pressed_force(AScene& scene, double height) {
  trephine::TickInput input;
  double force = 0;
  for (int i = 0; i < 40; ++i) {
    input.X_WT.translation() = trephine::Vec3d(0.015, 0.015, height + 1e-4 - 1e-5 * i);
    force = scene.tick(input, 1e-3).wrench.force.z();
  }
  return force;
}

}  // namespace

TEST_CASE("Line's code for a tool and a device by name compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "named_line.inc"
  CHECK(pressed_force(scene, 0.010) == near(0.23, 0.1));  // 800 N/m, 0.29 mm below
  CHECK(as_code(LineSetting{150, 0.25}, kNamed) == printed("named_line.inc"));
}

TEST_CASE("Coupled's code for a tool and a device by name compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "named_coupled.inc"
  CHECK(pressed_force(scene, 0.0115) > 0.1);
  CHECK(as_code(CoupledSetting{}, kNamed) == printed("named_coupled.inc"));
}

TEST_CASE("Surface's code for a tool and a device by name compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "named_surface.inc"
  CHECK(pressed_force(scene, 0.0115) > 0);
  CHECK(as_code(SurfaceSetting{200, 40, 16, 0.5}, kNamed) == printed("named_surface.inc"));
}

TEST_CASE("all renderers are led with a tool by name") {
  const Grid bone = plane(0.010);
  const Field field(bone, kIsovalue);
  for (const Setting& setting : {Setting(LineSetting{}), Setting(SurfaceSetting{}), Setting(CoupledSetting{})}) {
    const Algorithm a = algorithm_of(setting);
    CAPTURE(name_of(a));
    const auto cases = make_cases(field, kNamed.burr, a, {.per_kind = 2}, {}, kNamed.tool());
    REQUIRE(cases.size() >= 2);
    std::vector<float> ns(tick_count(cases));
    std::vector<Wrenchd> wrenches;
    make_player(setting, kNamed, bone)->play(cases, ns, &wrenches);
    // A case starts free of the bone, and its press ends in it.
    std::size_t tick = 0;
    for (const Case& c : cases) {
      CHECK(wrenches[tick].force.norm() == 0);
      tick += c.X_GT.size();
      CHECK(wrenches[tick - 1].force.norm() > 0);
    }
  }
}
