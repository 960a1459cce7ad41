// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"
#include "support/near.hpp"

#include <limits>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

std::vector<TickInput> hostile_inputs() {
  std::vector<TickInput> inputs;
  const auto add = [&inputs](const Mat3d& R, const Vec3d& p) {
    inputs.push_back({.X_WT = make_pose<double>(R, p), .spindle_on = true});
  };
  const Mat3d I = Mat3d::Identity();
  const Vec3d in_bone(0.012, 0.012, 0.006);
  for (const double bad : {kNan, kInf, -kInf, 1e30, -1e30, 1e200, 1e3, -999.0, 1e-40, 5e-324})
    for (int axis = 0; axis < 3; ++axis) {
      Vec3d p = in_bone;
      p[axis] = bad;
      add(I, p);
    }
  for (const double bad : {kNan, kInf, 0.0, 2.0, -1.0, 1e-40}) {
    Mat3d R = I;
    R(1, 1) = bad;
    add(R, in_bone);
    add(bad * I, in_bone);
  }
  for (const double far : {0.005, 0.02, 0.05, -0.05}) add(I, in_bone + Vec3d(far, 0, far));  // jumps in, out, across
  add(rotation_from_vector(Vec3d(3.14159265358979, 0, 0)), in_bone);                         // 180° turns
  add(rotation_from_vector(Vec3d(0, 3.14159265358979, 0)), in_bone);
  for (int i = 0; i < 5; ++i) add(rotation_from_vector(Vec3d(0, 10.0 * i, 0)), in_bone);  // 1e4 rad/s at 1 kHz
  return inputs;
}

template <class R>
void survive(R renderer, const std::string& name) {
  CAPTURE(name);
  auto bone = make_block<std::uint8_t>();
  auto scene = make_full_scene(bone, std::move(renderer));
  const TickInput away{.X_WT = make_pose<double>(Mat3d::Identity(), Vec3d(0.012, 0.012, 0.022))};
  const auto inputs = hostile_inputs();
  std::mt19937 random(20081);
  for (int i = 0; i < 3000; ++i) {
    const TickInput& input = inputs[random() % inputs.size()];
    const double dts[] = {0.0, -1.0, 1e-9, 1e-3, 10.0, kNan, kInf};
    const TickResult r = scene.tick(input, dts[random() % 7]);
    REQUIRE(is_finite(r.wrench));
    REQUIRE(r.wrench.force.norm() <= kForceLimit);
    REQUIRE(r.wrench.torque.norm() <= kTorqueLimit);
    REQUIRE((r.removed_mm3 >= 0 && std::isfinite(r.removed_mm3)));
    if (r.status == Status::kBadInput) REQUIRE(r.wrench == Wrenchd::zero());
    if (i % 10 != 9) continue;
    // Good input again: valid within two ticks. The filter's memory decays, contact does not linger.
    static_cast<void>(scene.tick(away, 1e-3));
    const TickResult second = scene.tick(away, 1e-3);
    REQUIRE(second.status == Status::kOk);
    REQUIRE(second.contact.count == 0);
  }
}

/// No voxel, one voxel, all voxels: whatever the grid, every answer is finite.
template <class R>
void survive_grid(const std::array<int, 3>& size, std::uint8_t density, R renderer) {
  std::vector<std::uint8_t> voxels(static_cast<std::size_t>(size[0] * size[1] * size[2]), density);
  VoxelGrid<std::uint8_t> bone({.size = size, .spacing = {2e-3, 2e-3, 2e-3}, .outside = 0.0}, voxels);
  auto scene = make_full_scene(bone, std::move(renderer));
  for (int i = 0; i < 200; ++i) {
    const double z = 0.004 - 4e-5 * i;
    const TickResult r = scene.tick(
        {.X_WT = make_pose<double>(rotation_from_vector(Vec3d(0.02 * i, 0, 0)), Vec3d(0, 0, z)), .spindle_on = i > 100},
        1e-3);
    REQUIRE(is_finite(r.wrench));
    REQUIRE(r.wrench.force.norm() <= kForceLimit);
    if (density == 0) REQUIRE(r.contact.count == 0);
  }
}

