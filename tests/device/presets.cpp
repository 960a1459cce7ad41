// SPDX-License-Identifier: MIT
#include <trephine/device/presets.hpp>

#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/tool/named_tools.hpp>

#include "stage/fakes.hpp"
#include "support/near.hpp"

#include <algorithm>

using namespace trephine;
using namespace trephine::test;

TEST_CASE("presets: the passivity controller knows the device's readings and the contact's stiffness") {
  CHECK(device_preset("Touch").passivity.quantum == 0.055e-3);
  CHECK(device_preset("Premium 1.5 6DOF").passivity.quantum == 0.03e-3);
  for (const std::string_view name : device_preset_names()) {
    const DevicePreset p = device_preset(name);
    CHECK(p.passivity.contact_stiffness == p.stiffness);
    CHECK(p.passivity.contact_angular_stiffness == p.capabilities.angular_stiffness);
    CHECK(p.passivity.stiffness < p.stiffness);
  }
}

TEST_CASE("presets: every device's figures are those published, its options valid, its scene within its means") {
  const auto names = device_preset_names();
  CHECK(names.size() == 7);
  for (const std::string_view name : names) {
    CAPTURE(name);
    const DevicePreset p = device_preset(name);
    CHECK(p.capabilities.name == name);
    CHECK(p.limits.force == p.capabilities.max_force);
    CHECK(p.limits.torque == p.capabilities.max_torque);
    CHECK(p.budget.linear == p.capabilities.stiffness);
    CHECK((p.capabilities.output_dof == 6) == (p.capabilities.max_torque > 0));
    CHECK(refusal([&] {
            p.budget.validate();
            p.hunt_crossley.validate();
            p.passivity.validate();
            p.rate.validate();
            p.limits.validate();
          }) == "");
    auto bone = small_grid();
    auto scene = HapticScene{bone,
                             300,
                             Floor<>{p.stiffness},
                             HuntCrossley(p.hunt_crossley),
                             PassivityController(p.passivity),
                             WrenchRateLimit(p.rate),
                             p.limits};
    const TickResult r = scene.tick({.X_WT = at(0, 0, -1)}, kTick);
    CHECK(r.wrench.force.norm() <= p.capabilities.max_force);
    CHECK(r.wrench.torque.norm() <= p.capabilities.max_torque);
    // A quick hit passes: half a metre a second on the stated stiffness.
    scene.reset();
    Wrenchd before;
    for (int k = 0; k < 3; ++k) before = scene.tick({.X_WT = at(0, 0, 5e-4 - 5e-4 * k)}, kTick).wrench;
    CHECK(before.force.z() >= p.stiffness * 5e-4);
    const auto warnings = match_device(scene, p.capabilities, Registration{}, 1000);
    CHECK(std::none_of(warnings.begin(), warnings.end(),
                       [](const std::string& w) { return w.find("stiffness") != std::string::npos; }));
  }
  const DevicePreset premium = device_preset("Premium 1.5 6DOF");
  CHECK(premium.capabilities.max_force == 8.5);
  CHECK(premium.capabilities.max_torque == 0.188);
  CHECK(premium.budget.angular == 0.3);
}

