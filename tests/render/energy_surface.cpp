// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"
#include "support/energy_derivative.hpp"
#include "support/path_work.hpp"

#include <trephine/render/energy_surface_renderer.hpp>

#include <doctest/doctest.h>

#include <string>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.012};
const RasterOptions kRoom{.size = {72, 72, 72}};

template <class Shape>
void check_energy(const std::string& name, const Shape& shape, Image image) {
  CAPTURE(name);
  RasterOptions o = kRoom;
  o.image = image;
  const auto bone = rasterise<std::uint8_t>(shape, o);
  DepthMap map(bone, o.isovalue(), {.reach = 10});
  const ToolDiscretization<SurfaceCounts, double> tool(kDrill, {.sphere = 60, .slices = 12, .per_slice = 8});
  EnergySurfaceRenderer<double> on_depths(tool, FromDepthMap(map));
  EnergySurfaceRenderer<double, FromDensities> on_densities(tool, FromDensities{});
  EnergySurfaceRenderer<double, FromDepthMap, RayLaw<double>> rays_on_depths(tool, FromDepthMap(map));
  EnergySurfaceRenderer<double, FromDensities, RayLaw<double>> rays_on_densities(tool, FromDensities{});
  const auto compared = [&](auto& renderer, int poses) {
    return compare_with_energy(renderer, renderer.field(bone, o.isovalue()), bone, o.middle(), 0.0025, poses);
  };
  const EnergyDifference all[] = {compared(on_depths, 1000), compared(on_densities, 400), compared(rays_on_depths, 400),
                                  compared(rays_on_densities, 400)};
  for (const EnergyDifference& c : all) {
    CAPTURE(&c - all);
    CHECK(c.left_out <= 0.05 * c.poses);
    CHECK(c.force <= 1e-4);
    CHECK(c.torque <= 1e-3);
  }
}

TEST_CASE("force and torque are the energy's derivatives, on every shape, with depths and with densities") {
  const Vec3d p = kRoom.middle();
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized();
  const double h = kVoxel;
  check_energy("plane", HalfSpace{p, n}, Image::kCtBlur);
  check_energy("ball", Ball{p - 15 * h * n, 15 * h}, Image::kCtBlur);
  check_energy("socket", Hollow{Ball{p + 12 * h * n, 12 * h}}, Image::kPartialVolume);
  check_energy("rod", Rod{p, n, 6 * h}, Image::kPartialVolume);
  check_energy("edge", Both{HalfSpace{p, n}, HalfSpace{p, n.unitOrthogonal()}}, Image::kCtBlur);
  check_energy("corner", Block{p - 12 * h * Vec3d::Ones(), 12 * h * Vec3d::Ones()}, Image::kBinary);
  check_energy("plate", Plate{p, n, 3 * h}, Image::kClampedDistance);
}

// Paths that begin and end out of contact; trapezoid rule, the step halved until the ratio stands.
TEST_CASE("closed paths in and out of contact, with rotation: no net work, however few the vertices") {
  const unsigned seed = 7;
  CAPTURE(seed);
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized();
  const Vec3d middle = kRoom.middle() - 14 * kVoxel * n;
  const auto bone = rasterise<std::uint8_t>(Ball{middle, 20 * kVoxel}, kRoom);
  DepthMap map(bone, kRoom.isovalue(), {.reach = 10});
  for (const int sphere : {26, 100}) {
    CAPTURE(sphere);
    EnergySurfaceRenderer<double> renderer(ToolDiscretization<SurfaceCounts, double>(kDrill, {.sphere = sphere}),
                                           FromDepthMap(map), {.stiffness = 800, .jump = 1});
    const auto field = renderer.field(bone, kRoom.isovalue());
    Random random(seed);
    double net = 0, path = 0, worst = 0;
    for (int loop = 0; loop < 20; ++loop) {
      const Vec3d out = (n + 0.4 * random.unit()).normalized();
      const Posed rest =
          tool_at(middle + (20 * kVoxel + kDrill.tip_radius + 2e-4) * out, (out + 0.4 * random.unit()).normalized());
      const Vec3d in = -random.uniform(0.0008, 0.003) * out, a = 0.001 * random.unit(), turn = 0.3 * random.unit();
      const auto pose = [&](double phase) {
        const double s = std::sin(phase), c = 0.5 * (1 - std::cos(phase));
        return make_pose<double>(rotation_from_vector(Vec3d(s * turn)) * rest.linear(),
                                 rest.translation() + c * in + s * c * a);
      };
      double ratio = 1, before = 2, work = 0, length = 0;
      for (int steps = 2000; steps <= 64000 && std::abs(ratio - before) > 1e-5; steps *= 2) {
        before = ratio;
        const Wrenchd free = in_double(render_at(renderer, field, pose(0)).wrench);
        REQUIRE(free.force.norm() == 0);
        PathWork round(pose(0), free);
        for (int i = 1; i <= steps; ++i) {
          const Posed X = pose(2 * 3.14159265358979323846 * i / steps);
          round.go(X, in_double(render_at(renderer, field, X).wrench));
        }
        work = round.net;
        length = round.length;
        ratio = work / length;
      }
      net += std::abs(work);
      path += length;
      worst = std::max(worst, std::abs(ratio));
    }
    MESSAGE(sphere, " vertices: net work ", net / path, " of the path's, worst ", worst);
    CHECK(net / path <= 1e-4);
  }
}

TEST_CASE("on a plane: the stated stiffness at half a radius, the plane's direction, deep as well") {
  const Vec3d n = Vec3d(0.3, 0.5, 0.8).normalized();
  const RasterOptions o{.size = {96, 96, 96}};
  const auto bone = rasterise<std::uint8_t>(HalfSpace{o.middle(), n}, o);
  DepthMap map(bone, o.isovalue(), {.reach = 12});
  const double R = kDrill.tip_radius;
  for (const int sphere : {26, 400}) {
    EnergySurfaceRenderer<float> renderer(
        ToolDiscretization<SurfaceCounts, float>({.tip_radius = R, .shaft_length = 0}, {.sphere = sphere}),
        FromDepthMap(map));
    const auto field = renderer.field(bone, o.isovalue());
    const auto pressed = [&](double depth) {
      return in_double(render_at(renderer, field, tool_at(o.middle() + (R - depth) * n, n)).wrench);
    };
    if (sphere == 400) CHECK(pressed(R / 2).force.norm() / (R / 2) == doctest::Approx(800).epsilon(0.035));
    double before = 0;
    for (const double depth : {0.3, 0.6, 1.0, 1.5, 2.0}) {
      const Wrenchd w = pressed(depth * R);
      CHECK(angle_deg(w.force, n) <= 2);
      CHECK(w.force.norm() > before);
      before = w.force.norm();
    }
  }
  CHECK_THROWS_AS(
      EnergySurfaceRenderer(ToolDiscretization(kDrill, SurfaceCounts::thesis()), FromDensities{}, {.stiffness = 0}),
      std::invalid_argument);
}

}  // namespace
