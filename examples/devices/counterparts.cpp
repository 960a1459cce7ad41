// SPDX-License-Identifier: MIT
#include "counterparts.hpp"

#ifndef DEVICES_HAVE_OPENHAPTICS_SDK
#include "../openhaptics/hd_standin/hd_standin.hpp"
#endif
#ifndef DEVICES_HAVE_FORCE_DIMENSION_SDK
#include "../force_dimension/dhd_standin/dhd_standin.hpp"
#endif
#ifdef DEVICES_HAVE_HAPLY
#include "../haply/haply_device.hpp"
#include "../haply/service.hpp"
#endif

#include "../spacemouse/spacemouse_device.hpp"

#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

namespace devices {
namespace {

/// The simulated device, with what a driver between it and the loop might do.
class SimulatedCounterpart final : public Counterpart {
 public:
  explicit SimulatedCounterpart(const Hand& hand) : opened_(kind_named("simulated").open(hand)) {
    auto& arm = std::get<std::unique_ptr<AnyDevice>>(opened_.device);
    auto driver = std::make_unique<Driver>(std::move(arm));
    driver_ = driver.get();
    arm = hold(std::move(driver));
  }
  Opened& opened() override { return opened_; }
  [[nodiscard]] Vec3d felt() const override { return driver_->felt(); }
  [[nodiscard]] std::string cannot(Fault fault) const override {
    switch (fault) {
      case Fault::kNoNumber:
      case Fault::kJump:
      case Fault::kUnplugged:
        return {};
      default:
        return "no driver, no messages";
    }
  }
  void inject(Fault fault) override { driver_->fault.store(static_cast<int>(fault)); }
  void heal() override { driver_->fault.store(-1); }

 private:
  struct Driver {
    explicit Driver(std::unique_ptr<AnyDevice> a) : arm(std::move(a)) {}
    [[nodiscard]] trephine::DeviceCapabilities capabilities() const { return arm->capabilities(); }
    trephine::DeviceStatus read(trephine::DeviceState& state) noexcept {
      const int now = fault.load();
      if (now == static_cast<int>(Fault::kUnplugged)) return trephine::DeviceStatus::kFault;
      const trephine::DeviceStatus status = arm->read(state);
      if (now == static_cast<int>(Fault::kJump)) state.X_DH.translation().x() += 0.05;
      if (now == static_cast<int>(Fault::kNoNumber)) {
        state.X_DH.translation().x() = std::numeric_limits<double>::quiet_NaN();
        return trephine::DeviceStatus::kFault;  // as the concept asks of an adapter
      }
      return status;
    }
    trephine::DeviceStatus write(const trephine::Wrenchd& wrench) noexcept {
      for (std::size_t i = 0; i < 3; ++i) command[i].store(wrench.force[static_cast<int>(i)]);
      return arm->write(wrench);
    }
    void advance(double dt) { arm->advance(dt); }
    [[nodiscard]] Vec3d felt() const { return {command[0].load(), command[1].load(), command[2].load()}; }

    std::unique_ptr<AnyDevice> arm;
    std::atomic<int> fault{-1};
    std::array<std::atomic<double>, 3> command{};
  };

  Opened opened_;
  Driver* driver_ = nullptr;
};

#ifndef DEVICES_HAVE_OPENHAPTICS_SDK
class OpenHapticsCounterpart final : public Counterpart {
 public:
  explicit OpenHapticsCounterpart(const Hand& hand) : opened_(kind_named("openhaptics-simulated").open(hand)) {}
  Opened& opened() override { return opened_; }
  [[nodiscard]] Vec3d felt() const override { return hd_standin::witness(kName).felt.force; }
  [[nodiscard]] std::string cannot(Fault fault) const override {
    switch (fault) {
      case Fault::kLate:
      case Fault::kSilent:
        return "the driver calls, and holds the force until it does: its own watchdog";
      case Fault::kStale:
        return "the driver tells no age of a pose";
      case Fault::kFewerAxes:
        return "fixed when the device is opened";
      default:
        return {};
    }
  }
  void inject(Fault fault) override {
    if (fault == Fault::kNoNumber) hd_standin::break_pose(kName, true);
    if (fault == Fault::kJump) hd_standin::offset_pose(kName, 50);
    if (fault == Fault::kUnplugged) hd_standin::inject({.code = HD_COMM_ERROR, .times = 1000000, .device = kName});
    if (fault == Fault::kWrongMessage) hd_standin::inject({.code = HD_FRAME_ERROR, .times = 1000000, .device = kName});
  }
  void heal() override {
    hd_standin::break_pose(kName, false);
    hd_standin::offset_pose(kName, 0);
  }

