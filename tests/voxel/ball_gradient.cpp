// SPDX-License-Identifier: MIT
#include "support/fields.hpp"

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;

TEST_CASE_TEMPLATE("a slope fitted on a ball is exact for linear densities", Scalar, float, double) {
  std::vector<float> voxels;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i) voxels.push_back(static_cast<float>(3 * i - 2 * j + 5 * k));
  const Vec3d spacing(0.001, 0.002, 0.003);
  const VoxelGrid<float> grid({.size = {12, 12, 12}, .spacing = spacing}, std::span<const float>(voxels));
  const DensityField<float, Scalar, BallGradient> field(grid, 10);
  const Vec3<Scalar> g = field.gradient(spacing.cwiseProduct(Vec3d(5.3, 6.1, 4.8)).template cast<Scalar>());
  CHECK(static_cast<double>(g.x()) == doctest::Approx(3000).epsilon(1e-5));
  CHECK(static_cast<double>(g.y()) == doctest::Approx(-1000).epsilon(1e-5));
  CHECK(static_cast<double>(g.z()) == doctest::Approx(5000.0 / 3).epsilon(1e-5));
}

TEST_CASE("normals on blurred planes: those of a ball are several times as exact as those of a cell") {
  Random random(84);
  double ball = 0, cell = 0, worst = 0;
  int count = 0;
  for (int tilt = 0; tilt < 6; ++tilt) {
    const RasterOptions o{.size = {40, 40, 40}};
    const Vec3d n = random.unit();
    const HalfSpace plane{o.middle(), n};
    const auto grid = rasterise<std::uint8_t>(plane, o);
    const DensityField<std::uint8_t, float, BallGradient> smooth(grid, o.isovalue());
    const DensityField<std::uint8_t, float> plain(grid, o.isovalue());
    for (int i = 0; i < 200; ++i) {
      Vec3d p = o.middle() + 0.003 * random.unit();
      p -= plane(p) * n;
      Vec3<float> a = Vec3<float>::Zero(), b = a;
      REQUIRE(smooth.normal(p.cast<float>(), a));
      REQUIRE(plain.normal(p.cast<float>(), b));
      ball += angle_deg(a.cast<double>(), n);
      cell += angle_deg(b.cast<double>(), n);
      worst = std::max(worst, angle_deg(a.cast<double>(), n));
      ++count;
    }
  }
  MESSAGE("normals off by ", ball / count, " deg (worst ", worst, ") against ", cell / count, " of cells");
  CHECK(ball < cell / 5);
  CHECK(worst < 1);
}

TEST_CASE_TEMPLATE("gradients in batches are those of single points, hostile ones too", Scalar, float, double) {
  Random random(85);
  std::vector<std::int16_t> noise(20 * 18 * 16);
  for (auto& v : noise) v = static_cast<std::int16_t>(random.below(4000) - 1000);
  const VoxelGrid<std::int16_t> grid({.size = {20, 18, 16}, .spacing = {0.0003, 0.0004, 0.0009}, .outside = -1000.0},
                                     noise, {.stored_gradients = true});
  const auto check = [&](auto gradient) {
    const DensityField<std::int16_t, Scalar, decltype(gradient)> field(grid, 100);
    constexpr int n = 9 * kLane;
    std::vector<Scalar> x(n), y(n), z(n), gx(n), gy(n), gz(n);
    const Pose<Scalar> X = make_pose<double>(random.rotation(), Vec3d(0.001, 0.002, 0.003)).template cast<Scalar>();
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d p = 0.004 * random.uniform(0, 2) * random.unit();
      x[i] = static_cast<Scalar>(p.x());
      y[i] = static_cast<Scalar>(p.y());
      z[i] = static_cast<Scalar>(p.z());
    }
    x[3] = std::numeric_limits<Scalar>::quiet_NaN();
    y[7] = std::numeric_limits<Scalar>::infinity();
    z[9] = std::numeric_limits<Scalar>::max();
    field.gradients(X, x.data(), y.data(), z.data(), gx.data(), gy.data(), gz.data(), n);
    for (std::size_t i = 0; i < n; ++i) {
      if (i == 3 || i == 7 || i == 9) {
        CHECK(std::isfinite(gx[i] + gy[i] + gz[i]));
        continue;
      }
      const Vec3<Scalar> p = X * Vec3<Scalar>(x[i], y[i], z[i]);
      const Vec3<Scalar> g = field.gradient(p);
      const double most = sizeof(Scalar) == 4 ? 3e4 : 1e-3;  // of 5e6 a metre; a cell's slope changes as fast as that
      CHECK((g - Vec3<Scalar>(gx[i], gy[i], gz[i])).norm() <= static_cast<Scalar>(most));
    }
  };
  check(AnalyticGradient{});
  check(CentralGradient{});
  check(StoredGradient{});
  check(BallGradient{});
}

}  // namespace
