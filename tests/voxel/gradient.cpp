// SPDX-License-Identifier: MIT
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <numbers>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 7101;
const Vec3d kSpacing(3e-4, 4e-4, 9e-4);

template <class Density, class Gradient>
Vec3d gradient_at(const VoxelGrid<Density>& grid, const Vec3d& p) {
  return DensityField<Density, double, Gradient>(grid, 0).gradient(p);
}

double angle_degrees(const Vec3d& a, const Vec3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/// Points at least `margin` voxels inside the grid's outer voxels.
Vec3d inner_point(std::mt19937& rng, const std::array<int, 3>& size, double margin) {
  return random_point(rng, kSpacing * margin,
                      kSpacing.cwiseProduct(Vec3d(size[0] - 1 - margin, size[1] - 1 - margin, size[2] - 1 - margin)));
}

/// A user's own policy: the forward difference of the interpolant over one voxel.
struct ForwardGradient {
  static constexpr bool kSmooth = false;
  template <VoxelDensity Density, RealScalar Scalar>
  [[nodiscard]] static Vec3<Scalar> at(const SampleView<Density, Scalar>& v, const Vec3<Scalar>& u) noexcept {
    Vec3<Scalar> g;
    for (int a = 0; a < 3; ++a) g[a] = sample(v, Vec3<Scalar>(u + Vec3<Scalar>::Unit(a))) - sample(v, u);
    return g;
  }
};
static_assert(GradientPolicy<ForwardGradient> && !BatchedGradientPolicy<ForwardGradient>);
static_assert(GradientPolicy<AnalyticGradient> && BatchedGradientPolicy<AnalyticGradient>);
static_assert(GradientPolicy<CentralGradient> && GradientPolicy<SplineGradient>);
struct WithoutTraits {
  static Vec3d at(const SampleView<std::int16_t, double>&, const Vec3d&) noexcept;
};
struct MayThrow : WithoutTraits {
  static constexpr bool kSmooth = false;
  static Vec3d at(const SampleView<std::int16_t, double>&, const Vec3d&);
};
static_assert(!GradientPolicy<WithoutTraits> && !GradientPolicy<MayThrow> && !GradientPolicy<int>);

}  // namespace

TEST_CASE("All gradients are exact on a linear field, per metre, whatever the spacing") {
  const std::array size{12, 11, 10};
  const Vec3d slope(3, -5, 7);  // densities a voxel
  const auto grid = make_grid<float>({.size = size, .spacing = kSpacing}, [&](int i, int j, int k) {
    return slope.x() * i + slope.y() * j + slope.z() * k;
  });
  const Vec3d exact = slope.cwiseQuotient(kSpacing);
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  for (int n = 0; n < 500; ++n) {
    const Vec3d p = inner_point(rng, size, 1.01);
    CHECK((gradient_at<float, AnalyticGradient>(grid, p) - exact).norm() < 1e-14 * exact.norm());
    CHECK((gradient_at<float, CentralGradient>(grid, p) - exact).norm() < 1e-14 * exact.norm());
    // Clamped at the far border: one voxel more of margin.
    const Vec3d q = inner_point(rng, size, 2.01);
    CHECK((gradient_at<float, ForwardGradient>(grid, q) - exact).norm() < 1e-14 * exact.norm());
  }
}

TEST_CASE("On a quadratic field central gradients are exact at voxels, the analytic one within a cell") {
  const std::array size{10, 10, 10};
  // ρ = x² + 2 y² − z² + x y in voxels: along an axis the interpolant of x² has slope 2 i + 1 in cell i.
  const auto rho = [](double x, double y, double z) { return x * x + 2 * y * y - z * z + x * y; };
  const auto grid = make_grid<float>({.size = size, .spacing = kSpacing}, rho);
  for (int k = 1; k < 9; ++k)
    for (int j = 1; j < 9; ++j)
      for (int i = 1; i < 9; ++i) {
        const Vec3d p = kSpacing.cwiseProduct(Vec3d(i, j, k));
        const Vec3d exact = Vec3d(2 * i + j, 4 * j + i, -2 * k).cwiseQuotient(kSpacing);
        CHECK((gradient_at<float, CentralGradient>(grid, p) - exact).norm() < 2e-15 * (1 + exact.norm()));
        // Just inside the cell that begins at the voxel.
        const Vec3d in_cell = kSpacing.cwiseProduct(Vec3d(i + 1e-9, j + 1e-9, k + 1e-9));
        // A change of slope of a few densities a voxel, over 1e-9 voxels.
        const Vec3d of_cell = Vec3d(2 * i + 1 + j, 4 * j + 2 + i, -2 * k - 1).cwiseQuotient(kSpacing);
        CHECK((gradient_at<float, AnalyticGradient>(grid, in_cell) - of_cell).norm() < 5e-10 * (1 + of_cell.norm()));
      }
}

