// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"

#include <limits>
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
  auto bone = make_block<std::uint8_t>({.stored_gradients = true});
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
  VoxelGrid<std::uint8_t> bone({.size = size, .spacing = {1e-3, 1e-3, 1e-3}, .outside = 0.0}, voxels,
                               {.stored_gradients = true});
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
    for (const auto density : std::initializer_list<std::uint8_t>{0, 127, 128, 255}) {
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
