// SPDX-License-Identifier: MIT
#include "kinds.hpp"

#ifdef DEVICES_HAVE_SPNAV
#include "../spacemouse/spacemouse_device.hpp"
#include "../spacemouse/spnav_source.hpp"

#include <filesystem>
#endif

namespace devices {
namespace {

Finding look() {
#ifdef DEVICES_HAVE_SPNAV
  if (std::filesystem::exists("/var/run/spnav.sock"))
    return {.usable = true, .found = "spacenavd listens", .to_do = ""};
  return {.usable = false,
          .found = "no spacenavd: /var/run/spnav.sock is not there",
          .to_do = "install and start spacenavd (apt-get install spacenavd), and plug the mouse in"};
#else
  return left_out("libspnav (Debian: libspnav-dev, libx11-dev)", "install it and build again");
#endif
}

Opened open(const Hand&) {
#ifdef DEVICES_HAVE_SPNAV
  using Device = spacemouse::Device<spacemouse::SpnavSource>;
  auto source = std::make_unique<spacemouse::SpnavSource>();
  auto device = std::make_unique<Device>(*source, spacemouse::Gains{.speed = 0.02});
  return {.device = hold(std::move(device), std::move(source))};
#else
  throw std::runtime_error("spacemouse: " + look().found + "; " + look().to_do);
#endif
}

}  // namespace

Kind spacemouse_kind() {
  return {.name = "spacemouse", .what = "a 6-DOF mouse: input alone, no force", .look = look, .open = open};
}

}  // namespace devices
