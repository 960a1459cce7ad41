// SPDX-License-Identifier: MIT
#include <trephine/tool/neighbours.hpp>

#include <doctest/doctest.h>

#include <algorithm>

namespace {

using namespace trephine;

TEST_CASE_TEMPLATE("means over disc and rectangle against sums over their points", Scalar, float, double) {
  const double tolerance = sizeof(Scalar) == 4 ? 2e-5 : 1e-6;
  constexpr int kPoints = 600;
  for (const double q : {-1.5, -1.0, -0.9, -0.3, 0.0, 0.4, 0.95, 1.0, 3.0}) {
    double sum = 0, area = 0;
    for (int i = 0; i < kPoints; ++i)
      for (int j = 0; j < kPoints; ++j) {
        const double x = (2 * i + 1.0) / kPoints - 1, y = (2 * j + 1.0) / kPoints - 1;
        if (x * x + y * y > 1) continue;
        sum += std::max(0.0, q + x);
        ++area;
      }
    CHECK(static_cast<double>(mean_over_disc(static_cast<Scalar>(q))) ==
          doctest::Approx(sum / area).scale(1).epsilon(5e-5));
  }
  for (const double s : {-3.0, -1.1, -0.2, 0.0, 0.3, 1.4, 4.0})
    for (const auto& sides : {std::pair(1.0, 0.6), {0.5, 1.2}, {1.0, 0.0}, {1.0, 0.04}, {-0.7, 0.3}, {0.0, 0.0}}) {
      const double a = sides.first, b = sides.second;
      double sum = 0;
      for (int i = 0; i < kPoints; ++i)
        for (int j = 0; j < kPoints; ++j)
          sum += std::max(0.0, s + a * ((2 * i + 1.0) / kPoints - 1) + b * ((2 * j + 1.0) / kPoints - 1));
      CAPTURE(s);
      CAPTURE(a);
      CAPTURE(b);
      // Where one side is short its own share is left out: a twenty-fourth of its square over the other.
      CHECK(static_cast<double>(
                mean_over_rectangle(static_cast<Scalar>(s), static_cast<Scalar>(a), static_cast<Scalar>(b))) ==
            doctest::Approx(sum / (kPoints * kPoints)).scale(1).epsilon(tolerance + 1e-3));
    }
}

TEST_CASE("patches cover the tool, and neighbours know each other") {
  const Burr burr{.tip_radius = 0.002, .shaft_radius = 0.001, .shaft_length = 0.02};
  for (const int sphere : {26, 100, 1000}) {
    const ToolDiscretization<SurfaceCounts, double> tool(burr, {.sphere = sphere, .slices = 30, .per_slice = 12});
    double ball = 0, side = 0;
    for (std::size_t g = 0; g < tool.groups().size(); ++g)
      for (int i = tool.groups()[g].first; i < tool.groups()[g].first + tool.groups()[g].count; ++i) {
        CHECK(tool.group_of(i) == g);
        const auto patch = tool.patch(i);
        if (g == 0)
          ball += std::numbers::pi * patch.disc * patch.disc;
        else
          side += 4 * patch.half_arc * patch.half_length;
      }
    CHECK(ball == doctest::Approx(4 * std::numbers::pi * 4e-6).epsilon(1e-9));
    CHECK(side == doctest::Approx(2 * std::numbers::pi * 0.001 * (0.02 - burr.shaft_emerges())).epsilon(1e-9));
    const PatchNeighbours neighbours(tool);
    for (int i = 0; i < tool.periphery(); ++i) {
      const auto mine = neighbours.of(i);
      CHECK(mine.size() >= 3);
      CHECK(mine.size() <= 24);
      for (const int j : mine) {
        const auto theirs = neighbours.of(j);
        const bool mutual = std::find(theirs.begin(), theirs.end(), i) != theirs.end();
        // Equal areas: only the ball's 26 directions stand for unequal ones.
        if (sphere != 26 || tool.group_of(i) != 0) CHECK(mutual);
      }
    }
  }
  // Slices farther apart than the shaft is thick count with their ring alone.
  const ToolDiscretization<SurfaceCounts, double> coarse(burr, {.sphere = 26, .slices = 5, .per_slice = 8});
  CHECK(coarse.patch(coarse.groups()[1].first).half_length == 0);
}

TEST_CASE("a patch on a plane: nothing far above it, the vertex' own way deep below, gradual between") {
  const Patch<double> patch{.radius = 0.002, .disc = 0.0004};
  const Vec3d inward = Vec3d::UnitZ(), axis = Vec3d::UnitX();
  const Vec3d n = Vec3d(0.3, 0.2, 1).normalized();
  const double cosine = n.z();
  CHECK(patch.mean_way(-0.0005, n, inward, axis) == 0);
  const double deep = 0.0015;
  // A ball's cap bends away from its tangent plane: its points lie deeper in the tool by disc²/(4 R) on the mean.
  CHECK(patch.mean_way(deep, n, inward, axis) ==
        doctest::Approx(deep / cosine - 0.0004 * 0.0004 / (4 * 0.002)).epsilon(1e-9));
  double before = 0;
  for (double depth = -0.0003; depth < 0.0003; depth += 1e-6) {
    const double way = patch.mean_way(depth, n, inward, axis);
    CHECK(way >= before);
    CHECK(way - before <= 1.01e-6 / cosine);
    before = way;
  }
  CHECK(before > 0);
  CHECK(patch.mean_way(deep, -n, inward, axis) == 0);  // a surface that faces away
}

}  // namespace