template <class S>
void survive_all() {
  survive(make_line<S>(), "line");
  survive(make_thesis_line<S>(), "thesis line");
  survive(make_surface<S>(), "surface");
  survive(make_thesis_surface<S>(), "thesis surface");
  for (const auto& size : {std::array{1, 1, 1}, std::array{2, 2, 2}, std::array{9, 9, 1}, std::array{20, 20, 20}})
    for (const auto density : std::initializer_list<std::uint8_t>{0, 127, 138, 255}) {
      survive_grid(size, density, make_line<S>());
      survive_grid(size, density, make_thesis_line<S>());
      survive_grid(size, density, make_surface<S>());
      survive_grid(size, density, make_thesis_surface<S>());
    }
}

}  // namespace

TEST_CASE("whatever the pose and the interval, wrenches are finite, limited, and good input recovers") {
  survive_all<float>();
  survive_all<double>();
}

namespace {

/// A scene from what may be refused: how it ended, in words. Played at hostile poses it must stay finite and limited,
/// and answer the second good pose well where there is a place free of bone.
enum class Fate { kRefused, kPlayed };

template <class Make>
Fate fate(Make&& make, const Posed& away) {
  try {
    auto scene = make();
    const auto inputs = hostile_inputs();
    for (std::size_t i = 0; i < inputs.size(); ++i) {
      const TickResult r = scene.tick(inputs[i], i % 5 == 0 ? kNan : 1e-3);
      REQUIRE(is_finite(r.wrench));
      REQUIRE(r.wrench.force.norm() <= kForceLimit);
      REQUIRE(r.wrench.torque.norm() <= kTorqueLimit);
      REQUIRE((r.removed_mm3 >= 0 && std::isfinite(r.removed_mm3)));
      if (i % 4 != 3) continue;
      static_cast<void>(scene.tick({.X_WT = away}, 1e-3));
      const TickResult second = scene.tick({.X_WT = away}, 1e-3);
      REQUIRE(second.status == Status::kOk);
      REQUIRE(second.contact.count == 0);
    }
    return Fate::kPlayed;
  } catch (const std::invalid_argument& refused) {
    REQUIRE(std::string(refused.what()).rfind("trephine::", 0) == 0);
    return Fate::kRefused;
  }
}

template <class Density, class R>
auto limited_scene(VoxelGrid<Density>& bone, double isovalue, R renderer) {
  return HapticScene{bone, isovalue, std::move(renderer), Cutting{{.rate = 2e4}},
                     DeviceLimits{kForceLimit, kTorqueLimit}};
}

Posed at_place(const Vec3d& p) { return make_pose<double>(Mat3d::Identity(), p); }
const Posed kFree = at_place(Vec3d(0.012, 0.012, 0.030));

using LineTool = ToolDiscretization<LineCounts, float>;
using SurfaceTool = ToolDiscretization<SurfaceCounts, float>;

}  // namespace

TEST_CASE("hostile stiffness: refused, or finite and limited") {
  const auto line = [](double k) {
    auto bone = make_block<std::uint8_t>();
    return fate(
        [&] {
          return limited_scene(bone, kIsovalue, LineApproxRenderer<float>(LineTool(kDrill, {}), {.stiffness = k}));
        },
        kFree);
  };
  const auto surface = [](double k) {
    auto bone = make_block<std::uint8_t>();
    return fate(
        [&] {
          return limited_scene(bone, kIsovalue,
                               SurfaceApproxRenderer<float>(SurfaceTool(kDrill, {}), {.stiffness = k}));
        },
        kFree);
  };
  for (const double k : {1e-9, 1.0, 800.0, 1e9, 1e20}) {
    CAPTURE(k);
    CHECK(line(k) == Fate::kPlayed);
    CHECK(surface(k) == Fate::kPlayed);
  }
  // 1e39 is infinite in single precision: it would answer nothing else than that it overflowed.
  for (const double k : {0.0, -1.0, kInf, kNan, 1e39, 1e300}) {
    CAPTURE(k);
    CHECK(line(k) == Fate::kRefused);
    CHECK(surface(k) == Fate::kRefused);
  }
}

