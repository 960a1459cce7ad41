// SPDX-License-Identifier: MIT
// Contact with bone and a guard's push together, in the loop of a simulated device and hand: it comes to rest.
#include "structure/phantom.hpp"
#include "support/cases.hpp"

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/device/presets.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/guide/guides.hpp>
#include <trephine/guide/keep_in.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/structure/structure_guard.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <vector>

using namespace trephine;
using namespace trephine::test;
using namespace trephine::literals;

namespace {

constexpr double kVoxel = 0.35e-3;
constexpr int kSize = 50;
constexpr double kSurface = 10e-3;  // z of the bone's plane [m]
constexpr double kAtRest = 15e-6;   // range of a tip at rest [m]

/// Bone below a plane, blurred over a voxel.
VoxelGrid<std::int16_t> plate() {
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kSize; ++k)
    for (int n = 0; n < kSize * kSize; ++n)
      voxels.push_back(static_cast<std::int16_t>(std::lround(600 * std::erfc((k * kVoxel - kSurface) / kVoxel))));
  return {{.size = {kSize, kSize, kSize}, .spacing = Vec3d::Constant(kVoxel), .outside = 0}, voxels};
}

/// The tip's motion between two times, and what a scene gave the hand.
struct Rest {
  double range = 0;     // [m]
  double work = 0;      // [J], of the whole way
  Wrenchd last{};       // of the scene
  double contact = -1;  // [m], depth
};

/// The hand comes down at 20 mm/s beside the axis, holds 3 mm below the surface, and goes up again.
template <class Scene>
Rest press(Scene& scene, const DevicePreset& preset, const Vec3d& beside) {
  const auto wish = [&](double t) {
    const double down = std::min(t, 0.5), up = std::clamp(t - 1.8, 0.0, 0.6);
    return make_pose<double>(rotation_from_vector(Vec3d(0.1, 0, 0)),
                             Vec3d(8.5_mm, 8.5_mm, kSurface + 1.5_mm + 7_mm - 0.02 * down + 0.02 * up) + beside);
  };
  SimulatedDeviceOptions options;
  options.output_dof = preset.capabilities.output_dof;
  options.linear.limit = preset.limits.force;
  options.X_DH = wish(0);
  SimulatedDevice device(options, wish);
  Rest rest;
  Vec3d lo = Vec3d::Constant(1), hi = -lo, before = wish(0).translation();
  for (int n = 0; n < 2400; ++n) {
    DeviceState state;
    REQUIRE(device.read(state) == DeviceStatus::kOk);
    const TickResult r = scene.tick({.X_WT = state.X_DH}, 1e-3);
    Wrenchd sent = r.wrench;
    if (options.output_dof == 3) sent.torque.setZero();
    REQUIRE(device.write(sent) == DeviceStatus::kOk);
    device.advance(1e-3);
    const Vec3d p = device.X_DH().translation();
    rest.work += sent.force.dot(p - before);
    before = p;
    if (n <= 1400 || n >= 1800) continue;
    lo = lo.cwiseMin(p);
    hi = hi.cwiseMax(p);
    rest.last = r.wrench;
    rest.contact = r.contact.depth;
  }
  rest.range = (hi - lo).norm();
  return rest;
}

}  // namespace

TEST_CASE("contact, guard and all guides together rest where each keeps to its part of the budget, and not elsewhere") {
  // A nerve below the surface, and beside it a planned cavity that is narrower than the burr's ball.
  const LabelledTubes labels{
      .tubes = {{Vec3d(2_mm, 8.5_mm, kSurface - 1.9_mm), Vec3d(15_mm, 8.5_mm, kSurface - 1.9_mm), 0.7_mm},
                {Vec3d(8.5_mm, 8.5_mm, kSurface - 0.2_mm), Vec3d(8.5_mm, 8.5_mm, kSurface + 6_mm), 1_mm}},
      .structure = {0, 1},
      .size = {58, 58, 58}};
  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 30_mm};
  const auto field = labels.field(6_mm);
  for (const std::string_view name : device_preset_names()) {
    CAPTURE(name);
    const DevicePreset preset = device_preset(name);
    const auto pressed = [&](double contact_part, const std::optional<StiffnessBudget>& part) {
      auto bone = plate();
      const std::vector<GuardedStructure> guards{{.margin = 2_mm, .stiffness = 5000, .greatest_force = 3, .damping = 1},
                                                 {.mode = GuardMode::kOff}};
      GuardPotentialOptions guard_options;
      guard_options.budget = part;
      AxisGuide::Options axis{
          .point_G = Vec3d(8.5_mm, 8.5_mm, kSurface), .stiffness = 5000, .angular_stiffness = 5, .force = 3};
      DepthStop::Options stop{.point_G = Vec3d(8.5_mm, 8.5_mm, kSurface), .reach = burr.tip_radius, .stiffness = 5000};
      KeepIn::Options keep{.radius = burr.tip_radius, .stiffness = 5000, .capture = 3_mm};
      axis.budget = stop.budget = keep.budget = part;
      HapticScene scene{
          bone,
          600,
          CoupledToolRenderer{burr, CoupledOptions{.stiffness = contact_part * preset.budget.linear,
                                                   .rotational_stiffness = contact_part * preset.budget.angular}},
          StructureGuard{std::make_shared<const GuardPotential>(field, Posed::Identity(), burr, guards, guard_options)},
          AxisGuide{axis},
          DepthStop{stop},
          KeepIn{*field, 1, Posed::Identity(), keep},
          preset.limits};
      const Rest rest = press(scene, preset, Vec3d(0.4_mm, -0.3_mm, 0));
      CHECK(scene.template part<StructureGuard>().report().share > 0);
      return rest;
    };
    const Rest kept = pressed(0.4, StiffnessBudget{0.15 * preset.budget.linear, 0.15 * preset.budget.angular});
    const Rest unbound = pressed(1.0, std::nullopt);
    MESSAGE(std::string(name) << ": at rest within " << 1e6 * kept.range << " um, " << kept.last.force.norm()
                              << " N; without budgets within " << 1e6 * unbound.range << " um; energy to the hand "
                              << 1e3 * kept.work << " and " << 1e3 * unbound.work << " mJ");
    CHECK(kept.contact > 0);
    CHECK(kept.last.force.norm() > 0.3);
    CHECK(kept.range < kAtRest);
    CHECK(kept.work < 0);
    CHECK(unbound.range > kAtRest);
    CHECK(unbound.work > 0);
  }
}

