// SPDX-License-Identifier: MIT
#include "device_setup.hpp"
#include "hd_standin/hd_standin.hpp"

namespace openhaptics {

std::string set_up_devices(const std::function<trephine::HandTarget(double)>& hand) {
  hd_standin::Model six{.name = "Default Device", .type = "stand-in", .hand = hand};
  six.mechanics.X_DH = hand(0).X_DH;
  hd_standin::Model same = six;
  same.name = "6-DOF";
  hd_standin::Model three = six;
  three.name = "3-DOF";
  three.output_dof = 3;
  hd_standin::plug({six, same, three});
  return "built without the OpenHaptics SDK: a simulated device and hand stand in for the real ones";
}

}  // namespace openhaptics