TEST_CASE("hostile tools: of no size, larger than the grid, smaller than a voxel, one vertex, ten thousand") {
  const auto both = [](const Burr& burr, const LineCounts& line, const SurfaceCounts& surface) {
    auto bone = make_block<std::uint8_t>();
    // Far enough to one side for whatever has a size, along x so that no shaft reaches back.
    const Posed away = at_place(Vec3d(-2 - 2 * (std::isfinite(burr.tip_radius) ? std::abs(burr.tip_radius) : 0), 0, 0));
    return std::pair(
        fate([&] { return limited_scene(bone, kIsovalue, LineApproxRenderer<float>(LineTool(burr, line))); }, away),
        fate([&] { return limited_scene(bone, kIsovalue, SurfaceApproxRenderer<float>(SurfaceTool(burr, surface))); },
             away));
  };
  const auto played = std::pair(Fate::kPlayed, Fate::kPlayed), refused = std::pair(Fate::kRefused, Fate::kRefused);
  CHECK(both({.tip_radius = 0.02, .shaft_radius = 0.05, .shaft_length = 0.2}, {}, {}) == played);
  CHECK(both({.tip_radius = 0.021, .shaft_radius = 0.05, .shaft_length = 0.2}, {}, {}) == refused);
  CHECK(both({.tip_radius = 1e-5, .shaft_radius = 1e-5, .shaft_length = 1e-3}, {}, {}) == played);
  CHECK(both({.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 0}, {}, {}) == played);
  // A ball of one vertex has no inside; a shaft's row of two and slices of one are the least there is.
  CHECK(both(kDrill, {.shaft = 2}, {.sphere = 1}) == std::pair(Fate::kPlayed, Fate::kRefused));
  CHECK(both(kDrill, {.shaft = 10000}, {.sphere = 10000, .slices = 2, .per_slice = 8}) == played);
  for (const double bad : {0.0, -1e-3, kNan, kInf})
    CHECK(both({.tip_radius = bad, .shaft_radius = 0.8e-3, .shaft_length = 0.02}, {}, {}) == refused);
  for (const double bad : {-1e-3, kNan, kInf}) {
    CHECK(both({.tip_radius = 1.5e-3, .shaft_radius = bad, .shaft_length = 0.02}, {}, {}) == refused);
    CHECK(both({.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = bad}, {}, {}) == refused);
  }
}

