// SPDX-License-Identifier: MIT
#pragma once

#include "speed/features/scene.hpp"

#include <trephine/device/servo_loop.hpp>

namespace trephine::bench {

/// Plays a path and keeps what it is sent.
class PlayedDevice {
 public:
  void begin(std::span<const TickInput> path, std::span<Outcome> out) noexcept {
    path_ = path;
    out_ = out;
    at_ = 0;
  }
  [[nodiscard]] DeviceCapabilities capabilities() const { return {.max_force = 3.3, .max_torque = 0.1, .rate = 1000}; }
  DeviceStatus read(DeviceState& state) noexcept {
    const TickInput& input = path_[std::min(at_, path_.size() - 1)];
    state.X_DH = input.X_WT;
    state.buttons = input.spindle_on ? 1 : 0;
    return DeviceStatus::kOk;
  }
  DeviceStatus write(const Wrenchd& wrench) noexcept {
    if (at_ < out_.size()) out_[at_].wrench = wrench;
    ++at_;
    return DeviceStatus::kOk;
  }
  void advance(double) noexcept {}

 private:
  std::span<const TickInput> path_;
  std::span<Outcome> out_;
  std::size_t at_ = 0;
};

/// A scene in a servo loop that waits for nothing. `Observer` is told of each tick; its outcome is what is sent.
template <class Scene, class Observer>
class LoopedScene final : public FeatureScene {
 public:
  LoopedScene(Scene scene, Observer observer, bool statistics)
      : scene_(std::move(scene)),
        observer_(std::move(observer)),
        loop_(device_, scene_, Registration{}, ServoOptions{.rate = 1000, .measure = statistics}, NoPacing{}) {}

  void run(std::span<const TickInput> path, double dt, std::span<Outcome> out) noexcept override {
    scene_.reset();
    if constexpr (requires { observer_.clear(); }) observer_.clear();
    device_.begin(path, out);
    (void)loop_.run_for(std::chrono::duration<double>(static_cast<double>(path.size()) * dt), observer_);
  }
  [[nodiscard]] std::size_t bytes() const noexcept override {
    return sizeof(scene_) + sizeof(loop_) + (std::is_empty_v<Observer> ? 0 : sizeof(Observer));
  }
  [[nodiscard]] std::size_t wrapped_bytes() const noexcept override { return sizeof(LoopedScene); }

 private:
  Scene scene_;
  PlayedDevice device_;
  [[no_unique_address]] Observer observer_;
  ServoLoop<PlayedDevice, Scene, NoPacing> loop_;
};

template <class Renderer, class Observer>
[[nodiscard]] std::unique_ptr<FeatureScene> loop_of(const Place& place, const Settings& settings, Renderer renderer,
                                                    Observer observer) {
  using Scene = HapticScene<std::uint8_t, Renderer>;
  return std::make_unique<LoopedScene<Scene, Observer>>(Scene(place.bone, place.isovalue, std::move(renderer)),
                                                        std::move(observer), settings.statistics);
}

}  // namespace trephine::bench
