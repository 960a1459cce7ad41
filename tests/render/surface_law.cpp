// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <numbers>

/// The law of Surface's springs: in closed form and on voxels.
namespace {

using namespace trephine;
using namespace trephine::test;

template <class Scalar>
using Tool = ToolDiscretization<SurfaceCounts, Scalar>;

TEST_CASE("many vertices give the continuum's law") {
  const double radius = 0.0015;
  for (const int count : {400, 12000}) {
    const Tool<double> tool(Burr{.tip_radius = radius, .shaft_length = 0}, {.sphere = count});
    double worst = 0;
    for (const double share : {1.0 / 6, 1.0 / 3, 0.5, 0.9}) {
      const double depth = share * radius;
      Random random(71);
      for (int i = 0; i < 10; ++i) {
        const Vec3d n = random.unit();
        worst = std::max(
            worst, std::abs(plane_law(tool, 0, depth, n).dot(n) / (std::numbers::pi * radius * depth * depth) - 1));
      }
    }
    MESSAGE(count, " vertices from the continuum: ", worst);
    CHECK(worst < 0.01);
  }
}

TEST_CASE("on a plane, 26 vertices against the continuum") {
  const double radius = 0.0015;
  const Tool<double> tool(Burr{.tip_radius = radius, .shaft_length = 0}, SurfaceCounts::thesis());
  for (const double share : {1.0 / 6, 1.0 / 3}) {
    std::vector<double> errors;
    Random random(72);
    for (int i = 0; i < 1000; ++i) {
      const Vec3d n = random.unit();
      const double depth = share * radius;
      const Vec3d exact = std::numbers::pi * radius * depth * depth * n;
      errors.push_back((plane_law(tool, 0, depth, n) - exact).norm() / exact.norm());
    }
    std::sort(errors.begin(), errors.end());
    MESSAGE("depth R ", share, ": error p50 ", errors[500], ", p95 ", errors[950]);
    CHECK(errors[950] < (share < 0.2 ? 0.9 : 0.5));
  }
}

TEST_CASE_TEMPLATE("reports and contacts sum to the wrench", Scalar, float, double) {
  const RasterOptions o{.size = {96, 96, 96}};
  const Ball ball{o.middle() - Vec3d(0, 0, 30 * kVoxel), 30 * kVoxel};
  const auto grid = rasterise<std::uint8_t>(ball, o);
  const auto field = field_of<Scalar>(grid, o);
  SurfaceApproxRenderer<Scalar> renderer(
      Tool<Scalar>(Burr{.tip_radius = 0.0015, .shaft_radius = 0.0009, .shaft_length = 0.012},
                   {.sphere = 100, .slices = 10, .per_slice = 32}));
  Random random(73);
  int touching = 0;
  for (int i = 0; i < 300; ++i) {
    renderer.reset();
    const Posed X = random_pose(random, o.middle() + Vec3d(0, 0, 0.0005), 0.002);
    const auto out = render_at(renderer, field, X);
    touching += out.contact.count > 0 ? 1 : 0;
    Vec3d force = renderer.groups()[0].force.template cast<double>(), torque = Vec3d::Zero(), contacts = Vec3d::Zero();
    for (const auto& slice : renderer.slices()) {
      // Eq. 20, literally.
      const Vec3d lever = static_cast<double>(slice.lever_m) * X.linear().col(2);
      CHECK((lever.cross(slice.force.template cast<double>()) - slice.torque.template cast<double>()).norm() <=
            1e-6 * slice.torque.template cast<double>().norm());
      torque += slice.torque.template cast<double>();
      force += slice.force.template cast<double>();
    }
    for (const auto& c : renderer.contacts()) contacts += c.force.template cast<double>();
    const Wrenchd w = in_double(out.wrench);
    CHECK((torque - w.torque).norm() <= 1e-6 * w.torque.norm());
    CHECK((force - w.force).norm() <= 1e-6 * (1 + w.force.norm()));
    CHECK((contacts - w.force).norm() <= 1e-6 * (1 + w.force.norm()));
  }
  CHECK(touching > 100);
}

TEST_CASE_TEMPLATE("a shaft laid flush on a plane", Scalar, float, double) {
  // Ball and shaft of one radius, axis parallel to the plane: every slice is pressed alike, in closed form.
  const double radius = 0.0015, depth = 0.0006, length = 0.020;
  const RasterOptions o{.size = {96, 48, 48}};
  const auto grid = rasterise<std::uint8_t>(HalfSpace{o.middle(), Vec3d::UnitZ()}, o);
  const auto field = field_of<Scalar>(grid, o);
  const Tool<Scalar> tool(Burr{.tip_radius = radius, .shaft_radius = radius, .shaft_length = length},
                          {.sphere = 200, .slices = 20, .per_slice = 64});
  SurfaceApproxRenderer<Scalar> renderer(tool, {});
  const double k = renderer.foundation_stiffness();
  const Posed X = tool_at(o.middle() + Vec3d(-0.010, 0, radius - depth), Vec3d::UnitX());
  const auto out = render_at(renderer, field, X);
  // A strip of length L of a cylinder at depth δ: k L R ∫ (δ − R(1 − cos φ)) / cos φ cos φ dφ over the pressed arc.
  const double half = std::acos(1 - depth / radius);
  const double per_length = k * radius * 2 * (radius * std::sin(half) - (radius - depth) * half);
  const Wrenchd w = in_double(out.wrench);
  const double ball = static_cast<double>(renderer.groups()[0].force.z());
  CHECK(ball == near(k * std::numbers::pi * radius * depth * depth, 0.0015));
  CHECK(w.force.z() - ball == near(per_length * length, 3.7e-5));
  CHECK(w.torque.norm() == near(per_length * length * length / 2, 3.7e-5));
  CHECK(angle_deg(w.torque, -Vec3d::UnitY()) < 2.7e-7);
  for (const auto& slice : renderer.slices())
    CHECK(static_cast<double>(slice.force.z()) == near(per_length * length / 20, 3.7e-5));
}

// --- Stiffness
// ----------------------------------------------------------------------------------------------------------

TEST_CASE_TEMPLATE("the stated stiffness is the secant at R/2, whatever the counts", Scalar, float, double) {
  const double radius = 0.0015;
  const ShapeField<Scalar, HalfSpace> field({Vec3d::Zero(), Vec3d::UnitZ()}, kVoxel);
  for (const int sphere : {26, 50, 200}) {
    const Tool<Scalar> tool(Burr{.tip_radius = radius, .shaft_length = 0}, {.sphere = sphere});
    SurfaceApproxRenderer<Scalar> renderer(tool, {.stiffness = 650});
    Random random(74);
    double sum = 0;
    constexpr int kTurns = 400;
    for (int i = 0; i < kTurns; ++i) {
      renderer.reset();
      const Posed X = make_pose<double>(random.rotation(), Vec3d(0, 0, radius / 2));
      sum += static_cast<double>(render_at(renderer, field, X).wrench.force.z()) / (radius / 2) / kTurns;
    }
    CHECK(sum == near(650, 0.01));
  }
}

TEST_CASE("surface options outside their range are refused") {
  const auto make = [](const SurfaceOptions& o) { SurfaceApproxRenderer<float> renderer(Tool<float>(Burr{}, {}), o); };
  CHECK_NOTHROW(make({}));
  CHECK_THROWS_WITH(make({.stiffness = 0}), "trephine::SurfaceOptions: stiffness must be > 0 N/m, got 0");
  CHECK_THROWS_WITH(make({.stiffness = std::nan("")}), "trephine::SurfaceOptions: stiffness must be > 0 N/m, got nan");
  CHECK_THROWS_WITH(make({.search_step = 0}),
                    "trephine::SurfaceOptions: search_step must be > 0 and at most 4 voxels, got 0");
  CHECK_THROWS_WITH(make({.search_step = 4.5}),
                    "trephine::SurfaceOptions: search_step must be > 0 and at most 4 voxels, got 4.5");
  CHECK_THROWS_WITH(make({.jump = 0}), "trephine::SurfaceOptions: jump must be > 0 m, got 0");
}

TEST_CASE("the force on a plane is quadratic in depth: the tangent is 2 k at R/2 and up to 4 k at R, or the budget") {
  constexpr double k = 800, R = 0.0015;
  const Tool<float> tool(Burr{.tip_radius = R, .shaft_length = 0}, SurfaceCounts{});
  const SurfaceApproxRenderer<float> surface(tool, {.stiffness = k});
  CHECK(surface.tangent_stiffness(0) == near(2 * k, 1.8e-4));
  CHECK(surface.tangent_stiffness(k * R / 2) == near(2 * k, 0.0027));
  CHECK(surface.tangent_stiffness(0.25 * k * R / 2) == near(k, 0.0058));
  // At R the patches beside the equator round the square off.
  CHECK(surface.tangent_stiffness(100) < 4 * k);
  CHECK(surface.tangent_stiffness(100) > 3.4 * k);
  const SurfaceApproxRenderer<float> shared(tool, {.stiffness = k, .budget = StiffnessBudget{1000, 0.3}});
  CHECK(shared.tangent_stiffness(100) == 1000);
}

}  // namespace