TEST_CASE("hostile grids and isovalues: refused, or finite and limited") {
  const auto played = [](const Vec3d& spacing, const std::array<int, 3>& size, double isovalue, auto&& density) {
    std::vector<float> voxels;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) voxels.push_back(static_cast<float>(density(i, j, k)));
    const Posed away = at_place(Vec3d(-10, -10, -10));
    std::pair<Fate, Fate> fates;
    fates.first = fate(
        [&] {
          static std::optional<VoxelGrid<float>> bone;
          bone.emplace(GridGeometry{.size = size, .spacing = spacing, .outside = 0.0}, voxels);
          return limited_scene(*bone, isovalue, LineApproxRenderer<float>(LineTool(kDrill, {})));
        },
        away);
    fates.second = fate(
        [&] {
          static std::optional<VoxelGrid<float>> bone;
          bone.emplace(GridGeometry{.size = size, .spacing = spacing, .outside = 0.0}, voxels);
          return limited_scene(*bone, isovalue, SurfaceApproxRenderer<float>(SurfaceTool(kDrill, {})));
        },
        away);
    return fates;
  };
  const auto fine = std::pair(Fate::kPlayed, Fate::kPlayed), refused = std::pair(Fate::kRefused, Fate::kRefused);
  const auto full = [](int, int, int) { return 200.0; };
  const auto checkers = [](int i, int j, int k) { return (i + j + k) % 2 != 0 ? 200.0 : 0.0; };
  const std::array<int, 3> cube{12, 12, 12};
  const Vec3d millimetre = Vec3d::Constant(1e-3);
  CHECK(played(millimetre, {1, 1, 1}, 100, full) == refused);  // smaller than the burr
  for (const auto& size : {std::array{3, 2, 1}, std::array{2, 2, 2}, std::array{12, 12, 1}, cube}) {
    CHECK(played(millimetre, size, 100, full) == fine);
    CHECK(played(millimetre, size, 100, checkers) == fine);
  }
  for (const double isovalue : {1e-3, 199.9, 200.0, 200.1, 1e30})
    CHECK(played(millimetre, cube, isovalue, full) == fine);
  for (const double spacing : {2e-4, 5e-3, 2e-2}) CHECK(played(Vec3d::Constant(spacing), cube, 300, full) == fine);
  for (const double spacing : {1e-6, 1e-4, 0.1, 1e3})
    CHECK(played(Vec3d::Constant(spacing), cube, 300, full) == refused);
  CHECK(played(Vec3d(1e-6, 1e-3, 1e-3), cube, 100, checkers) == fine);  // 1 : 1000
  CHECK(played(Vec3d(1e-5, 1e-5, 1e-2), cube, 300, checkers) == fine);
  for (const double bad : {0.0, -1e-3, kNan, kInf}) CHECK(played(Vec3d(1e-3, bad, 1e-3), cube, 100, full) == refused);
  for (const double bad : {kNan, kInf, -kInf}) {
    CHECK(played(millimetre, cube, bad, full) == refused);
    CHECK(played(millimetre, cube, 100, [bad](int i, int, int) { return i == 3 ? bad : 0.0; }) == refused);
  }
  CHECK(played(millimetre, {0, 4, 4}, 100, full) == refused);
}

TEST_CASE("a fine grid far from the world's origin is felt as accurately as one at the origin, in single precision") {
  const auto force = [](const Vec3d& far) {
    std::vector<std::uint8_t> voxels;
    for (int k = 0; k < 40; ++k)
      for (int i = 0; i < 40 * 40; ++i)
        voxels.push_back(static_cast<std::uint8_t>(std::min(std::max(127.5 + 60 * (20.3 - k), 0.0), 255.0)));
    VoxelGrid<std::uint8_t> bone({.size = {40, 40, 40}, .spacing = Vec3d::Constant(1e-4), .X_WG = at_place(far)},
                                 voxels);
    const Burr burr{.tip_radius = 3e-4, .shaft_radius = 1e-4, .shaft_length = 0};
    auto line = limited_scene(bone, kIsovalue, LineApproxRenderer<float>(LineTool(burr, {})));
    auto surface = limited_scene(bone, kIsovalue, SurfaceApproxRenderer<float>(SurfaceTool(burr, {})));
    double a = 0, b = 0;
    for (int i = 0; i <= 40; ++i) {
      a = line.tick({.X_WT = at_place(far + Vec3d(2e-3, 2e-3, 2.03e-3 + 1e-5 * (20 - i)))}, 1e-3).wrench.force.z();
      b = surface.tick({.X_WT = at_place(far + Vec3d(2e-3, 2e-3, 2.33e-3 + 1e-5 * (20 - i)))}, 1e-3).wrench.force.z();
    }
    return std::pair(a, b);
  };
  const auto here = force(Vec3d::Zero());
  CHECK(here.first == near(0.16, 0.011));  // .2 mm at 800 N/m
  CHECK(here.second > 0.05);
  // 800 m away a double resolves 1e-13 m; single precision alone would resolve .06 mm, half a voxel.
  for (const double metres : {1.0, 30.0, 800.0}) {
    const auto there = force(Vec3d(metres, -0.3 * metres, 0.1 * metres));
    CHECK(there.first == near(here.first, 3e-6));
    CHECK(there.second == near(here.second, 3e-6));
  }
}