TEST_CASE(
    "presets: the coupled tool takes each as it is, and a named tool with it, whether the device gives torque or not") {
  // Bone below z = 10 mm, and a ledge above the burr. The burr is pressed 1 mm into bone, the shaft against the ledge.
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) voxels.push_back(k < 20 || (i < 16 && k > 28 && k < 36) ? 1000 : -1000);
  const GridGeometry geometry{.size = {40, 40, 40}, .spacing = Vec3d::Constant(5e-4)};
  const auto press = [&](const auto& renderer, const DevicePreset& p) {
    VoxelGrid<std::int16_t> bone(geometry, voxels);
    HapticScene scene{bone, 0, renderer, p.limits};
    TickResult r;
    for (int i = 0; i <= 400; ++i) {
      const double deep = 1e-3 * std::min(1.0, i / 200.0);
      const Vec3d tip(9.2e-3 - deep, 1e-2, 11.5e-3 - deep);
      r = scene.tick({.X_WT = make_pose<double>(Mat3d::Identity(), tip)}, kTick);
    }
    CHECK(r.status == Status::kOk);
    CHECK(r.wrench.force.z() == near(p.stiffness * 1e-3, 0.3));
    CHECK(r.wrench.force.norm() <= p.capabilities.max_force);
    CHECK((r.wrench.torque.norm() > 1e-5) == (p.capabilities.output_dof == 6));
    CHECK(r.wrench.torque.norm() <= p.capabilities.max_torque);
  };
  const Burr burr{.tip_radius = 1.5e-3, .shaft_radius = 8e-4, .shaft_length = 4e-2};
  for (const std::string_view name : device_preset_names()) {
    CAPTURE(name);
    const DevicePreset p = device_preset(name);
    press(CoupledToolRenderer{burr, p}, p);
    press(CoupledToolRenderer{burr, p, Coulomb{0.1, 0.1}}, p);
    press(CoupledToolRenderer{tool_by_name("round-3"), p}, p);
  }
}

TEST_CASE("presets: a scene says that a stiffness is likely in N/mm") {
  auto bone = small_grid();
  const auto is_told = [&](double stiffness) {
    const auto warnings = HapticScene{bone, 300, Floor<>{stiffness}}.warnings();
    return std::any_of(warnings.begin(), warnings.end(),
                       [](const std::string& w) { return w.find("N/mm") != std::string::npos; });
  };
  CHECK(is_told(0.8));
  CHECK_FALSE(is_told(400));
}

TEST_CASE("presets: an unknown device is refused with the names there are") {
  const std::string message = refusal([] { (void)device_preset("Theremin"); });
  CHECK(message.find("trephine::device_preset") == 0);
  CHECK(message.find("Premium 1.5 6DOF") != std::string::npos);
  CHECK(message.find("got Theremin") != std::string::npos);
}

namespace {

/// Amplitude left [m] of a device of the preset's kind (its own damping bears the stated stiffness, barely) pressed on
/// a wall of `times` that stiffness by nobody.
double left_over(const DevicePreset& p, double times, bool staged) {
  auto bone = small_grid();
  SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.06, .damping = p.capabilities.stiffness * kTick / 2};
  o.hand_linear = {};
  o.output_dof = 3;
  o.substeps = 1;
  o.X_DH.translation() = Vec3d(0, 0, 5e-4);
  SimulatedDevice device(o, StillHand{});
  const Floor<> wall{times * p.stiffness};
  auto plain = HapticScene{bone, 300, wall, p.limits};
  auto scene = HapticScene{
      bone,    300, wall, HuntCrossley(p.hunt_crossley), PassivityController(p.passivity), WrenchRateLimit(p.rate),
      p.limits};
  DeviceState state;
  double low = 1, high = -1;
  for (int i = 0; i < 4000; ++i) {
    if (device.read(state) != DeviceStatus::kOk) return kInf;
    const TickInput input{.X_WT = state.X_DH};
    Wrenchd w = staged ? scene.tick(input, kTick).wrench : plain.tick(input, kTick).wrench;
    w.force.z() -= 1;
    w.torque.setZero();
    (void)device.write(w);
    device.advance(kTick);
    if (i < 3500) continue;
    low = std::min(low, state.X_DH.translation().z());
    high = std::max(high, state.X_DH.translation().z());
  }
  return high - low;
}

}  // namespace

TEST_CASE("presets: where the device by itself just trembles on, the stack leaves less than half of it") {
  for (const std::string_view name : device_preset_names()) {
    CAPTURE(name);
    const DevicePreset p = device_preset(name);
    const double plain = left_over(p, 1.3, false), staged = left_over(p, 1.3, true);
    CAPTURE(plain);
    CHECK(plain > 1e-4);
    CHECK(staged < 0.5 * plain);
    // Stiff devices bounce quickly: four seconds are enough for them to come to rest.
    if (p.stiffness > 2000) CHECK(staged < 4.7e-5);
  }
}
