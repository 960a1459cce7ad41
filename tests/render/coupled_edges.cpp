// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"

#include <trephine/render/coupled_tool_renderer.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kBall{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0};

// A ball of radius R on a sharp edge, its centre on the circle of radius R round it, held by a spring K to the device
// at d from the edge, r = |d| < R: the centre is where d points to, R d/r, so F = K (R d/r − d), and what is felt is
//     −∂F/∂d = K (I − R/r (I − u uᵀ)),  u = d/r:
// K along u, K (1 − R/r) < 0 across: to the side the ball is pushed off. Along n it is K (1 − R/r (1 − (n·u)²)).
Mat3d felt_on_edge(double K, double R, const Vec3d& d, const Vec3d& along_edge) {
  const double r = d.norm();
  const Vec3d u = d / r;
  const Mat3d across = Mat3d::Identity() - along_edge * along_edge.transpose();
  return K * (across - R / r * (across - u * u.transpose()));
}

TEST_CASE("a ball on a sharp edge: the closed form against brute force") {
  const double K = 900, R = kBall.tip_radius, h = 1e-7;
  const auto force = [&](double x, double z) {
    // Of all places of the centre that leave the edge outside the ball the one with the least energy, by ternary
    // search.
    double low = -3, high = 3;
    const auto energy = [&](double a) { return std::hypot(R * std::sin(a) - x, R * std::cos(a) - z); };
    for (int i = 0; i < 200; ++i) {
      const double a = low + (high - low) / 3, b = high - (high - low) / 3;
      (energy(a) < energy(b) ? high : low) = energy(a) < energy(b) ? b : a;
    }
    const double a = 0.5 * (low + high);
    return Vec3d(K * (R * std::sin(a) - x), 0, K * (R * std::cos(a) - z));
  };
  for (const double x : {0.0, 5e-5, -2e-4, 4e-4})
    for (const double z : {0.5e-3, 0.9e-3, 1.3e-3}) {
      const Mat3d closed = felt_on_edge(K, R, Vec3d(x, 0, z), Vec3d::UnitY());
      const Vec3d by_x = -(force(x + h, z) - force(x - h, z)) / (2 * h);
      const Vec3d by_z = -(force(x, z + h) - force(x, z - h)) / (2 * h);
      CHECK((by_x - closed.col(0)).norm() <= 1e-2 * K);
      CHECK((by_z - closed.col(2)).norm() <= 1e-2 * K);
    }
}

// Pressed onto a block's edge between vertices, without friction: what is felt is the closed form's round the place
// that holds the ball, and a tick after the device has moved, as the search knows how the ball rolls. Where it passes
// between the image's voxels the edge is blunt, so that deeper the ball rolls less: there between that and K.
TEST_CASE("an edge of 90 degrees is felt as a ball that rolls over it, at once") {
  const RasterOptions o{.size = {64, 64, 64}};
  constexpr double kMove = 5e-6;
  const Vec3d up = Vec3d::UnitZ(), top = o.middle() + Vec3d(3e-5, 0, 0);
  const Vec3d a = Vec3d(1, 0, 1).normalized(), b = Vec3d(-1, 0, 1).normalized();
  const auto bone = rasterise<std::uint8_t>(Both<HalfSpace, HalfSpace>{{top, a}, {top, b}}, o);
  DepthMap map(bone, o.isovalue());
  double off_up = 0, off_across = 0, late = 0, deepest = 0, direction = 0;
  for (const double offset : {-1e-4, -4e-5, 0.0, 6e-5})
    for (const double pull : {4e-4, 8e-4}) {
      CoupledToolRenderer tool(ToolDiscretization<SurfaceCounts, double>(kBall, SurfaceCounts::thesis()),
                               FromDepthMap(map), CoupledOptions{.stiffness = 800});
      const auto field = tool.field(bone, o.isovalue());
      const Vec3d start = top + Vec3d(offset, 2e-5, kBall.tip_radius + 2e-4);
      const auto force = [&](const Vec3d& p) { return in_double(render_at(tool, field, tool_at(p, up)).wrench).force; };
      Vec3d p = start;
      for (int i = 0; i <= 100; ++i) p = start - i / 100.0 * (pull + 2e-4) * up, static_cast<void>(force(p));
      for (int i = 0; i < 60; ++i) static_cast<void>(force(p));
      REQUIRE(!tool.contacts().empty());
      const Vec3d edge = tool.contacts()[0].position;
      const Vec3d centre = tool.proxy_pose().translation();
      deepest = std::max(deepest, (top - edge).z());
      direction = std::max(direction, angle_deg(force(p), centre - edge));
      Vec3d d = p - edge;
      d.y() = 0;
      const double k_c = tool.contact_stiffness();
      const double K = 800 * k_c / (800 + k_c);
      const Mat3d closed = felt_on_edge(K, kBall.tip_radius, d, Vec3d::UnitY());
      for (const Vec3d& way : {Vec3d(Vec3d::UnitZ()), Vec3d(Vec3d::UnitX())}) {
        const Vec3d rest = force(p);
        const Vec3d at_once = -(force(p + kMove * way) - rest) / kMove;
        for (int i = 0; i < 60; ++i) static_cast<void>(force(p + kMove * way));
        const Vec3d felt = -(force(p + kMove * way) - rest) / kMove;
        for (int i = 0; i < 60; ++i) static_cast<void>(force(p));
        late = std::max(late, (felt - at_once).norm() / K);
        CHECK(felt.dot(way) >= way.dot(closed * way) - 0.1 * K);
        CHECK(felt.dot(way) <= 1.01 * K);
        double& off = way.z() > 0 ? off_up : off_across;
        if (pull < 5e-4) off = std::max(off, (felt - closed * way).norm() / K);
      }
    }
  MESSAGE("off the closed form: pressed by ", 100 * off_up, " %, to the side by ", 100 * off_across, " %; late by ",
          100 * late, " %; force off the ball's radius by ", direction, " deg; the edge lies ", 1e3 * deepest,
          " mm deep at most");
  CHECK(off_up <= 0.02);
  CHECK(off_across <= 0.1);
  CHECK(late <= 0.02);
  CHECK(direction <= 0.1);
  CHECK(deepest <= kVoxel);
}

