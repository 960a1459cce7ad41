// SPDX-License-Identifier: MIT
#include "support/near.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/density_field.hpp>

#include <doctest/doctest.h>

#include <bit>

using namespace trephine;
using namespace trephine::test;

namespace {

template <class D, class S>
struct Kind {
  using Density = D;
  using Scalar = S;
};

constexpr unsigned kSeed = 20240;

/// Rounding, as a share of the density type's span. In single precision the point's coordinate (up to 30 voxels here)
/// is only known to 2e-6 voxel, and a random field changes by its span a voxel; in double precision only the sum
/// rounds.
template <class Scalar>
constexpr double kRounding = std::is_same_v<Scalar, float> ? 3e-6 : 8e-15;

template <class Density>
double span_of(const VoxelGrid<Density>& grid) {
  return static_cast<double>(grid.original_range().max) - static_cast<double>(grid.original_range().min) + 1.0;
}

}  // namespace

TEST_CASE_TEMPLATE("The field is the trilinear interpolant, outside beyond the grid", K, Kind<std::uint8_t, float>,
                   Kind<std::uint8_t, double>, Kind<std::int8_t, float>, Kind<std::int8_t, double>,
                   Kind<std::uint16_t, float>, Kind<std::uint16_t, double>, Kind<std::int16_t, float>,
                   Kind<std::int16_t, double>, Kind<float, float>, Kind<float, double>) {
  using Density = typename K::Density;
  using Scalar = typename K::Scalar;
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  for (const std::array<int, 3>& size :
       {std::array{1, 1, 1}, std::array{1, 5, 2}, std::array{9, 3, 17}, std::array{22, 14, 8}}) {
    const Vec3d h(3e-4, 5e-4, 9e-4);
    const GridGeometry geometry{
        .size = size, .spacing = h, .outside = static_cast<double>(random_density<Density>(rng))};
    const auto grid = random_grid<Density>(geometry, rng);
    const double iso = 0.4;
    const DensityField<Density, Scalar> field(grid, iso);
    const double tolerance = kRounding<Scalar> * std::max(span_of(grid), std::abs(double(grid.outside())));
    const Vec3d far_corner = h.cwiseProduct(Vec3d(size[0] - 1, size[1] - 1, size[2] - 1));
    double worst = 0;
    for (int n = 0; n < 2000; ++n) {
      const Vec3<Scalar> p = random_point(rng, -3 * h, far_corner + 3 * h).cast<Scalar>();
      worst = std::max(
          worst, std::abs(static_cast<double>(field.value(p)) - (interpolate(grid, p.template cast<double>()) - iso)));
    }
    CHECK(worst <= tolerance);
    for (int n = 0; n < 200; ++n) {
      const std::array<int, 3> at{static_cast<int>(rng() % static_cast<unsigned>(size[0])),
                                  static_cast<int>(rng() % static_cast<unsigned>(size[1])),
                                  static_cast<int>(rng() % static_cast<unsigned>(size[2]))};
      const Vec3d centre = h.cwiseProduct(Vec3d(at[0], at[1], at[2]));
      CHECK(std::abs(static_cast<double>(field.value(centre.cast<Scalar>())) -
                     (static_cast<double>(grid.at(at[0], at[1], at[2])) - iso)) <= tolerance);
    }
  }
}

TEST_CASE("The border is continuous: half way to it is the mean of voxel and outside") {
  const auto grid = make_grid<std::uint8_t>({.size = {2, 2, 2}, .spacing = Vec3d::Constant(1e-3), .outside = 20},
                                            [](int, int, int) { return 220; });
  const DensityField<std::uint8_t, double> field(grid, 0);
  CHECK(field.value({0, 0, 0}) == near(220));
  CHECK(field.value({-0.5e-3, 0, 0}) == near(120));
  CHECK(field.value({1.5e-3, 0, 0}) == near(120));
  CHECK(field.value({0, 1e-3, 1.75e-3}) == near(70));
  CHECK(field.value({-1e-3, 0, 0}) == 20);
  CHECK(field.value({2e-3, 1e-3, 1e-3}) == 20);
  CHECK(field.value({0, 0, 5}) == 20);
}

TEST_CASE_TEMPLATE("Points that are not numbers or infinitely far are outside", Scalar, float, double) {
  std::mt19937 rng(kSeed);
  const auto grid =
      random_grid<std::int16_t>({.size = {5, 6, 7}, .spacing = Vec3d::Constant(1e-3), .outside = -1000}, rng);
  const DensityField<std::int16_t, Scalar> field(grid, 0);
  const DensityField<std::int16_t, Scalar, CentralGradient> central(grid, 0);
  const Scalar inf = std::numeric_limits<Scalar>::infinity();
  const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
  const Scalar huge = std::numeric_limits<Scalar>::max();
  const Scalar tiny = std::numeric_limits<Scalar>::denorm_min();
  for (const Scalar bad : {inf, -inf, nan, huge, -huge})
    for (int a = 0; a < 3; ++a) {
      Vec3<Scalar> p = Vec3<Scalar>::Constant(Scalar(2e-3));
      p[a] = bad;
      CHECK(field.value(p) == Scalar(-1000));
      for (const Vec3<Scalar>& g : {field.gradient(p), central.gradient(p)}) CHECK(is_finite(g));
      Vec3<Scalar> n = Vec3<Scalar>::Zero();
      if (field.normal(p, n)) CHECK(n.norm() == near(1, 1e-5));
    }
  CHECK(field.value(Vec3<Scalar>::Constant(tiny)) == near(static_cast<double>(grid.at(0, 0, 0))));
}

