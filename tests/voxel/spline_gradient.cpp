// SPDX-License-Identifier: MIT
#include "support/fields.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;

/// The cubic B-spline by de Boor's recursion: its pieces are not written down here as they are in the library.
double spline(int degree, double x) {
  if (degree == 0) return x >= -0.5 && x < 0.5 ? 1 : 0;
  const double half = 0.5 * (degree + 1);
  return ((half + x) * spline(degree - 1, x + 0.5) + (half - x) * spline(degree - 1, x - 0.5)) / degree;
}
double slope(double x) { return spline(2, x + 0.5) - spline(2, x - 0.5); }

TEST_CASE_TEMPLATE("the gradient of the densities smoothed by the cubic B-spline, beyond the border too", Scalar, float,
                   double) {
  Random random(83);
  const std::array<int, 3> size{7, 6, 5};
  std::vector<std::uint8_t> voxels(7 * 6 * 5);
  for (auto& v : voxels) v = static_cast<std::uint8_t>(random.below(256));
  const double outside = 40;
  const Vec3d spacing(0.001, 0.002, 0.003);
  const VoxelGrid<std::uint8_t> grid({.size = size, .spacing = spacing, .outside = outside},
                                     std::span<const std::uint8_t>(voxels));
  const DensityField<std::uint8_t, Scalar, SplineGradient> field(grid, 10);
  for (int n = 0; n < 500; ++n) {
    // The array ends a voxel beyond the last ones; there a point is taken back to its edge.
    const Vec3d u{random.uniform(-1, 7), random.uniform(-1, 6), random.uniform(-1, 5)};
    Vec3d expected = Vec3d::Zero();
    for (int k = -4; k <= size[2] + 3; ++k)
      for (int j = -4; j <= size[1] + 3; ++j)
        for (int i = -4; i <= size[0] + 3; ++i) {
          const bool inside = i >= 0 && i < size[0] && j >= 0 && j < size[1] && k >= 0 && k < size[2];
          const double density = inside ? voxels[static_cast<std::size_t>((k * size[1] + j) * size[0] + i)] : outside;
          const Vec3d d = u - Vec3d(i, j, k);
          expected += density * Vec3d(slope(d.x()) * spline(3, d.y()) * spline(3, d.z()),
                                      spline(3, d.x()) * slope(d.y()) * spline(3, d.z()),
                                      spline(3, d.x()) * spline(3, d.y()) * slope(d.z()));
        }
    const Vec3<Scalar> g = field.gradient(spacing.cwiseProduct(u).template cast<Scalar>());
    const double most = sizeof(Scalar) == 4 ? 1.6e-4 : 4e-13;
    CHECK((g.template cast<double>().cwiseProduct(spacing) - expected).norm() <= most);
  }
}

TEST_CASE_TEMPLATE("a smoothed gradient is exact for linear densities", Scalar, float, double) {
  std::vector<float> voxels;
  for (int k = 0; k < 12; ++k)
    for (int j = 0; j < 12; ++j)
      for (int i = 0; i < 12; ++i) voxels.push_back(static_cast<float>(3 * i - 2 * j + 5 * k));
  const Vec3d spacing(0.001, 0.002, 0.003);
  const VoxelGrid<float> grid({.size = {12, 12, 12}, .spacing = spacing}, std::span<const float>(voxels));
  const DensityField<float, Scalar, SplineGradient> field(grid, 10);
  const Vec3<Scalar> g = field.gradient(spacing.cwiseProduct(Vec3d(5.3, 6.1, 4.8)).template cast<Scalar>());
  const double share = sizeof(Scalar) == 4 ? 1e-6 : 4e-15;
  CHECK(static_cast<double>(g.x()) == near(3000, share));
  CHECK(static_cast<double>(g.y()) == near(-1000, share));
  CHECK(static_cast<double>(g.z()) == near(5000.0 / 3, share));
}

TEST_CASE("normals on blurred planes: smoothed ones are several times as exact as those of a cell") {
  Random random(84);
  double smoothed = 0, cell = 0, worst = 0;
  int count = 0;
  for (int tilt = 0; tilt < 6; ++tilt) {
    const RasterOptions o{.size = {40, 40, 40}};
    const Vec3d n = random.unit();
    const HalfSpace plane{o.middle(), n};
    const auto grid = rasterise<std::uint8_t>(plane, o);
    const DensityField<std::uint8_t, float, SplineGradient> smooth(grid, o.isovalue());
    const DensityField<std::uint8_t, float> plain(grid, o.isovalue());
    for (int i = 0; i < 200; ++i) {
      Vec3d p = o.middle() + 0.003 * random.unit();
      p -= plane(p) * n;
      Vec3<float> a = Vec3<float>::Zero(), b = a;
      REQUIRE(smooth.normal(p.cast<float>(), a));
      REQUIRE(plain.normal(p.cast<float>(), b));
      smoothed += angle_deg(a.cast<double>(), n);
      cell += angle_deg(b.cast<double>(), n);
      worst = std::max(worst, angle_deg(a.cast<double>(), n));
      ++count;
    }
  }
  MESSAGE("normals off by ", smoothed / count, " deg (worst ", worst, ") against ", cell / count, " of cells");
  CHECK(smoothed < cell / 5);
  CHECK(worst < 0.6);
}

TEST_CASE_TEMPLATE("gradients in batches are those of single points, hostile ones too", Scalar, float, double) {
  Random random(85);
  std::vector<std::int16_t> noise(20 * 18 * 16);
  for (auto& v : noise) v = static_cast<std::int16_t>(random.below(4000) - 1000);
  const VoxelGrid<std::int16_t> grid({.size = {20, 18, 16}, .spacing = {0.0003, 0.0004, 0.0009}, .outside = -1000.0},
                                     noise);
  const auto check = [&](auto gradient) {
    const DensityField<std::int16_t, Scalar, decltype(gradient)> field(grid, 100);
    constexpr int n = 9 * kLane;
    std::vector<Scalar> x(n), y(n), z(n), gx(n), gy(n), gz(n);
    const Pose<Scalar> X = make_pose<double>(random.rotation(), Vec3d(0.001, 0.002, 0.003)).template cast<Scalar>();
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3d p = 0.004 * random.arrow(0, 2);
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
      const double most = sizeof(Scalar) == 4 ? 100 : 1.5e-7;  // of 5e6 a metre; a cell's slope changes as fast as that
      CHECK((g - Vec3<Scalar>(gx[i], gy[i], gz[i])).norm() <= static_cast<Scalar>(most));
    }
  };
  check(AnalyticGradient{});
  check(CentralGradient{});
  check(SplineGradient{});
}

}  // namespace
