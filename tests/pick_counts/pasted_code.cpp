// SPDX-License-Identifier: MIT
// The code that is printed for pasting: what is compiled here is, letter for letter, what the program prints.
#include "pasted.hpp"
#include "pick_report.hpp"
#include "volumes.hpp"

#include <trephine/everything.hpp>

#include <doctest/doctest.h>

#include "support/near.hpp"

using namespace pick;
using namespace pick::test;
using trephine::test::near;

namespace {

const Scene kScene{.burr = {.tip_radius = 0.003, .shaft_radius = 0.0016, .shaft_length = 0.04},
                   .stiffness = 800,
                   .isovalue = kIsovalue,
                   .max_force = 3.3,
                   .max_torque = 0.1};

trephine::TickInput pressed() {
  trephine::TickInput input;
  input.X_WT.translation() = trephine::Vec3d(0.015, 0.015, 0.0099);
  return input;
}

}  // namespace

TEST_CASE("Line's code compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "pasted_line.inc"
  trephine::TickInput above;
  above.X_WT.translation() = trephine::Vec3d(0.015, 0.015, 0.0101);
  CHECK(scene.tick(above, 1e-3).wrench.force.norm() == 0);
  CHECK(scene.tick(pressed(), 1e-3).wrench.force.z() == near(0.08, 2e-5));
  CHECK(as_code(LineSetting{150, 0.25}, kScene) == printed("pasted_line.inc"));
}

TEST_CASE("Coupled's code compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "pasted_coupled.inc"
  trephine::TickInput above;
  above.X_WT.translation() = trephine::Vec3d(0.015, 0.015, 0.0135);
  CHECK(scene.tick(above, 1e-3).wrench.force.norm() == 0);
  for (int i = 0; i < 40; ++i) {
    above.X_WT.translation().z() -= 5e-5;
    CHECK(scene.tick(above, 1e-3).wrench.force.allFinite());
  }
  CHECK(scene.tick(above, 1e-3).wrench.force.z() > 0.5);
  CHECK(as_code(CoupledSetting{}, kScene) == printed("pasted_coupled.inc"));
}

TEST_CASE("Surface's code compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "pasted_surface.inc"
  CHECK(scene.tick(pressed(), 1e-3).wrench.force.z() > 0.5);
  CHECK(as_code(SurfaceSetting{200, 40, 16, 0.5}, kScene) == printed("pasted_surface.inc"));
}

TEST_CASE("the isovalue is printed among the file's own densities") {
  Scene scene = kScene;
  scene.density = 0.25;
  for (const Setting& setting : {Setting(LineSetting{}), Setting(SurfaceSetting{}), Setting(CoupledSetting{})})
    CHECK(as_code(setting, scene).find("scene{bone, 0.25, renderer") != std::string::npos);
  const Subject subject{.bone = "scan",
                        .unit = "of the file's densities",
                        .notes = {},
                        .scene = scene,
                        .spacing = trephine::Vec3d::Constant(5e-4),
                        .size = {2, 2, 2},
                        .options = {}};
  const std::string text = as_text(subject, Study{});
  CHECK(text.find("isovalue 0.25 of the file's densities\n") != std::string::npos);
  CHECK(text.find("burr of 6 mm diameter; shaft of 3.2 mm diameter") != std::string::npos);
}
