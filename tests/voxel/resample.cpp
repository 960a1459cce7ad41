// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/random.hpp"
#include "support/raster.hpp"

#include <trephine/contact/surface_search.hpp>
#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/resample.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <stdexcept>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr unsigned kSeed = 918;

/// A grid of a function of position in G.
template <class Density, class Function>
VoxelGrid<Density> grid_of(const std::array<int, 3>& size, const Vec3d& spacing, const Posed& X_WG, Function&& f) {
  std::vector<Density> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) voxels.push_back(static_cast<Density>(f(spacing.cwiseProduct(Vec3d(i, j, k)))));
  return {{.size = size, .spacing = spacing, .X_WG = X_WG}, voxels};
}

TEST_CASE_TEMPLATE("resampled: samples that coincide with the source's have its densities", Density, std::uint8_t,
                   std::int8_t, std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  Random random(kSeed);
  const Vec3d h(0.9e-3, 0.5e-3, 1.5e-3);
  constexpr bool kSigned = std::numeric_limits<Density>::is_signed;
  const auto source = grid_of<Density>({23, 31, 18}, h, Posed::Identity(),
                                       [&](const Vec3d&) { return random.uniform(kSigned ? -100 : 0, 120); });
  const auto fine = resampled(source, Vec3d(h.x() / 3, h.y() / 2, h.z() / 4));
  CHECK(fine.size() == std::array{67, 61, 69});
  double off = 0;
  for (int k = 0; k < 18; ++k)
    for (int j = 0; j < 31; ++j)
      for (int i = 0; i < 23; ++i)
        off = std::max(
            off, std::abs(static_cast<double>(fine.at(3 * i, 2 * j, 4 * k)) - static_cast<double>(source.at(i, j, k))));
  CHECK(off <= (std::is_floating_point_v<Density> ? 1.5e-4 : 0.0));
  CHECK(fine.outside() == source.outside());
}

TEST_CASE("resampled: a cubic polynomial comes back, at its place in the world, whatever the box") {
  const Vec3d h(1.1e-3, 0.8e-3, 1.4e-3);
  Posed X_WG = Posed::Identity();
  X_WG.rotate(Eigen::AngleAxisd(0.7, Vec3d(1, 2, 3).normalized()));
  X_WG.translation() = Vec3d(0.1, -0.2, 0.3);
  const auto f = [](const Vec3d& p) {
    const Vec3d u = (p - Vec3d(0.025, 0.02, 0.03)) / 0.02;
    return 100 * (1 + u.x() * u.y() - u.z() + u.x() * u.x() * u.x() - 0.5 * u.z() * u.z() * u.y());
  };
  const auto source = grid_of<float>({46, 50, 44}, h, X_WG, f);
  // The mirrored ends are not the polynomial's: far from them by 14 voxels, the pole leaves 1e-8 of that.
  const VoxelBox box{{14, 15, 14}, {30, 33, 28}};
  const auto fine = resampled(source, Vec3d(0.4e-3, 0.4e-3, 0.3e-3), box);
  double off = 0;
  for (int k = 0; k < fine.size()[2]; ++k)
    for (int j = 0; j < fine.size()[1]; ++j)
      for (int i = 0; i < fine.size()[0]; ++i) {
        const Vec3d p_W = fine.X_WG() * fine.spacing().cwiseProduct(Vec3d(i, j, k));
        off = std::max(off, std::abs(static_cast<double>(fine.at(i, j, k)) - f(X_WG.inverse() * p_W)));
      }
  CHECK(off <= 2e-4);  // densities of up to 800 in single precision
  const Vec3d end = fine.spacing().cwiseProduct(Vec3d(fine.size()[0] - 1, fine.size()[1] - 1, fine.size()[2] - 1));
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double last = (box.hi[i] - box.lo[i]) * h[a];
    CHECK(end[a] <= last + 1e-9);
    CHECK(end[a] > last - fine.spacing()[a]);
  }
}

TEST_CASE("resampled: coarse voxels of a scan give a ball's surface and its normals") {
  CAPTURE(kSeed);
  Random random(kSeed + 1);
  // A clinical CT of the head, blurred by .7 voxels of its own: as trilinear samples, and resampled to .4 mm.
  double coarse_worst = 0, fine_worst = 0, coarse_turn = 0, fine_turn = 0;
  for (int place = 0; place < 6; ++place) {
    const RasterOptions o{.size = {40, 40, 30}, .spacing = Vec3d(0.957e-3, 0.957e-3, 1.5e-3), .blur = 0.7};
    const Vec3d c = o.middle() + 1e-3 * Vec3d{random.uniform(), random.uniform(), random.uniform()};
    constexpr double kRadius = 12e-3;
    const auto coarse = rasterise<std::int16_t>([&](const Vec3d& p) { return (p - c).norm() - kRadius; }, o);
    const auto fine = resampled(coarse, Vec3d::Constant(0.4e-3));
    const auto measure = [&](const VoxelGrid<std::int16_t>& grid, double& worst, double& turn) {
      const DensityField<std::int16_t, double> field(grid, o.isovalue());
      for (int ray = 0; ray < 200; ++ray) {
        const Vec3d u = random.unit();
        const auto hit = first_crossing(field, Vec3d(c + 0.7 * kRadius * u), Vec3d(c + 1.3 * kRadius * u), 0.2e-3, 100);
        REQUIRE(hit.found);
        const double r = kRadius * (0.7 + 0.6 * hit.after);
        worst = std::max(worst, std::abs(r - kRadius));
        Vec3d n = Vec3d::Zero();
        REQUIRE(field.normal(c + r * u, n));
        turn = std::max(turn, std::acos(std::min(1.0, n.dot(u))));
      }
    };
    measure(coarse, coarse_worst, coarse_turn);
    measure(fine, fine_worst, fine_turn);
  }
  MESSAGE("surface off by ", 1e3 * coarse_worst, " > ", 1e3 * fine_worst, " mm, normals by ", coarse_turn * 57.3, " > ",
          fine_turn * 57.3, " deg");
  CHECK(fine_worst < 0.5 * coarse_worst);
  CHECK(fine_turn < 0.5 * coarse_turn);
}

