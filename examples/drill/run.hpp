// SPDX-License-Identifier: MIT
#pragma once

#include "bone.hpp"
#include "progress.hpp"
#include "run_log.hpp"
#include "surgeon.hpp"

#include <trephine/device/servo_loop.hpp>
#include <trephine/device/simulated_device.hpp>
#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <string>

/// One algorithm, one bone, one run: scene, device and loop put together, and a row written down each tick.
namespace drill {

/// A scene whose ticks are timed, for the log.
template <class Scene>
class Timed {
 public:
  static constexpr bool kHasTorque = Scene::kHasTorque;
  explicit Timed(Scene& scene) : scene_(scene) {}

  trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept {
    const auto start = std::chrono::steady_clock::now();
    const trephine::TickResult result = scene_.tick(input, dt);
    took_ = std::chrono::steady_clock::now() - start;
    return result;
  }
  [[nodiscard]] std::int64_t nanoseconds() const noexcept {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(took_).count();
  }

 private:
  Scene& scene_;
  std::chrono::steady_clock::duration took_{};
};

/// What a renderer knows beyond its wrench, added to a row; `slices` has room.
template <class Renderer>
void add_details(const Renderer& renderer, const trephine::Posed& X_WG, RunLog& log) {
  LogRow& row = log.rows.back();
  if constexpr (requires { renderer.report(); }) {
    const auto& r = renderer.report();
    if (!r.shaft_contact) return;
    row.spring_m = static_cast<double>(r.spring_m);
    row.lever_m = static_cast<double>(r.lever_m);
    row.reaction_N = static_cast<double>(r.reaction_N);
    row.shaft_torque_Nm = static_cast<double>(r.torque_Nm);
    row.intersection = X_WG * r.intersection.template cast<double>();
    const trephine::Vec3d spring = X_WG.linear() * r.spring.template cast<double>();
    row.reaction = row.reaction_N * spring.normalized();
  } else if constexpr (requires { renderer.slices(); }) {
    trephine::Vec3d total = trephine::Vec3d::Zero();
    int number = 0;
    for (const auto& slice : renderer.slices()) {
      ++number;
      if (slice.contacts == 0 && !slice.deep) continue;
      total += slice.torque.template cast<double>();
      if (log.slices.size() < log.slices.capacity())
        log.slices.push_back({.tick = log.rows.size() - 1,
                              .slice = number,
                              .lever_m = static_cast<double>(slice.lever_m),
                              .reaction_N = static_cast<double>(slice.force.norm()),
                              .torque_Nm = static_cast<double>(slice.torque.norm())});
    }
    row.shaft_torque_Nm = total.norm();
  }
}

/// The device's figures: a six-axis desktop arm (8.5 N, 0.19 N·m, 0.03 mm encoders), in a hand's grip.
[[nodiscard]] inline trephine::SimulatedDeviceOptions six_axis_arm(const trephine::Posed& X_DH) {
  trephine::SimulatedDeviceOptions options;
  options.linear = {.inertia = 0.075, .damping = 0.05, .friction = 0.04, .quantum = 0.03e-3, .limit = 8.5};
  options.angular = {.inertia = 4e-5, .damping = 4e-4, .friction = 0, .quantum = 1e-4, .limit = 0.188};
  options.X_DH = X_DH;
  return options;
}

/// Lets a hand, the surgeon's for one, drill with the scene. `pictured` [s]: the moment whose contact points are kept.
/// `watch` sees each row after its tick, on the haptic thread.
template <class Scene, class Hand, class Watch>
[[nodiscard]] RunLog perform(const std::string& algorithm, Scene& scene, const Hand& surgeon, double pictured,
                             bool real_time, const std::string& label, const Watch& watch) {
  RunLog log;
  log.algorithm = algorithm;
  log.real_time = real_time;
  trephine::SimulatedDevice device(six_axis_arm(surgeon(0).X_DH), surgeon);
  Timed<Scene> timed(scene);
  constexpr double kRate = 1000;
  const auto ticks = static_cast<std::size_t>(kRate * surgeon.seconds()) + 16;
  log.rows.reserve(ticks);
  if constexpr (requires { scene.renderer().slices(); })
    log.slices.reserve(ticks * std::max<std::size_t>(8, scene.renderer().slices().size() / 2));
  log.touching.resize(256);
  log.pictured = static_cast<std::size_t>(kRate * pictured);

  Progress progress(label, surgeon.seconds());
  double removed = 0;
  std::size_t touching = 0;
  const auto observe = [&](const trephine::TickRecord& tick) noexcept {
    if (log.rows.size() == log.rows.capacity()) return;
    removed += tick.result.removed_mm3;
    if (log.rows.size() == log.pictured) {
      std::array<trephine::ContactPoint<double>, 256> contacts{};
      touching = scene.contacts_W(contacts);
      for (std::size_t i = 0; i < touching; ++i) log.touching[i] = contacts[i].position;
    }
    log.rows.push_back({.time = tick.time,
                        .tick_ns = timed.nanoseconds(),
                        .hand = device.X_DH(),
                        .probe = tick.input.X_WT,
                        .proxy = scene.proxy_pose_W(),
                        .drawn = scene.visual_pose_W(),
                        .wrench = tick.result.wrench,
                        .contact = tick.result.contact,
                        .removed_mm3 = removed,
                        .status = tick.result.status,
                        .structures = tick.result.structures,
                        .cutting = tick.result.cutting});
    add_details(scene.renderer(), scene.bone().X_WG(), log);
    watch(log.rows.back());
    progress.publish(tick.time, tick.result.wrench.force.norm(), removed);
  };

  const std::chrono::duration<double> length(surgeon.seconds());
  const trephine::Registration aligned;
  if (real_time) {
    trephine::ServoLoop<decltype(device), Timed<Scene>> loop(device, timed, aligned);
    log.report = loop.run_for(length, observe);
    log.warnings = loop.warnings();
  } else {
    trephine::ServoLoop<decltype(device), Timed<Scene>, trephine::NoPacing> loop(device, timed, aligned);
    log.report = loop.run_for(length, observe);
    log.warnings = loop.warnings();
  }
  log.touching.resize(touching);
  return log;
}
template <class Scene>
[[nodiscard]] RunLog perform(const std::string& algorithm, Scene& scene, const Surgeon& surgeon, double pictured,
                             bool real_time, const std::string& label) {
  return perform(algorithm, scene, surgeon, pictured, real_time, label, [](const LogRow&) noexcept {});
}

}  // namespace drill
