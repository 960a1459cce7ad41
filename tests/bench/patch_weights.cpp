// SPDX-License-Identifier: MIT
#include "support/fields.hpp"
#include "support/raster.hpp"
#include "truth/contact_integral.hpp"

#include <trephine/render/surface_approx_renderer.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>
#include <string>

namespace {

using namespace trephine;
using namespace trephine::bench;
using namespace trephine::test;

struct Bone {
  const char* name;
  Shape shape;
  double radius;  // 0: flat
};

// As a function object, so that `rasterise` takes it.
struct Of {
  const Shape* shape;
  double operator()(const Vec3d& p) const { return (*shape)(p); }
};

TEST_CASE("patches on a ball of few vertices press as infinitely many do: flat, convex, hollow bone, all depths") {
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.02};
  const double r = burr.tip_radius, k = 1e8;
  const RasterOptions o{.size = {56, 56, 56}};
  const Vec3d m = o.middle();
  const Bone bones[] = {{"plane", HalfSpace{m, Vec3d::UnitZ()}, 0},
                        {"ball", Ball{m - Vec3d(0, 0, 0.0048), 0.0048}, 0.0048},
                        {"hollow",
                         [m](const Vec3d& p) {
                           return -Ball{m + Vec3d(0, 0, 0.0022), 0.0022}(p);
                         },
                         0.0022}};
  for (const Bone& bone : bones) {
    const auto grid = rasterise<std::uint8_t>(Of{&bone.shape}, o);
    const auto base = field_of<float, AnalyticGradient>(grid, o);
    const CountingField field(base);  // as the sweep reads it
    for (const int count : {26, 200})
      for (const double depth : {r / 6, r / 3, r / 2}) {
        const ToolDiscretization tool{burr, SurfaceCounts{.sphere = count, .slices = 5, .per_slice = 8}};
        SurfaceApproxRenderer<float, PatchWeights> renderer{tool, SurfaceOptions{.thesis_stiffness = k}};
        Random random(17);
        std::vector<double> errors, degrees;
        while (errors.size() < 600) {
          const Vec3d axis = random.unit();
          if (axis.z() < 0.5) continue;  // the shaft stays out
          const Vec3d centre = m + Vec3d(0, 0, r - depth);
          const Posed X =
              make_pose<double>(rotation_between<double>(Vec3d::UnitZ(), axis) *
                                    Eigen::AngleAxisd(random.uniform(0, 6.28), Vec3d::UnitZ()).toRotationMatrix(),
                                centre);
          renderer.reset();
          static_cast<void>(renderer.render(field, X.cast<float>()));
          const Vec3d force = renderer.groups()[0].force.cast<double>();
          const Vec3d exact = k * ball_integral(bone.shape, X, r, -Vec3d::UnitZ()).spring;
          errors.push_back((force - exact).norm() / exact.norm());
          degrees.push_back(angle_deg(force, exact));
        }
        std::sort(errors.begin(), errors.end());
        std::sort(degrees.begin(), degrees.end());
        CAPTURE(std::string(bone.name));
        CAPTURE(count);
        CAPTURE(depth);
        MESSAGE(std::string(bone.name), ", ", count, " vertices, ", depth / r, " radii deep: force p95 ", errors[570],
                ", direction p95 ", degrees[570], " deg");
        // The trilinear surface of a bent bone lies off it by h² / 6R on the mean, which patches undo, but here by less
        // and there by more; force grows with depth squared. With few vertices a disc is not quite their cell.
        const double h = o.spacing.x();
        const double image = bone.radius > 0 ? 2 * h * h / (6 * bone.radius * depth) : 0;
        CHECK(errors[570] <= image + (count == 200 ? 0.011 : depth > 0.3 * r ? 0.055 : 0.13));
        // In a hollow of seven voxels radius 2 to 5 % where that is not undone.
        if (bone.name == std::string("hollow") && count == 200) CHECK(errors[570] <= 0.02);
        CHECK(degrees[570] <= (count == 26 ? 2.5 : 0.4));
      }
  }
}

TEST_CASE("patches of a shaft across a round bar turn it as infinitely many vertices do, slices 0.8 mm apart") {
  const Burr burr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.04};
  const double r = burr.shaft_radius, k = 1e8, bar = 0.003;
  const RasterOptions o{.size = {48, 48, 48}};
  const Vec3d m = o.middle();
  const Shape shape = Rod{m - Vec3d(0, 0, bar), Vec3d::UnitY(), bar};
  const auto grid = rasterise<std::uint8_t>(Of{&shape}, o);
  const auto field = field_of<float, AnalyticGradient>(grid, o);
  const ToolDiscretization tool{burr, SurfaceCounts{.sphere = 26, .slices = 50, .per_slice = 8}};
  SurfaceApproxRenderer<float, PatchWeights> patches{tool, SurfaceOptions{.thesis_stiffness = k}};
  SurfaceApproxRenderer<float, AreaWeights> areas{tool, SurfaceOptions{.thesis_stiffness = k}};
  Random random(19);
  std::vector<double> errors, without;
  for (int i = 0; i < 60; ++i) {
    // Square to the bar up to 20 degrees, touching it 8 to 20 mm from the ball, a quarter to half a radius deep.
    const double lean = random.uniform(-0.35, 0.35), height = random.uniform(0.008, 0.02);
    const Vec3d axis = Vec3d(1, lean, 0).normalized();
    const double depth = r * random.uniform(0.25, 0.5);
    const Mat3d R = rotation_between<double>(Vec3d::UnitZ(), axis) *
                    Eigen::AngleAxisd(random.uniform(0, 6.28), Vec3d::UnitZ()).toRotationMatrix();
    const Posed X = make_pose<double>(R, m + Vec3d(0, 0, r - depth) - height * axis);
    const Vec3d exact = k * shaft_integral(shape, X, burr).moment;
    patches.reset();
    areas.reset();
    const auto error = [&](const auto& out) {
      return (out.wrench.torque.template cast<double>() - exact).norm() / exact.norm();
    };
    errors.push_back(error(patches.render(field, X.cast<float>())));
    without.push_back(error(areas.render(field, X.cast<float>())));
  }
  std::sort(errors.begin(), errors.end());
  std::sort(without.begin(), without.end());
  MESSAGE("torque p95 ", errors[57], ", of vertices without patches ", without[57]);
  // The image of the bar is off by h² / 12 R, 2.5 µm of 200, and force grows with the depth's power of 1.5 and more.
  CHECK(errors[57] <= 0.05);
  CHECK(errors[57] < 0.5 * without[57]);
}

}  // namespace