TEST_CASE_TEMPLATE("The analytic gradient is the derivative of the interpolant", Density, std::uint8_t, std::int8_t,
                   std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 2);
  const std::array size{9, 8, 7};
  const auto grid = random_grid<Density>({.size = size, .spacing = kSpacing}, rng);
  const DensityField<Density, double> field(grid, 0);
  for (int n = 0; n < 500; ++n) {
    // Mid-cell by at least the step: the derivative jumps between cells. Along an axis the interpolant is linear
    // within a cell, so the difference is exact but for rounding.
    Vec3d u;
    for (int a = 0; a < 3; ++a) {
      u[a] = std::floor(std::uniform_real_distribution<double>(-1.0, size[static_cast<std::size_t>(a)])(rng));
      u[a] += std::uniform_real_distribution<double>(0.05, 0.95)(rng);
    }
    const Vec3d p = u.cwiseProduct(kSpacing);
    Vec3d difference;
    for (int a = 0; a < 3; ++a) {
      Vec3d step = Vec3d::Zero();
      step[a] = 0.04 * kSpacing[a];
      difference[a] = (interpolate(grid, p + step) - interpolate(grid, p - step)) / (2 * step[a]);
    }
    CHECK((field.gradient(p) - difference).norm() <= 3e-13 * (1 + difference.norm()));
  }
}

// As the thesis stores them: differences at the voxels, then interpolated.
TEST_CASE_TEMPLATE("Central gradients are interpolated central differences", Density, std::uint8_t, std::int16_t,
                   std::uint16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 3);
  const std::array size{11, 9, 8};
  const auto grid = random_grid<Density>({.size = size, .spacing = kSpacing}, rng);
  for (int n = 0; n < 1000; ++n) {
    const Vec3d p = inner_point(rng, size, 0.0), u = p.cwiseQuotient(kSpacing), f = u - u.array().floor().matrix();
    Vec3d g = Vec3d::Zero();
    for (int corner = 0; corner < 8; ++corner) {
      const std::array bit{corner & 1, (corner >> 1) & 1, corner >> 2};
      double weight = 1;
      std::array<int, 3> v{};
      for (std::size_t a = 0; a < 3; ++a) {
        const double along = f[static_cast<int>(a)];
        weight *= bit[a] != 0 ? along : 1 - along;
        v[a] = static_cast<int>(std::floor(u[static_cast<int>(a)])) + bit[a];
      }
      const auto density = [&](int i, int j, int k) {
        return static_cast<double>(grid.contains(i, j, k) ? grid.at(i, j, k) : grid.outside());
      };
      const Vec3d difference(density(v[0] + 1, v[1], v[2]) - density(v[0] - 1, v[1], v[2]),
                             density(v[0], v[1] + 1, v[2]) - density(v[0], v[1] - 1, v[2]),
                             density(v[0], v[1], v[2] + 1) - density(v[0], v[1], v[2] - 1));
      g += 0.5 * weight * difference;
    }
    CHECK((gradient_at<Density, CentralGradient>(grid, p) - g.cwiseQuotient(kSpacing)).norm() <=
          1e-10 * (1 / kSpacing.minCoeff()));
  }
}

// Of densities in single precision.
TEST_CASE("A tilted plane on a 1:1:3 grid has its own normal") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 4);
  const Vec3d h(3e-4, 3e-4, 9e-4);
  const std::array size{30, 30, 14};
  for (int n = 0; n < 20; ++n) {
    const Vec3d normal = random_direction(rng);
    const Vec3d middle = h.cwiseProduct(Vec3d(14.5, 14.5, 6.5));
    const auto grid = make_grid<float>(
        {.size = size, .spacing = h, .X_WG = make_pose<double>(random_rotation(rng), {1, 2, 3})},
        [&](int i, int j, int k) { return -normal.dot(h.cwiseProduct(Vec3d(i, j, k)) - middle) * 1e5; });
    Vec3d found = Vec3d::Zero();
    REQUIRE(DensityField<float, double>(grid, 0).normal(middle, found));
    CHECK(angle_degrees(found, normal) < 5e-6);
    REQUIRE(DensityField<float, double, CentralGradient>(grid, 0).normal(middle, found));
    CHECK(angle_degrees(found, normal) < 5e-6);
  }
}

TEST_CASE("Deep in saturated bone the normal still points out") {
  // A ball of 20 voxels, blurred like CT, saturated at 255: four voxels inside its surface all differences are zero.
  const double h = 3e-4;
  const Vec3d centre = Vec3d::Constant(24.3) * h;
  const auto grid =
      make_grid<std::uint8_t>({.size = {50, 50, 50}, .spacing = Vec3d::Constant(h)}, [&](int i, int j, int k) {
        const double d = (Vec3d(i, j, k) * h - centre).norm() / h - 20;
        return std::lround(blurred(0, 255, d));
      });
  const DensityField<std::uint8_t, float> field(grid, 127.5);
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 5);
  int flat = 0;
  double worst = 0;
  for (int n = 0; n < 500; ++n) {
    const Vec3d out = random_direction(rng);
    const Vec3<float> p = (centre + out * 8 * h).cast<float>();  // 12 voxels deep
    if (!(field.gradient(p).norm() > 0)) ++flat;
    Vec3<float> found = Vec3<float>::Zero();
    REQUIRE(field.normal(p, found));
    worst = std::max(worst, angle_degrees(found.cast<double>(), out));
  }
  CHECK(flat == 500);
  CHECK(worst < 5);  // 4.3 measured; 12 with samples along the axes alone
}

TEST_CASE("A flat field has no normal, and `n` stays") {
  const auto grid = make_grid<std::uint8_t>({.size = {60, 60, 60}, .spacing = Vec3d::Constant(1e-3), .outside = 90},
                                            [](int i, int, int) { return i == 0 ? 91 : 90; });
  const DensityField<std::uint8_t, double> field(grid, 50);
  Vec3d n(1, 2, 3);
  CHECK_FALSE(field.normal({0.040, 0.030, 0.030}, n));
  CHECK(n == Vec3d(1, 2, 3));
}
