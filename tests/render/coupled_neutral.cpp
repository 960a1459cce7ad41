// SPDX-License-Identifier: MIT
#include "render/render_helpers.hpp"

#include <trephine/render/coupled_tool_renderer.hpp>

#include <doctest/doctest.h>

#include <limits>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr Burr kBall{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0};
constexpr Burr kDrill{.tip_radius = 0.0015, .shaft_radius = 0.0008, .shaft_length = 0.040};
const RasterOptions kRoom{.size = {96, 96, 96}};

using Tool = ToolDiscretization<SurfaceCounts, float>;

/// Poses of a tip that is pressed, led and turned on what is below `top`, at a hand's pace times `pace`.
std::vector<Posed> wander(const Vec3d& top, int ticks, double pace) {
  std::vector<Posed> path;
  for (int i = 0; i < ticks; ++i) {
    const double t = 1e-3 * pace * i;
    const Vec3d turn(0.2 * std::sin(7 * t), 0.15 * std::sin(5 * t + 1), 0.3 * t);
    const Vec3d p(0.002 * std::sin(9 * t), 0.002 * std::cos(6 * t), 0.0008 * std::sin(11 * t));
    path.push_back(make_pose<double>(rotation_from_vector(turn), top + Vec3d(0, 0, kBall.tip_radius) + p));
  }
  return path;
}

struct Same {
  int touching = 0;
  int differ = 0;
  int steps = 0;  // most in a tick
  bool shaft = false;
};

/// The answers of both tools along a path.
template <class A, class B, class Bone>
Same compare(A a, B b, const Bone& bone, const std::vector<Posed>& path, bool torque) {
  Same same;
  const auto field_a = a.field(bone, kRoom.isovalue());
  const auto field_b = b.field(bone, kRoom.isovalue());
  for (const Posed& X : path) {
    const auto x = render_at(a, field_a, X);
    const auto y = render_at(b, field_b, X);
    const bool equal = x.wrench.force == y.wrench.force && (!torque || x.wrench.torque == y.wrench.torque) &&
                       x.status == y.status && x.contact.count == y.contact.count &&
                       a.proxy_pose().matrix() == b.proxy_pose().matrix();
    same.touching += x.contact.count > 0 ? 1 : 0;
    same.differ += equal ? 0 : 1;
    same.steps = std::max(same.steps, a.steps());
    same.shaft = same.shaft || y.contact.shaft;
  }
  return same;
}

// Its end goes up to 0.8 voxel a tick.
TEST_CASE("a shaft that touches nothing changes no bit") {
  const Vec3d top = kRoom.middle() + Vec3d(0, 0, 5 * kVoxel);
  const auto check = [&](const auto& shape, auto law) {
    using Law = decltype(law);
    const auto bone = rasterise<std::uint8_t>(shape, kRoom);
    DepthMap map(bone, kRoom.isovalue());
    using Renderer = CoupledToolRenderer<float, FromDepthMap, Law>;
    for (const double pace : {1.0, 5.0}) {
      const Renderer ball(Tool(kBall, SurfaceCounts::thesis()), FromDepthMap(map), {}, law);
      const Renderer drill(Tool(kDrill, SurfaceCounts::thesis()), FromDepthMap(map), {}, law);
      const Same same = compare(ball, drill, bone, wander(top, 4000, pace), true);
      CAPTURE(pace);
      CHECK(same.differ == 0);
      CHECK(same.touching > 1000);
      CHECK(same.touching < 3500);
      CHECK(same.steps > 1);
      CHECK_FALSE(same.shaft);
    }
  };
  const HalfSpace plane{top, Vec3d(0.1, 0.05, 1).normalized()};
  const Ball ball{top - 12 * kVoxel * Vec3d::UnitZ(), 12 * kVoxel};
  SUBCASE("plane") { check(plane, Frictionless{}); }
  SUBCASE("ball") { check(ball, Frictionless{}); }
  SUBCASE("with friction") { check(ball, Coulomb(0.3, 0.25)); }
}

// Shafts that touch too: a spring of infinite stiffness leaves nothing to find.
TEST_CASE("a rotation that is held answers as a tool that finds translation alone") {
  const Vec3d top = kRoom.middle() + Vec3d(0, 0, 5 * kVoxel);
  const auto bone = rasterise<std::uint8_t>(Ball{top - Vec3d(0.003, 0, 8 * kVoxel), 12 * kVoxel}, kRoom);
  DepthMap map(bone, kRoom.isovalue());
  const CoupledOptions held{.rotational_stiffness = std::numeric_limits<double>::infinity()};
  const auto check = [&](auto law) {
    using Law = decltype(law);
    const CoupledToolRenderer<float, FromDepthMap, Law, TranslationOnly> moves(Tool(kDrill, SurfaceCounts::thesis()),
                                                                               FromDepthMap(map), {}, law);
    const CoupledToolRenderer<float, FromDepthMap, Law, SixDof> turns(Tool(kDrill, SurfaceCounts::thesis()),
                                                                      FromDepthMap(map), held, law);
    for (const double pace : {1.0, 5.0}) {
      const Same same = compare(moves, turns, bone, wander(top - Vec3d(0, 0, 0.006), 4000, pace), true);
      CAPTURE(pace);
      CHECK(same.differ == 0);
      CHECK(same.touching > 1000);
      CHECK(same.shaft);
    }
  };
  SUBCASE("without friction") { check(Frictionless{}); }
  SUBCASE("with friction") { check(Coulomb(0.3, 0.25)); }
}

}  // namespace