 private:
  static constexpr const char* kName = "Default Device";
  Opened opened_;
};
#endif

#ifndef DEVICES_HAVE_FORCE_DIMENSION_SDK
class ForceDimensionCounterpart final : public Counterpart {
 public:
  explicit ForceDimensionCounterpart(const Hand& hand) : opened_(kind_named("force-dimension-simulated").open(hand)) {}
  ~ForceDimensionCounterpart() override { dhd_standin::inject(dhd_standin::Fault::kNone); }
  Opened& opened() override { return opened_; }
  [[nodiscard]] Vec3d felt() const override { return dhd_standin::witness().felt.force; }
  [[nodiscard]] std::string cannot(Fault fault) const override {
    switch (fault) {
      case Fault::kLate:
        return "a call that is late is a late loop: the device's watchdog brakes";
      case Fault::kFewerAxes:
        return "fixed when the device is opened";
      default:
        return {};
    }
  }
  void inject(Fault fault) override {
    using F = dhd_standin::Fault;
    dhd_standin::inject(fault == Fault::kSilent      ? F::kCommunication
                        : fault == Fault::kStale     ? F::kStale
                        : fault == Fault::kNoNumber  ? F::kNoNumber
                        : fault == Fault::kJump      ? F::kJump
                        : fault == Fault::kUnplugged ? F::kUnplugged
                                                     : F::kNoRotation);
  }
  void heal() override { dhd_standin::inject(dhd_standin::Fault::kNone); }

 private:
  Opened opened_;
};
#endif

#ifdef DEVICES_HAVE_HAPLY
class HaplyCounterpart final : public Counterpart {
 public:
  explicit HaplyCounterpart(const Hand& hand) : opened_(haply_with_service(hand, service_)) {}
  Opened& opened() override { return opened_; }
  [[nodiscard]] Vec3d felt() const override { return service_->witness().force; }
  [[nodiscard]] std::string cannot(Fault) const override { return {}; }
  void inject(Fault fault) override {
    using F = haply::Fault;
    constexpr std::array kOurs{F::kLate, F::kSilent,    F::kFrozen, F::kNan,
                               F::kJump, F::kUnplugged, F::kShape,  F::kHandle};
    service_->inject(kOurs[static_cast<std::size_t>(fault)], 0.3);
  }
  void heal() override {}  // by itself

 private:
  haply::Service* service_ = nullptr;  // the opened device holds it
  Opened opened_;
};
#endif

/// A 6-DOF mouse whose cap is pushed fully until the tool has gone where the hand wants it: as the driver's counts have
/// it, x right, y up, z away from the user.
class SpacemouseCounterpart final : public Counterpart {
 public:
  explicit SpacemouseCounterpart(const Hand& hand) {
    auto cap = std::make_unique<Cap>(hand);
    cap_ = cap.get();
    auto device = std::make_unique<spacemouse::Device<Cap>>(*cap, kGains);
    opened_.device = hold(std::move(device), std::move(cap));
  }
  Opened& opened() override { return opened_; }
  [[nodiscard]] Vec3d felt() const override { return Vec3d::Zero(); }
  [[nodiscard]] std::string cannot(Fault fault) const override {
    return fault == Fault::kUnplugged ? "" : "it gives no force, and is silent at rest";
  }
  void inject(Fault) override { cap_->lost.store(true); }
  void heal() override { cap_->lost.store(false); }

 private:
  static constexpr spacemouse::Gains kGains{.speed = 0.05, .turn = 1.0, .full = 350, .dead = 5};

  struct Cap {
    explicit Cap(Hand h) : hand(std::move(h)) {}
    spacemouse::Event next() noexcept {
      if (lost.load()) return {.kind = spacemouse::Event::kLost};
      const auto now = std::chrono::steady_clock::now();
      if (now < until) return {};
      if (pushed) {
        pushed = false;
        return {.kind = spacemouse::Event::kMotion};
      }
      const Vec3d way = hand(0).X_DH.translation() - at;
      if (way.norm() < 1e-6) return {};
      at += way;
      pushed = true;
      until = now + std::chrono::duration_cast<std::chrono::nanoseconds>(
                        std::chrono::duration<double>(way.norm() / kGains.speed));
      const Vec3d counts = kGains.full * way.normalized();
      return {.kind = spacemouse::Event::kMotion,
              .deflection = {.x = static_cast<int>(std::lround(counts.x())),
                             .y = static_cast<int>(std::lround(counts.y())),
                             .z = static_cast<int>(-std::lround(counts.z()))}};
    }
    Hand hand;
    Vec3d at = Vec3d::Zero();
    bool pushed = false;
    std::chrono::steady_clock::time_point until{};
    std::atomic<bool> lost{false};
  };

  Opened opened_;
  Cap* cap_ = nullptr;
};

template <class C>
std::unique_ptr<Counterpart> opened(const Hand& hand) {
  return std::make_unique<C>(hand);
}

}  // namespace

std::vector<Testable> testable_kinds() {
  std::vector<Testable> all{{"simulated", Vec3d::UnitX(), Vec3d::UnitY(), opened<SimulatedCounterpart>}};
#ifdef DEVICES_HAVE_HAPLY
  all.push_back({"haply-simulated", Vec3d::UnitX(), Vec3d::UnitZ(), opened<HaplyCounterpart>});
#endif
#ifndef DEVICES_HAVE_FORCE_DIMENSION_SDK
  all.push_back({"force-dimension-simulated", Vec3d::UnitY(), Vec3d::UnitZ(), opened<ForceDimensionCounterpart>});
#endif
#ifndef DEVICES_HAVE_OPENHAPTICS_SDK
  all.push_back({"openhaptics-simulated", Vec3d::UnitX(), Vec3d::UnitY(), opened<OpenHapticsCounterpart>});
#endif
  all.push_back({"spacemouse", Vec3d::UnitX(), Vec3d::UnitY(), opened<SpacemouseCounterpart>});
  return all;
}

}  // namespace devices
