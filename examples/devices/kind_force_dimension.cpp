// SPDX-License-Identifier: MIT
#include "kinds.hpp"

#include "../force_dimension/force_dimension_device.hpp"
#ifndef DEVICES_HAVE_FORCE_DIMENSION_SDK
#include "../force_dimension/dhd_standin/dhd_standin.hpp"
#endif

namespace devices {
namespace {

/// The vendor's frame: X toward the user, Y to the right, Z up, the origin in the middle of the workspace. A handle
/// whose axes are those of the frame holds the tool upright.
Opened frames() {
  Opened opened;
  opened.R_UD << 0, 1, 0, 0, 0, 1, 1, 0, 0;
  return opened;
}

Opened opened() {
  Opened opened = frames();
  opened.device = hold(std::make_unique<force_dimension::Device>());
  return opened;
}

#ifdef DEVICES_HAVE_FORCE_DIMENSION_SDK
Finding look() {
  const int count = dhdGetAvailableCount();
  if (count > 0) return {.usable = true, .found = std::to_string(count) + " connected", .to_do = ""};
  return {.usable = false,
          .found = "the SDK finds no device",
          .to_do = "switch it on, check its USB cable, and the rights for it (the SDK's udev rules)"};
}
Opened open(const Hand&) { return opened(); }
Finding look_for_counterpart() { return left_out("room beside the SDK", "build without the SDK"); }
Opened open_counterpart(const Hand&) { throw std::runtime_error("force-dimension-simulated: the SDK has its place"); }
#else
Finding look() { return left_out("the Force Dimension SDK", "install the SDK, set ForceDimension_ROOT, build again"); }
Opened open(const Hand&) { throw std::runtime_error("force-dimension: " + look().found + "; " + look().to_do); }
Finding look_for_counterpart() {
  return {.usable = true, .found = "a stand-in of the calls, in place of the SDK", .to_do = ""};
}
Opened open_counterpart(const Hand& hand) {
  dhd_standin::Model model = dhd_standin::model("sigma.7");
  model.hand = in_base(hand, frames());
  model.mechanics.X_DH = model.hand(0).X_DH;
  dhd_standin::plug({model});
  return opened();
}
#endif

}  // namespace

Kind force_dimension_kind() {
  return {.name = "force-dimension",
          .what = "omega, sigma and lambda, by the Force Dimension SDK",
          .look = look,
          .open = open};
}

Kind force_dimension_simulated_kind() {
  return {.name = "force-dimension-simulated",
          .what = "a sigma.7, computed, behind the same calls",
          .simulated = true,
          .look = look_for_counterpart,
          .open = open_counterpart};
}

}  // namespace devices