TEST_CASE("A ball beyond the grid is known to be air, unless what lies outside is bone") {
  const std::vector<std::uint8_t> voxels(9 * 9 * 9, 200);
  const auto grid = [&](double outside) {
    return VoxelGrid<std::uint8_t>({.size = {9, 9, 9}, .spacing = Vec3d::Constant(1e-3), .outside = outside}, voxels);
  };
  const auto air = grid(0), bone = grid(150);
  const DensityField<std::uint8_t, double> in_air(air, 100), in_bone(bone, 100);
  CHECK(in_air.is_beyond(Vec3d::Constant(1.0), 1e-3));
  CHECK_FALSE(in_bone.is_beyond(Vec3d::Constant(1.0), 1e-3));
  // The border voxel lies a spacing beyond the last one, at 8 mm.
  CHECK(in_air.is_beyond(Vec3d(11e-3, 4e-3, 4e-3), 1.99e-3));
  CHECK_FALSE(in_air.is_beyond(Vec3d(11e-3, 4e-3, 4e-3), 2.01e-3));
  CHECK_FALSE(in_air.is_beyond(Vec3d::Constant(std::numeric_limits<double>::quiet_NaN()), 1e-3));
}

TEST_CASE_TEMPLATE("Batched values are the single ones", K, Kind<std::uint8_t, float>, Kind<std::int8_t, double>,
                   Kind<std::uint16_t, float>, Kind<std::int16_t, float>, Kind<std::int16_t, double>,
                   Kind<float, float>, Kind<float, double>) {
  using Density = typename K::Density;
  using Scalar = typename K::Scalar;
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 1);
  const Vec3d h(4e-4, 3e-4, 8e-4);
  const auto grid = random_grid<Density>({.size = {20, 11, 9}, .spacing = h}, rng);
  const DensityField<Density, Scalar> field(grid, 0.25);
  constexpr int kCount = 13 * kLane;
  std::vector<Scalar> x(kCount), y(kCount), z(kCount), out(kCount);
  const Pose<Scalar> X =
      make_pose<double>(random_rotation(rng), h.cwiseProduct(Vec3d(10, 5, 4))).template cast<Scalar>();
  for (std::size_t i = 0; i < kCount; ++i) {
    const Vec3d p = random_point(rng, Vec3d::Constant(-5e-3), Vec3d::Constant(5e-3));
    x[i] = Scalar(p.x());
    y[i] = Scalar(p.y());
    z[i] = Scalar(p.z());
  }
  SUBCASE("anywhere in and near the grid") {
    field.values(X, x.data(), y.data(), z.data(), out.data(), kCount);
    double worst = 0;
    for (std::size_t i = 0; i < kCount; ++i)
      worst = std::max(worst, std::abs(double(out[i]) - double(field.value(X * Vec3<Scalar>(x[i], y[i], z[i])))));
    CHECK(worst <= kRounding<Scalar> * span_of(grid));
  }
  SUBCASE("hostile points and poses stay in the array") {
    const Scalar inf = std::numeric_limits<Scalar>::infinity();
    const std::array<Scalar, 6> bad{inf,
                                    -inf,
                                    std::numeric_limits<Scalar>::quiet_NaN(),
                                    std::numeric_limits<Scalar>::max(),
                                    -std::numeric_limits<Scalar>::max(),
                                    Scalar(1e12)};
    for (std::size_t i = 0; i < kCount; ++i) {
      auto& axis = i % 3 == 0 ? x : i % 3 == 1 ? y : z;
      axis[i] = bad[i % bad.size()];
    }
    field.values(Pose<Scalar>::Identity(), x.data(), y.data(), z.data(), out.data(), kCount);
    for (std::size_t i = 0; i < kCount; ++i) {
      CAPTURE(i);
      CHECK(out[i] == field.value(Vec3<Scalar>(x[i], y[i], z[i])));
    }
    Pose<Scalar> broken = X;
    broken.translation().x() = std::numeric_limits<Scalar>::quiet_NaN();
    broken.linear()(1, 1) = inf;
    field.values(broken, x.data(), y.data(), z.data(), out.data(), kCount);
    bool finite = true;
    for (const Scalar v : out) finite = finite && std::isfinite(v);
    CHECK(finite);
  }
}

TEST_CASE("A surface between two voxels lies where the line between them crosses the isovalue") {
  const auto grid = make_grid<std::uint8_t>({.size = {4, 3, 3}, .spacing = {1e-3, 2e-3, 3e-3}},
                                            [](int i, int, int) { return i < 2 ? 0 : 200; });
  const DensityField<std::uint8_t, double> field(grid, 50);
  CHECK(field.value({1.25e-3, 2e-3, 3e-3}) == within(0, 1e-12));
  Vec3d n = Vec3d::Zero();
  REQUIRE(field.normal({1.25e-3, 2e-3, 3e-3}, n));
  CHECK((n - Vec3d(-1, 0, 0)).norm() < 1e-12);
}
