// SPDX-License-Identifier: MIT
// The code that is printed for pasting: what is compiled here is, letter for letter, what the program prints.
#include "pick_study.hpp"
#include "volumes.hpp"

#include <trephine/trephine.hpp>

#include <doctest/doctest.h>

#include <fstream>
#include <sstream>

using namespace pick;
using namespace pick::test;

namespace {

const Scene kScene{.burr = {.tip_radius = 0.003, .shaft_radius = 0.0016, .shaft_length = 0.04},
                   .stiffness = 800,
                   .isovalue = kIsovalue,
                   .max_force = 3.3,
                   .max_torque = 0.1};

std::string content(const std::string& name) {
  std::ifstream file(std::string(TREPHINE_PICK_TESTS "/") + name);
  std::ostringstream all;
  all << file.rdbuf();
  return all.str();
}

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
  CHECK(scene.tick(pressed(), 1e-3).wrench.force.z() == doctest::Approx(0.08).epsilon(0.02));
  CHECK(as_code(LineSetting{150, 0.25}, kScene) == content("pasted_line.inc"));
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
  CHECK(as_code(CoupledSetting{}, kScene) == content("pasted_coupled.inc"));
}

TEST_CASE("Surface's code compiles, runs and is what is printed") {
  Grid bone = plane(0.010);
#include "pasted_surface.inc"
  CHECK(scene.tick(pressed(), 1e-3).wrench.force.z() > 0.5);
  CHECK(as_code(SurfaceSetting{200, 40, 16, 0.5, true}, kScene) == content("pasted_surface.inc"));
}