// Slid over an edge with friction, the device .8 mm below where the ball first touches: what is felt changes with the
// hand, by K a metre and half as much again where the ball rolls. Were each vertex held for itself, what holds the ball
// would change between vertices, by up to a quarter of what is felt in a tick.
TEST_CASE("friction: a ball slid over an edge is let go in no tick") {
  const RasterOptions o{.size = {64, 64, 64}};
  constexpr double kMove = 3e-5;
  for (const double degrees : {90.0, 30.0}) {
    const double half = degrees / 2 * 0.017453292519943295;
    const Vec3d a(std::cos(half), 0, std::sin(half)), b(-std::cos(half), 0, std::sin(half));
    double most = 0;
    for (const double aside : {-1e-4, 3e-5}) {
      const Vec3d top = o.middle() + Vec3d(aside, 0, 0);
      const auto bone = rasterise<std::uint8_t>(Both<HalfSpace, HalfSpace>{{top, a}, {top, b}}, o);
      DepthMap map(bone, o.isovalue());
      CoupledToolRenderer tool(ToolDiscretization<SurfaceCounts, double>(kBall, SurfaceCounts::thesis()),
                               FromDepthMap(map), CoupledOptions{.stiffness = 800}, Coulomb(0.3, 0.3));
      const auto field = tool.field(bone, o.isovalue());
      const auto force = [&](double x, double depth) {
        const Vec3d p = top + Vec3d(x, 0, kBall.tip_radius - depth);
        return in_double(render_at(tool, field, tool_at(p, Vec3d::UnitZ())).wrench).force;
      };
      Vec3d before = Vec3d::Zero();
      for (int i = 20; i >= 0; --i) before = force(-3e-3, 8e-4 - 1e-4 * i);
      for (int i = 1; i < 200; ++i) {
        const Vec3d now = force(-3e-3 + kMove * i, 8e-4);
        most = std::max(most, (now - before).norm());
        before = now;
      }
    }
    MESSAGE("over an edge of ", degrees, " degrees what is felt changes by ", most, " N in a tick at most");
    CHECK(most <= 1.5 * 800 * kMove + 0.02);
  }
}

// What any tool on an image of a sharp crest has to go by: the interpolant's own surface, blurred by a voxel, lies a
// good way below the crest.
TEST_CASE("an image's surface lies below sharp crests") {
  const RasterOptions o{.size = {64, 64, 64}};
  for (const auto& [degrees, below] : {std::pair(90.0, 0.118e-3), std::pair(30.0, 0.446e-3)}) {
    const double half = degrees / 2 * 0.017453292519943295;
    const Vec3d top = o.middle() + Vec3d(3e-5, 0, 0);
    const Vec3d a(std::cos(half), 0, std::sin(half)), b(-std::cos(half), 0, std::sin(half));
    const auto bone = rasterise<std::uint8_t>(Both<HalfSpace, HalfSpace>{{top, a}, {top, b}}, o);
    const DensityField<std::uint8_t, double, AnalyticGradient> field(bone, o.isovalue());
    double highest = 1;
    for (double x = -2e-4; x <= 2e-4; x += 1e-5) {
      double z = 0;
      while (z < 1.5e-3 && field.value(top + Vec3d(x, 0, -z)) < 0) z += 2e-6;
      highest = std::min(highest, z);
    }
    MESSAGE("below an edge of ", degrees, " degrees by ", 1e3 * highest, " mm");
    CHECK(highest == doctest::Approx(below).epsilon(0.03));
  }
}

}  // namespace
