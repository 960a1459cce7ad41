// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/device.hpp>
#include <trephine/device/registration.hpp>

#include <concepts>
#include <memory>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <variant>

namespace devices {

using trephine::Mat3d, trephine::Vec3d;

/// A device of any kind, so that a program is compiled for one type and chooses at run time. As `HapticDevice`; the
/// calls cost a virtual one each.
class AnyDevice {
 public:
  AnyDevice() = default;
  AnyDevice(const AnyDevice&) = delete;
  AnyDevice& operator=(const AnyDevice&) = delete;
  virtual ~AnyDevice() = default;
  [[nodiscard]] virtual trephine::DeviceCapabilities capabilities() const = 0;
  [[nodiscard]] virtual trephine::DeviceStatus read(trephine::DeviceState& state) noexcept = 0;
  virtual trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept = 0;
  /// Simulated devices alone: time passes [s]. May throw.
  virtual void advance(double) {}
  /// Why it failed and what to do; empty while it works. Not in the servo thread.
  [[nodiscard]] virtual std::string fault_text() const = 0;
};

/// The same for a device with a scheduler of its own, as `SelfPacedDevice`.
class AnyPacedDevice : public AnyDevice {
 public:
  virtual trephine::DeviceStatus start(trephine::ServoCallback callback, void* user) noexcept = 0;
  virtual void stop() noexcept = 0;
};

static_assert(trephine::HapticDevice<AnyDevice> && !trephine::SelfPacedDevice<AnyDevice>);
static_assert(trephine::SelfPacedDevice<AnyPacedDevice>);

/// Holds a device and what it needs to live: `Parts` are destroyed after it.
template <class Base, class Device, class... Parts>
class Holding final : public Base {
 public:
  explicit Holding(std::unique_ptr<Device> device, std::unique_ptr<Parts>... parts)
      : parts_(std::move(parts)...), device_(std::move(device)) {}
  [[nodiscard]] trephine::DeviceCapabilities capabilities() const override { return device_->capabilities(); }
  [[nodiscard]] trephine::DeviceStatus read(trephine::DeviceState& state) noexcept override {
    return device_->read(state);
  }
  trephine::DeviceStatus write(const trephine::Wrenchd& wrench_H_D) noexcept override {
    return device_->write(wrench_H_D);
  }
  void advance(double dt) override {
    if constexpr (trephine::AdvancedDevice<Device>) device_->advance(dt);
  }
  [[nodiscard]] std::string fault_text() const override {
    if constexpr (requires {
                    { std::as_const(*device_).fault_text() } -> std::convertible_to<std::string>;
                  })
      return std::as_const(*device_).fault_text();
    else
      return {};
  }
  // Instantiated for paced devices alone: nothing calls them otherwise.
  trephine::DeviceStatus start(trephine::ServoCallback callback, void* user) noexcept {
    return device_->start(callback, user);
  }
  void stop() noexcept { device_->stop(); }

 private:
  std::tuple<std::unique_ptr<Parts>...> parts_;
  std::unique_ptr<Device> device_;
};

/// A device that is open, with what a program needs to lay its workspace over a scene.
struct Opened {
  std::variant<std::unique_ptr<AnyDevice>, std::unique_ptr<AnyPacedDevice>> device;
  /// The device's base in the user's axes: x to the right, y up, z toward the user.
  Mat3d R_UD = Mat3d::Identity();
  /// The tool in the handle: its +z toward the hand.
  Mat3d R_HT = Mat3d::Identity();
  /// A place in about the middle of its workspace, in D [m].
  Vec3d p_D = Vec3d::Zero();

  /// Where the tool is where the middle of the workspace is at p_W, and the user's axes are R_WU.
  [[nodiscard]] trephine::Registration registration(const Mat3d& R_WU, const Vec3d& p_W, double scale = 1) const {
    const Mat3d R_WD = R_WU * R_UD;
    return trephine::Registration(trephine::make_pose<double>(R_WD, Vec3d(p_W - scale * (R_WD * p_D))),
                                  trephine::make_pose<double>(R_HT, Vec3d::Zero()), scale);
  }

  /// Calls `f` with the device as what it is, polled or paced.
  template <class F>
  decltype(auto) use(F&& f) {
    return std::visit([&](auto& held) -> decltype(auto) { return f(*held); }, device);
  }
};

template <class Device, class... Parts>
[[nodiscard]] auto hold(std::unique_ptr<Device> device, std::unique_ptr<Parts>... parts) {
  using Base = std::conditional_t<trephine::SelfPacedDevice<Device>, AnyPacedDevice, AnyDevice>;
  return std::unique_ptr<Base>(
      std::make_unique<Holding<Base, Device, Parts...>>(std::move(device), std::move(parts)...));
}

}  // namespace devices
