// SPDX-License-Identifier: MIT
#include "kinds.hpp"

#include "../openhaptics/clutch.hpp"
#include "../openhaptics/openhaptics_device.hpp"
#ifndef DEVICES_HAVE_OPENHAPTICS_SDK
#include "../openhaptics/hd_standin/hd_standin.hpp"
#endif

namespace devices {
namespace {

/// The driver's frame is the user's: x right, y up, z toward the user.
Opened opened() {
  auto device = std::make_unique<openhaptics::Device>();
  auto clutched = std::make_unique<openhaptics::Clutched<openhaptics::Device>>(*device, HD_DEVICE_BUTTON_2);
  return {.device = hold(std::move(clutched), std::move(device))};
}

#ifdef DEVICES_HAVE_OPENHAPTICS_SDK
Finding look() { return {.usable = true, .found = "built with the SDK; opening tells whether a device is there"}; }
Opened open(const Hand&) { return opened(); }
Finding look_for_counterpart() { return left_out("room beside the SDK", "build without the SDK"); }
Opened open_counterpart(const Hand&) { throw std::runtime_error("openhaptics-simulated: the SDK has its place"); }
#else
Finding look() {
  return left_out("the OpenHaptics SDK", "install the SDK and the device's driver, set OpenHaptics_ROOT, build again");
}
Opened open(const Hand&) { throw std::runtime_error("openhaptics: " + look().found + "; " + look().to_do); }
Finding look_for_counterpart() {
  return {.usable = true, .found = "a stand-in of the calls, in place of the SDK", .to_do = ""};
}
Opened open_counterpart(const Hand& hand) {
  hd_standin::Model model{.name = "Default Device", .type = "Touch stand-in", .hand = hand};
  model.mechanics.X_DH = hand(0).X_DH;
  hd_standin::plug({model});
  return opened();
}
#endif

}  // namespace

Kind openhaptics_kind() {
  return {.name = "openhaptics", .what = "3D Systems Touch and Phantom, by OpenHaptics HD", .look = look, .open = open};
}

Kind openhaptics_simulated_kind() {
  return {.name = "openhaptics-simulated",
          .what = "a Phantom, computed, behind the same calls",
          .simulated = true,
          .look = look_for_counterpart,
          .open = open_counterpart};
}

}  // namespace devices