// A wave of wavelength L samples keeps its mean over a box of width w: the factor sin(πw/L) / (πw/L).
TEST_CASE("resampled: coarser samples are means, so waves finer than a voxel vanish and slopes stay") {
  const Vec3d h = Vec3d::Constant(0.3e-3);
  Figures off;
  for (const double step : {1.0, 1.5, 2.0, 3.0})
    for (const double wavelength : {12.0, 6.0, 4.0}) {
      const double k = 2 * 3.14159265358979323846 / wavelength, w = std::sqrt(step * step - 1);
      const auto fine = grid_of<float>({120, 3, 3}, h, Posed::Identity(),
                                       [&](const Vec3d& p) { return 100 * std::cos(k * p.x() / h.x()) + 5e3 * p.x(); });
      const auto coarse = resampled(fine, Vec3d(step * h.x(), h.y(), h.z()));
      const double kept = w > 0 ? std::sin(k * w / 2) / (k * w / 2) : 1;
      // Away from the ends, whose signal is mirrored.
      for (int i = static_cast<int>(20 / step); i < coarse.size()[0] - static_cast<int>(20 / step); ++i) {
        const double x = i * step;
        const double expected = 100 * kept * std::cos(k * x) + 5e3 * x * h.x();
        off.add(std::abs(static_cast<double>(coarse.at(i, 1, 1)) - expected));
      }
    }
  MESSAGE("off the mean of a wave of 100: ", off);
  // Between samples a cubic spline follows a wave of four of them to a hundredth.
  CHECK(off.median() <= 1e-4);
  CHECK(off.worst() <= 1.5);

  // Voxels that alternate have the mean of their neighbours, and not one of both.
  const auto checkers = grid_of<std::int16_t>({40, 40, 40}, h, Posed::Identity(), [&](const Vec3d& p) {
    const Vec3d i = (p / h.x()).array().round();
    return std::fmod(i.sum(), 2) < 0.5 ? 1000 : -1000;
  });
  const auto coarse = resampled(checkers, 2 * h);
  double most = 0;
  for (int k = 3; k < 17; ++k)
    for (int j = 3; j < 17; ++j)
      for (int i = 3; i < 17; ++i) most = std::max(most, std::abs(static_cast<double>(coarse.at(i, j, k))));
  CHECK(most <= 12);
}

TEST_CASE("resampled: single voxels, integer ranges, and what is refused") {
  const auto one =
      grid_of<std::uint8_t>({1, 1, 1}, Vec3d::Constant(1e-3), Posed::Identity(), [](const Vec3d&) { return 7; });
  CHECK(resampled(one, Vec3d::Constant(1e-4)).size() == std::array{1, 1, 1});
  CHECK(resampled(one, Vec3d::Constant(1e-4)).at(0, 0, 0) == 7);
  const auto two = grid_of<std::uint8_t>({2, 1, 1}, Vec3d::Constant(1e-3), Posed::Identity(),
                                         [](const Vec3d& p) { return p.x() > 0 ? 255 : 0; });
  const auto fine = resampled(two, Vec3d::Constant(0.25e-3));
  CHECK(fine.size() == std::array{5, 1, 1});
  for (int i = 1; i < 5; ++i) CHECK(fine.at(i, 0, 0) > fine.at(i - 1, 0, 0));
  // An edge of full contrast overshoots, and the type's range cuts that off.
  const auto edge = grid_of<std::uint8_t>({20, 3, 3}, Vec3d::Constant(1e-3), Posed::Identity(),
                                          [](const Vec3d& p) { return p.x() > 9.5e-3 ? 255 : 0; });
  const auto cut = resampled(edge, Vec3d::Constant(0.25e-3));
  for (int i = 0; i < cut.size()[0]; ++i)
    CHECK((i < 36 ? cut.at(i, 0, 0) < 30 : i > 40 ? cut.at(i, 0, 0) > 225 : true));

  CHECK_THROWS_AS(static_cast<void>(resampled(edge, Vec3d(0, 1e-3, 1e-3))), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(resampled(edge, Vec3d(1e-3, std::nan(""), 1e-3))), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(resampled(edge, Vec3d::Constant(1e-7))), std::invalid_argument);
  CHECK_THROWS_AS(static_cast<void>(resampled(edge, Vec3d::Constant(1e-3), VoxelBox{{20, 0, 0}, {25, 2, 2}})),
                  std::invalid_argument);
}

}  // namespace