TEST_CASE(
    "with half of a device's stiffness each, contact and guard come to rest, and make no more energy than a held force "
    "does") {
  // A nerve 1.2 mm below the surface: the burr's ball is in its margin before it touches bone.
  const double depth = 1.2_mm;
  LabelledTubes nerve{.tubes = {{Vec3d(2_mm, 8.5_mm, kSurface - depth - 0.7_mm),
                                 Vec3d(15_mm, 8.5_mm, kSurface - depth - 0.7_mm), 0.7_mm}},
                      .structure = {0},
                      .size = {58, 58, 58}};
  const Burr burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm, .shaft_length = 30_mm};
  const auto field = nerve.field(6_mm);
  for (const std::string_view name : device_preset_names()) {
    CAPTURE(name);
    const DevicePreset preset = device_preset(name);
    auto bone = plate();
    const StiffnessBudget half{0.5 * preset.budget.linear, 0.5 * preset.budget.angular};
    const std::vector<GuardedStructure> guards{{.margin = 2_mm, .stiffness = 5000, .greatest_force = 3, .damping = 1}};
    const auto potential = std::make_shared<const GuardPotential>(field, Posed::Identity(), burr, guards,
                                                                  GuardPotentialOptions{.budget = half});
    CHECK(potential->stiffness() <= half.linear * (1 + 1e-9));
    HapticScene scene{bone, 600, CoupledToolRenderer{burr, CoupledOptions{.stiffness = half.linear}},
                      StructureGuard{potential}, preset.limits};
    // The hand comes down at 20 mm/s, holds 3 mm below the surface for a second, and goes up again.
    const auto wish = [&](double t) {
      const double down = std::min(t, 0.5), up = std::clamp(t - 1.8, 0.0, 0.6);
      return make_pose<double>(Mat3d::Identity(),
                               Vec3d(8.5_mm, 8.5_mm, kSurface + 1.5_mm + 7_mm - 0.02 * down + 0.02 * up));
    };
    SimulatedDeviceOptions options;
    options.output_dof = preset.capabilities.output_dof;
    options.linear.limit = preset.limits.force;
    options.X_DH = wish(0);
    SimulatedDevice device(options, wish);
    double lowest = 1, highest = -1, work = 0, guarded = 0, contact = 0, guard_alone_from = 0;
    Posed last = options.X_DH;
    for (int n = 0; n < 2400; ++n) {
      DeviceState state;
      REQUIRE(device.read(state) == DeviceStatus::kOk);
      const TickResult r = scene.tick({.X_WT = state.X_DH}, 1e-3);
      const GuardReport& guard = scene.template part<StructureGuard>().report();
      Wrenchd sent = r.wrench;
      if (options.output_dof == 3) sent.torque.setZero();
      REQUIRE(device.write(sent) == DeviceStatus::kOk);
      device.advance(1e-3);
      const Posed now = device.X_DH();
      work += sent.force.dot(now.translation() - last.translation());
      last = now;
      if (guard.push.force.norm() > 0.002 && r.contact.count == 0) guard_alone_from = 1;
      if (n > 1400 && n < 1800) {
        lowest = std::min(lowest, now.translation().z());
        highest = std::max(highest, now.translation().z());
        guarded = guard.push.force.z();
        contact = r.wrench.force.z() - guarded;
      }
    }
    MESSAGE(std::string(name) << ": at rest within " << 1e6 * (highest - lowest) << " um, guard " << guarded
                              << " N, contact " << contact << " N; energy to the hand " << 1e3 * work << " mJ");
    CHECK(highest - lowest < kAtRest);
    CHECK(guarded > 0.02);
    CHECK(contact > 0.05);
    CHECK(guard_alone_from == 1);
    // A force that is held for a tick T lags by half of it: over a way s at a speed v it makes K v T s / 2.
    CHECK(work < 0.5 * preset.budget.linear * 0.02 * 1e-3 * 2 * 3_mm);
  }
}
