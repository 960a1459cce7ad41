// SPDX-License-Identifier: MIT
// trephine in a world of CHAI3D: its device drives the drill, in its haptic thread, and its volume follows the cuts.
// Not affiliated with CHAI3D.
#include "drawn_bone.hpp"
#include "options.hpp"
#include "simulated_hand.hpp"
#include "view.hpp"

#include <trephine/device/servo_loop.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/trephine.hpp>

#include <devices/CHapticDeviceHandler.h>
#include <lighting/CDirectionalLight.h>
#include <system/CThread.h>
#include <world/CShapeCylinder.h>
#include <world/CShapeSphere.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace trephine;
using namespace chai3d_host;

std::atomic<bool> interrupted{false};
void on_interrupt(int) { interrupted.store(true); }

constexpr Burr kBurr{.tip_radius = 2_mm, .shaft_radius = 1_mm, .shaft_length = 40_mm};

/// A dome of bone, 30 mm wide and 13 mm high, whose top is at W's origin, where the middle of a device's workspace is.
VoxelGrid<std::int16_t> dome() {
  constexpr int kSize = 80, kHeight = 40;
  constexpr double kStep = 0.4_mm;
  const Posed X_WG = make_pose<double>(Mat3d::Identity(), kStep * Vec3d(-39.5, -39.5, -35));
  std::vector<std::int16_t> hounsfield;
  for (int k = 0; k < kHeight; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        const Vec3d p = X_WG * Vec3d(kStep * Vec3d(i, j, k)) + Vec3d(0, 0, 13_mm);
        const double radius = p.cwiseQuotient(Vec3d(15, 15, 13)).norm() * 1e3;  // 1: on the surface
        hounsfield.push_back(static_cast<std::int16_t>(std::clamp(300 + 13e3 * (1 - radius), -1000.0, 1200.0)));
      }
  return VoxelGrid<std::int16_t>({{kSize, kSize, kHeight}, {kStep, kStep, kStep}, X_WG}, hounsfield);
}

chai3d::cGenericHapticDevicePtr find_device(bool simulated) {
  if (simulated) return std::make_shared<SimulatedHand>();
  chai3d::cHapticDeviceHandler handler;
  chai3d::cGenericHapticDevicePtr device;
  if (!handler.getDevice(device)) throw std::runtime_error("CHAI3D finds no device: connect one, or run --simulated");
  device->setEnableGripperUserSwitch(true);  // where the handle is a gripper, closing it is the button
  return device;
}

/// The burr at its object's origin and the shaft along its z axis, as T has them.
chai3d::cGenericObject* add_drill(chai3d::cWorld& world) {
  auto* drill = new chai3d::cGenericObject;  // the world deletes it
  world.addChild(drill);
  auto* ball = new chai3d::cShapeSphere(kBurr.tip_radius);
  ball->m_material->setGrayLevel(0.7F);
  drill->addChild(ball);
  auto* shaft = new chai3d::cShapeCylinder(kBurr.shaft_radius, kBurr.shaft_radius, kBurr.shaft_length);
  shaft->m_material->setGrayLevel(0.5F);
  drill->addChild(shaft);
  return drill;
}

chai3d::cCamera* add_camera(chai3d::cWorld& world) {
  auto* camera = new chai3d::cCamera(&world);
  world.addChild(camera);
  camera->set(to_chai3d(Vec3d(55_mm, 18_mm, 42_mm)), to_chai3d(Vec3d(0, 0, -3_mm)), chai3d::cVector3d(0, 0, 1));
  camera->setClippingPlanes(10_mm, 500_mm);
  camera->setFieldViewAngleDeg(32);
  auto* light = new chai3d::cDirectionalLight(&world);
  world.addChild(light);
  light->setDir(-0.4, 0.5, -1);
  light->setEnabled(true);
  return camera;
}

