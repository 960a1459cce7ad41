// SPDX-License-Identifier: MIT
#include "clutch.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;
using openhaptics::Clutched;

/// What the hand does is set from outside.
struct HandDevice {
  Posed X_DH = Posed::Identity();
  std::uint32_t buttons = 0;
  DeviceStatus status = DeviceStatus::kOk;
  Wrenchd wrote{};

  [[nodiscard]] DeviceCapabilities capabilities() const { return {.name = "hand", .output_dof = 3}; }
  DeviceStatus read(DeviceState& state) noexcept {
    state.X_DH = X_DH;
    state.buttons = buttons;
    return status;
  }
  DeviceStatus write(const Wrenchd& w) noexcept {
    wrote = w;
    return DeviceStatus::kOk;
  }
};
static_assert(HapticDevice<Clutched<HandDevice>>);
static_assert(!SelfPacedDevice<Clutched<HandDevice>>);

}  // namespace

TEST_CASE("clutch: the tool stays while it is held, and goes on from there") {
  HandDevice hand;
  Clutched clutched(hand, 2);
  DeviceState state;
  const auto read_at = [&](double x, std::uint32_t buttons) {
    hand.X_DH.translation() = Vec3d(x, 0, 0);
    hand.buttons = buttons;
    return clutched.read(state);
  };
  const auto x = [&] { return state.X_DH.translation().x(); };
  CHECK(read_at(0.01, 0) == DeviceStatus::kOk);
  CHECK(x() == 0.01);
  CHECK(read_at(0.02, 1) == DeviceStatus::kOk);
  CHECK(state.buttons == 1);
  CHECK(read_at(0.03, 3) == DeviceStatus::kSafetyTrip);  // pressed: here it stays
  CHECK(x() == near(0.03));
  CHECK(state.buttons == 2);
  CHECK(clutched.held());
  CHECK(read_at(-0.05, 3) == DeviceStatus::kSafetyTrip);
  CHECK(x() == near(0.03));
  CHECK(read_at(-0.06, 1) == DeviceStatus::kSafetyTrip);  // let go: still no force, nothing cut
  CHECK(x() == near(0.03));
  CHECK(state.buttons == 0);
  CHECK_FALSE(clutched.held());
  CHECK(read_at(-0.05, 1) == DeviceStatus::kOk);  // joined again, 10 mm on
  CHECK(x() == near(0.04));
  CHECK(state.buttons == 1);
  CHECK(clutched.offset().x() == near(0.09));
  // Again, on top of the first.
  CHECK(read_at(-0.05, 2) == DeviceStatus::kSafetyTrip);
  CHECK(read_at(0.00, 2) == DeviceStatus::kSafetyTrip);
  CHECK(read_at(0.00, 0) == DeviceStatus::kSafetyTrip);
  CHECK(read_at(0.01, 0) == DeviceStatus::kOk);
  CHECK(x() == near(0.05));
}

TEST_CASE("clutch: turning is never uncoupled; wrenches and capabilities pass") {
  HandDevice hand;
  Clutched clutched(hand, 2);
  DeviceState state;
  hand.buttons = 2;
  for (int i = 0; i < 3; ++i) {
    hand.X_DH.linear() = rotation_from_vector<double>(Vec3d(0, 0.1 * i, 0));
    (void)clutched.read(state);
    CHECK(state.X_DH.linear() == hand.X_DH.linear());
  }
  const Wrenchd w{Vec3d(1, 2, 3), Vec3d(4, 5, 6)};
  CHECK(clutched.write(w) == DeviceStatus::kOk);
  CHECK(hand.wrote == w);
  CHECK(clutched.capabilities().name == "hand");
}

TEST_CASE("clutch: faults and poses that are no numbers leave it as it was") {
  HandDevice hand;
  Clutched clutched(hand, 2);
  DeviceState state;
  hand.X_DH.translation().x() = 0.01;
  (void)clutched.read(state);
  hand.status = DeviceStatus::kFault;
  hand.buttons = 2;
  CHECK(clutched.read(state) == DeviceStatus::kFault);
  hand.status = DeviceStatus::kOk;
  hand.X_DH.translation().x() = std::numeric_limits<double>::quiet_NaN();
  CHECK(clutched.read(state) == DeviceStatus::kOk);
  CHECK_FALSE(clutched.held());
  hand.X_DH.translation().x() = 0.02;
  hand.buttons = 0;
  CHECK(clutched.read(state) == DeviceStatus::kOk);
  CHECK(state.X_DH.translation().x() == 0.02);
}
