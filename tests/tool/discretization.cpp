// SPDX-License-Identifier: MIT
#include <trephine/tool/line_discretization.hpp>
#include <trephine/tool/surface_discretization.hpp>

#include "support/near.hpp"
#include "support/raster.hpp"

#include <doctest/doctest.h>

#include <numbers>
#include <set>

namespace {

using namespace trephine;
using namespace trephine::test;

const Burr kBurr{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.040};

// Sums of a few hundred rounded numbers.
template <class Scalar>
constexpr double kSumTolerance = std::is_same_v<Scalar, float> ? 1.4e-7 : 1.2e-14;

TEST_CASE("26 sphere vertices are the directions of a cube, weighted for degree 7") {
  const SphereLayout layout = spread_over_sphere(26);
  REQUIRE(layout.directions.size() == 26);
  std::set<std::array<int, 3>> seen;
  for (std::size_t n = 0; n < 26; ++n) {
    const Vec3d& d = layout.directions[n];
    CHECK(d.norm() == near(1, 1e-15));
    const double largest = d.cwiseAbs().maxCoeff();
    std::array<int, 3> cube{};
    int nonzero = 0;
    for (int a = 0; a < 3; ++a) {
      const double c = d[a] / largest;  // −1, 0 or 1 for a direction of the cube
      cube[static_cast<std::size_t>(a)] = static_cast<int>(std::lround(c));
      CHECK(std::abs(c - std::round(c)) < 1e-15);
      nonzero += std::abs(c) > 0.5 ? 1 : 0;
    }
    seen.insert(cube);
    CHECK(layout.weights[n] == (nonzero == 1 ? 1.0 / 21 : nonzero == 2 ? 4.0 / 105 : 9.0 / 280));
  }
  CHECK(seen.size() == 26);

  // Even moments of the sphere: <x^2a y^2b z^2c> = (2a−1)!!(2b−1)!!(2c−1)!! / (2(a+b+c)+1)!!.
  const auto odd = [](int n) {
    double p = 1;
    for (int i = n; i > 1; i -= 2) p *= i;
    return p;
  };
  const auto power = [](double v, int n) {
    double p = 1;
    for (int i = 0; i < n; ++i) p *= v;
    return p;
  };
  for (int a = 0; a <= 7; ++a)
    for (int b = 0; a + b <= 7; ++b)
      for (int c = 0; a + b + c <= 7; ++c) {
        double sum = 0;
        for (std::size_t n = 0; n < 26; ++n) {
          const Vec3d& d = layout.directions[n];
          sum += layout.weights[n] * power(d.x(), a) * power(d.y(), b) * power(d.z(), c);
        }
        const bool even = a % 2 == 0 && b % 2 == 0 && c % 2 == 0;
        const double exact = even ? odd(a - 1) * odd(b - 1) * odd(c - 1) / odd(a + b + c + 1) : 0.0;
        CHECK(sum == within(exact, 1e-15));
      }
}

TEST_CASE("other counts spread evenly") {
  for (const int count : {4, 5, 7, 12, 25, 27, 50, 100, 200, 399, 1000}) {
    CAPTURE(count);
    const SphereLayout layout = spread_over_sphere(count);
    REQUIRE(layout.directions.size() == static_cast<std::size_t>(count));
    double sum = 0, nearest = 4, farthest = 0;
    Vec3d mean = Vec3d::Zero();
    for (std::size_t i = 0; i < layout.directions.size(); ++i) {
      sum += layout.weights[i];
      mean += layout.weights[i] * layout.directions[i];
      CHECK(layout.directions[i].norm() == near(1, 1e-14));
      double own = 4;
      for (std::size_t j = 0; j < layout.directions.size(); ++j)
        if (i != j) own = std::min(own, (layout.directions[i] - layout.directions[j]).norm());
      nearest = std::min(nearest, own);
      farthest = std::max(farthest, own);
    }
    CHECK(sum == near(1, 1e-12));
    // Points packed at random would have a ratio far above 10; latitudes and longitudes above 3.
    CHECK(farthest / nearest < 2);
    // A point stands for 4π/n: neighbours nearer than half the edge of a square that large crowd.
    CHECK(nearest > 0.5 * std::sqrt(4 * std::numbers::pi / count));
    CHECK(mean.norm() < 0.6 / count);
  }
}

TEST_CASE_TEMPLATE("the surface tool's areas and directions", Scalar, float, double) {
  for (const int sphere : {4, 26, 27, 200}) {
    CAPTURE(sphere);
    const ToolDiscretization<SurfaceCounts, Scalar> tool(kBurr, {.sphere = sphere, .slices = 13, .per_slice = 7});
    const double from = kBurr.shaft_emerges();
    REQUIRE(tool.groups().size() == 14);
    CHECK(tool.count() == sphere + 1 + 13 * (7 + 1));
    CHECK(tool.periphery() == sphere + 13 * 7);
    CHECK(tool.areas().size() == static_cast<std::size_t>(tool.periphery()));
    double ball = 0, side = 0;
    for (std::size_t g = 0; g < tool.groups().size(); ++g) {
      const auto& group = tool.groups()[g];
      CHECK(group.count == (g == 0 ? sphere : 7));
      const Vec3d c = tool.points()[group.centre].template cast<double>();
      CHECK((c - Vec3d(0, 0, static_cast<double>(group.height))).norm() == 0);
      for (int i = group.first; i < group.first + group.count; ++i) {
        const Vec3d p = tool.points()[i].template cast<double>();
        const Vec3d d = tool.inward()[i].template cast<double>();
        CHECK(d.norm() == near(1, 1.1e-7));
        // Walking a radius inward ends at the group's centre.
        CHECK((p + static_cast<double>(group.radius) * d - c).norm() < 4e-10);
        if (g > 0) CHECK(std::abs(d.z()) < 1e-12);
        (g == 0 ? ball : side) += static_cast<double>(tool.areas()[static_cast<std::size_t>(i)]);
      }
      if (g == 0) {
        CHECK(group.height == Scalar(0));
      } else {
        const double piece = (kBurr.shaft_length - from) / 13;
        CHECK(static_cast<double>(group.height) == near(from + (static_cast<double>(g) - 0.5) * piece, 1.3e-7));
      }
    }
    CHECK(ball == near(4 * std::numbers::pi * 0.0015 * 0.0015, kSumTolerance<Scalar>));
    CHECK(side == near(2 * std::numbers::pi * 0.0008 * (0.040 - from), kSumTolerance<Scalar>));
  }
}

TEST_CASE_TEMPLATE("the thesis' counts are 207 and 51 vertices", Scalar, float, double) {
  const ToolDiscretization<SurfaceCounts, Scalar> surface(kBurr, SurfaceCounts::thesis());
  CHECK(surface.count() == 207);
  CHECK(surface.padded() == 208);
  // The 51st is the one at the ball's centre, which the tip's proxy is.
  CHECK(ToolDiscretization<LineCounts, Scalar>(kBurr, {}).count() == 50);
}

TEST_CASE_TEMPLATE("the line's vertices run from the shaft's start to its end", Scalar, float, double) {
  for (const int count : {2, 3, 16, 50, 1000}) {
    const ToolDiscretization<LineCounts, Scalar> emerging(kBurr, {.shaft = count});
    const auto last = static_cast<std::size_t>(count - 1);
    CHECK(emerging.heights()[0] == static_cast<Scalar>(0.0015));
    CHECK(emerging.heights()[last] == static_cast<Scalar>(0.040));
    for (std::size_t i = 1; i < last; ++i)
      CHECK(static_cast<double>(emerging.heights()[i]) ==
            near(0.0015 + 0.0385 * static_cast<double>(i) / (count - 1), 1.7e-7));
  }
  CHECK(ToolDiscretization<LineCounts, Scalar>(kBurr, {.shaft = 1}).heights()[0] == static_cast<Scalar>(0.040));
}

TEST_CASE_TEMPLATE("padding repeats the last vertex and is a multiple of the lane", Scalar, float, double) {
  for (const int count : {1, 15, 16, 17, 50}) {
    const ToolDiscretization<LineCounts, Scalar> line(kBurr, {.shaft = count});
    CHECK(line.padded() == padded_to_lane(count));
    for (int i = count; i < line.padded(); ++i) CHECK(line.points()[i] == line.points()[count - 1]);
  }
  const ToolDiscretization<SurfaceCounts, Scalar> surface(kBurr, {.sphere = 30, .slices = 3, .per_slice = 5});
  CHECK(surface.count() == 30 + 1 + 3 * 6);
  CHECK(surface.padded() == 64);
  for (int i = surface.count(); i < surface.padded(); ++i)
    CHECK(surface.points()[i] == surface.points()[surface.count() - 1]);
}

TEST_CASE_TEMPLATE("a ball alone", Scalar, float, double) {
  const Burr ball{.tip_radius = 0.002, .shaft_length = 0};
  const ToolDiscretization<LineCounts, Scalar> line(ball, {.shaft = -5});
  CHECK(line.count() == 0);
  CHECK(line.padded() == 0);
  const ToolDiscretization<SurfaceCounts, Scalar> surface(ball, {.sphere = 26, .slices = -1, .per_slice = 0});
  CHECK(surface.count() == 27);
  CHECK(surface.groups().size() == 1);
}

TEST_CASE("counts outside their range are refused") {
  const auto line = [](int n) { (void)ToolDiscretization<LineCounts, float>(kBurr, {.shaft = n}); };
  CHECK_THROWS_WITH(line(0), "trephine::ToolDiscretization: shaft vertices must be 1 to 100000, got 0");
  CHECK_THROWS_WITH(line(100001), "trephine::ToolDiscretization: shaft vertices must be 1 to 100000, got 100001");
  const auto surface = [](int sphere, int slices, int per_slice) {
    (void)ToolDiscretization<SurfaceCounts, float>(kBurr, {.sphere = sphere, .slices = slices, .per_slice = per_slice});
  };
  CHECK_NOTHROW(surface(4, 1, 3));
  CHECK_THROWS_WITH(surface(3, 1, 3), "trephine::ToolDiscretization: sphere vertices must be 4 to 100000, got 3");
  CHECK_THROWS_WITH(surface(100001, 1, 3),
                    "trephine::ToolDiscretization: sphere vertices must be 4 to 100000, got 100001");
  CHECK_THROWS_WITH(surface(4, 0, 3), "trephine::ToolDiscretization: slices must be 1 to 10000, got 0");
  CHECK_THROWS_WITH(surface(4, 10001, 3), "trephine::ToolDiscretization: slices must be 1 to 10000, got 10001");
  CHECK_THROWS_WITH(surface(4, 1, 2), "trephine::ToolDiscretization: vertices per slice must be 3 to 1000, got 2");
  CHECK_THROWS_WITH(surface(4, 1, 1001),
                    "trephine::ToolDiscretization: vertices per slice must be 3 to 1000, got 1001");
  const auto burr = [] { (void)ToolDiscretization<LineCounts, float>(Burr{.tip_radius = -1}, {}); };
  CHECK_THROWS_WITH(burr(), "trephine::Burr: tip_radius must be > 0 m, got -1");
  const auto burr2 = [] { (void)ToolDiscretization<SurfaceCounts, double>(Burr{.tip_radius = -1}, {}); };
  CHECK_THROWS_WITH(burr2(), "trephine::Burr: tip_radius must be > 0 m, got -1");
}

TEST_CASE("the counts say which tool is meant") {
  const auto line = ToolDiscretization{kBurr, LineCounts{}};
  const auto surface = ToolDiscretization{kBurr, SurfaceCounts::thesis()};
  static_assert(std::is_same_v<decltype(line), const ToolDiscretization<LineCounts, float>>);
  static_assert(std::is_same_v<decltype(surface), const ToolDiscretization<SurfaceCounts, float>>);
  CHECK(line.burr().tip_radius == kBurr.tip_radius);
  CHECK(surface.burr().shaft_length == kBurr.shaft_length);
}

}  // namespace
