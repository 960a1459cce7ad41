// SPDX-License-Identifier: MIT
#include "kinds.hpp"

namespace devices {
namespace {

/// A desktop arm of six axes in a light grip.
trephine::SimulatedDeviceOptions desktop_arm(const trephine::Posed& X_DH) {
  trephine::SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.075, .damping = 0.5, .friction = 0.04, .quantum = 0.03e-3, .limit = 8.5};
  o.angular = {.inertia = 4e-5, .damping = 4e-4, .friction = 0, .quantum = 1e-4, .limit = 0.188};
  o.X_DH = X_DH;
  return o;
}

}  // namespace

Kind simulated_kind() {
  return {.name = "simulated",
          .what = "an arm and a hand, computed",
          .simulated = true,
          .look = [] { return Finding{.usable = true, .found = "always here", .to_do = ""}; },
          .open =
              [](const Hand& hand) {
                using Arm = trephine::SimulatedDevice<Hand>;
                return Opened{.device = hold(std::make_unique<Arm>(desktop_arm(hand(0).X_DH), hand))};
              }};
}

}  // namespace devices
