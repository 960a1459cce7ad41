// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "support/raster.hpp"
#include "truth/scenario.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/tool/surface_discretization.hpp>

#include <doctest/doctest.h>

namespace {

using namespace trephine;
using namespace trephine::bench;
using namespace trephine::test;

TEST_CASE("ball on a plane: the foundation's closed forms") {
  const double R = 0.0015;
  Random random(86);
  for (const double share : {0.05, 1.0 / 6, 0.5, 0.8}) {
    const Vec3d n = random.unit();
    const double depth = share * R;
    const Shape plane = HalfSpace{Vec3d(0.001, 0.002, 0.003), n};
    const Posed X = make_pose<double>(random.rotation(), Vec3d(0.001, 0.002, 0.003) + (R - depth) * n);
    const ContactIntegral I = ball_integral(plane, X, R, -n);
    // ∫ a d dA = π R δ² n, and the area of a cap is 2 π R δ.
    CHECK((I.spring - std::numbers::pi * R * depth * depth * n).norm() <= 1e-9 * I.spring.norm());
    CHECK(I.area == near(2 * std::numbers::pi * R * depth, 1e-11));
    // Contact points lie on the plane.
    CHECK(std::abs(plane(I.point / I.weight)) <= 1e-15);
  }
}

// Many vertices instead: slow, plain, and not by way of anything that the integrals use.
Vec3d vertices_on_ball(const Shape& shape, const Posed& X, double R, int count) {
  const SphereLayout layout = spread_over_sphere(count);
  Vec3d sum = Vec3d::Zero();
  for (const Vec3d& out : layout.directions) {
    const Vec3d d = -(X.linear() * out);
    const Vec3d x = X.translation() - R * d;
    if (shape(x) > 0) continue;
    double a = 0;
    while (a < R && shape(x + a * d) <= 0) a += 1e-4 * R;
    sum += 4 * std::numbers::pi * R * R / count * (a - 0.5e-4 * R) * d;
  }
  return sum;
}

TEST_CASE("ball in every tip scenario: the integral against twenty thousand vertices") {
  for (const auto& name : scenario_names()) {
    const Scenario s = make_scenario(name, 1, 2);
    if (s.shaft) continue;
    for (const Case& c : s.cases) {
      CAPTURE(name);
      const Vec3d sum = vertices_on_ball(s.bones[c.bone], c.surface_path.back(), s.burr.tip_radius, 20000);
      CHECK((sum - c.ball.spring).norm() <= 4e-3 * sum.norm());
    }
  }
}

TEST_CASE("shaft flush on a plane, and across a round bar, against sums over its side") {
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.02};
  const double r = burr.shaft_radius;
  struct Place {
    Shape shape;
    Posed X;
  };
  const Mat3d along_x = rotation_between<double>(Vec3d::UnitZ(), Vec3d::UnitX());
  for (const Place& p :
       {Place{HalfSpace{Vec3d::Zero(), Vec3d::UnitZ()}, make_pose<double>(along_x, Vec3d(0, 0, 0.6 * r))},
        Place{Rod{Vec3d(0.01, 0, -0.003), Vec3d(0.2, 1, 0).normalized(), 0.003},
              make_pose<double>(along_x, Vec3d(0, 0, 0.5 * r))}}) {
    const ContactIntegral I = shaft_integral(p.shape, p.X, burr);
    Vec3d spring = Vec3d::Zero(), moment = Vec3d::Zero();
    const int slices = 1500, around = 500;
    const double from = burr.shaft_emerges(), dz = (burr.shaft_length - from) / slices;
    for (int i = 0; i < slices; ++i)
      for (int j = 0; j < around; ++j) {
        const double z = from + (i + 0.5) * dz, phi = 2 * std::numbers::pi * j / around;
        const Vec3d d = -(p.X.linear() * Vec3d(std::cos(phi), std::sin(phi), 0));
        const Vec3d x = p.X * Vec3d(0, 0, z) - r * d;
        if (p.shape(x) > 0) continue;
        const double a = way_out(p.shape, x, d, r);
        const Vec3d f = a * dz * 2 * std::numbers::pi * r / around * d;
        spring += f;
        moment += Vec3d(z * p.X.linear().col(2)).cross(f);
      }
    CHECK((I.spring - spring).norm() <= 7.6e-6 * spring.norm());
    CHECK((I.moment - moment).norm() <= 8.2e-6 * moment.norm());
  }
}

TEST_CASE("scenarios are the same each time, start free and end in contact") {
  for (const auto& name : scenario_names()) {
    CAPTURE(name);
    const Scenario a = make_scenario(name, 2, 2), b = make_scenario(name, 2, 2);
    REQUIRE(a.cases.size() == 4);
    for (std::size_t i = 0; i < a.cases.size(); ++i) {
      const Case& c = a.cases[i];
      CHECK(c.surface_path.back().matrix() == b.cases[i].surface_path.back().matrix());
      CHECK((a.shaft ? c.shaft : c.ball).spring.norm() > 0);
      CHECK(a.bones[c.bone](c.surface_path.front().translation()) > 0);
      if (!c.line_path.empty()) CHECK(c.line_truth.force.norm() > 0);
    }
  }
  CHECK_THROWS_WITH(static_cast<void>(make_scenario("teapot", 1, 1)), "no scenario is called teapot");
}

}  // namespace