int run(const Options& options) {
  VoxelGrid<std::int16_t> bone = dome();
  Device device(find_device(options.simulated));
  const DeviceCapabilities able = device.capabilities();
  const auto within = [](double most, double wanted) { return most > 0 ? std::min(most, wanted) : wanted / 2; };
  const CoupledToolRenderer drill{kBurr, CoupledOptions{.stiffness = within(able.stiffness, 800),
                                                        .rotational_stiffness = within(able.angular_stiffness, 0.3),
                                                        .force = able.max_force,
                                                        .torque = able.output_dof == 6 ? able.max_torque : 0}};
  HapticScene scene{bone, 300, drill, Cutting{AdvancingCut{.speed = 4_mm}}, DeviceLimits{.force = able.max_force}};
  ServoLoop loop(device, scene, registration());
  std::printf("device: %s, %d/%d degrees of freedom in/out, %.2g N\n", able.name.c_str(), able.input_dof,
              able.output_dof, able.max_force);
  for (const std::string& warning : loop.warnings()) std::printf("note: %s\n", warning.c_str());

  // Whoever draws outlives what is drawn.
  const bool draws = !options.headless || !options.picture.empty();
  const std::unique_ptr<View> view = draws ? make_view(800, 600, !options.headless) : nullptr;
  chai3d::cWorld world;
  world.m_backgroundColor.setWhite();
  chai3d::cCamera& camera = *add_camera(world);
  chai3d::cGenericObject& drawn_drill = *add_drill(world);
  DrawnBone drawn_bone(world, bone, Grey{});
  drawn_bone.object().m_material->setWhiteLinen();

  // CHAI3D's haptic thread.
  Mailbox<Posed> drill_pose;
  std::atomic<bool> is_over{false};
  RunReport report;
  double removed_mm3 = 0, most_force = 0;
  auto haptics = [&] {
    report = loop.run_until(
        [&](const TickRecord& tick) {
          return interrupted.load() ||
                 (options.seconds > 0 && static_cast<double>(tick.index + 1) * loop.period() >= options.seconds);
        },
        [&](const TickRecord& tick) {
          removed_mm3 += tick.result.removed_mm3;
          most_force = std::max(most_force, tick.sent.force.norm());
          drill_pose.post(scene.visual_pose_W());
        });
    is_over.store(true);  // the last of this thread: it cannot be joined
  };
  chai3d::cThread thread;
  thread.start([](void* run_loop) { (*static_cast<decltype(haptics)*>(run_loop))(); }, chai3d::CTHREAD_PRIORITY_HAPTICS,
               &haptics);

  // This thread draws.
  std::size_t bricks = 0, updates = 0;
  for (bool last = false; !last;) {
    last = is_over.load();  // before the update, so that the last update sees the last cut
    const std::size_t changed = drawn_bone.update();
    bricks += changed;
    updates += changed > 0;
    if (const Posed* X_WV = drill_pose.take()) {
      drawn_drill.setLocalPos(to_chai3d(Vec3d(X_WV->translation())));
      drawn_drill.setLocalRot(to_chai3d(Mat3d(X_WV->linear())));
    }
    if (view && !view->draw(camera)) loop.stop();
    if (!view) std::this_thread::sleep_for(std::chrono::milliseconds(15));
  }

  std::cout << report;
  std::printf("  %.0f Hz, removed %.2f mm3, at most %.2f N\n", static_cast<double>(report.ticks) / report.wall_time,
              removed_mm3, most_force);
  std::size_t wrong = drawn_bone.differences();
  std::printf("CHAI3D's image: %zu voxels changed, in %zu bricks and %zu updates; %zu differ from the bone\n",
              drawn_bone.changed_voxels(), bricks, updates, wrong);
  if (view) {
    const std::size_t in_texture = view->differences(drawn_bone.texture());
    std::printf("its texture: %zu voxels differ from the image\n", in_texture);
    wrong += in_texture;
  }
  if (!options.picture.empty() && !view->save(camera, options.picture))
    throw std::runtime_error("cannot write the picture " + options.picture);
  return report.end == RunEnd::kFault || wrong > 0 ? 1 : 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGINT, on_interrupt);
  return guarded_main(argc, argv, run);
}
