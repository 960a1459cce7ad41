// SPDX-License-Identifier: MIT
#include "kinds.hpp"

#ifdef DEVICES_HAVE_HAPLY
#include "../haply/haply_device.hpp"
#include "../haply/service.hpp"

#include <trephine/core/rotation.hpp>

#include <chrono>
#include <thread>
#endif

namespace devices {
namespace {

#ifdef DEVICES_HAVE_HAPLY

using haply::Device, haply::DeviceOptions, haply::Service, haply::ServiceOptions;

/// The service's frame: x right, y forward, z up. The handle's +y points away from the hand.
Opened frames(bool has_handle) {
  Opened opened;
  opened.R_UD << 1, 0, 0, 0, 0, 1, 0, -1, 0;
  opened.p_D = haply::SimulatedHand::home();
  if (has_handle) opened.R_HT = trephine::rotation_from_vector<double>(Vec3d(1.5707963267948966, 0, 0));
  return opened;
}

Opened opened_with(std::unique_ptr<Device> device, std::unique_ptr<Service> service) {
  Opened opened = frames(device->capabilities().input_dof == 6);
  opened.device = hold(std::move(device), std::move(service));
  return opened;
}

Finding look_for_service() {
  try {
    const Device device(DeviceOptions{});
    std::string found = device.capabilities().name;
    for (const std::string& warning : device.warnings()) found += "; " + warning;
    return {.usable = true, .found = found, .to_do = ""};
  } catch (const std::runtime_error& error) {
    return {.usable = false,
            .found = error.what(),
            .to_do = "install Haply Hub, start the Inverse Service, plug the Inverse3 in and calibrate it"};
  }
}

/// Where the handle is at first is the middle of its workspace.
Opened open_service(const Hand&) {
  Opened opened = opened_with(std::make_unique<Device>(DeviceOptions{}), nullptr);
  trephine::DeviceState state;
  const auto is_good = [&](auto& device) {
    const bool good = device.read(state) == trephine::DeviceStatus::kOk;
    (void)device.write(trephine::Wrenchd::zero());
    return good;
  };
  for (int ms = 0; ms < 2000; ++ms) {
    if (opened.use(is_good)) {
      opened.p_D = state.X_DH.translation();
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return opened;
}

Finding look_for_counterpart() {
  return {.usable = true, .found = "a loopback service in this program, on a free port", .to_do = ""};
}

Opened open_counterpart(const Hand& hand) {
  Service* service = nullptr;
  return haply_with_service(hand, service);
}

#else

Finding look_for_service() {
  return left_out("Boost's or nlohmann-json's headers", "apt-get install libboost-dev nlohmann-json3-dev, build again");
}
Opened open_service(const Hand&) { throw std::runtime_error("haply: " + look_for_service().found); }
constexpr auto look_for_counterpart = look_for_service;
constexpr auto open_counterpart = open_service;

#endif

}  // namespace

#ifdef DEVICES_HAVE_HAPLY
Opened haply_with_service(const Hand& hand, Service*& service) {
  ServiceOptions options;
  options.port = 0;
  options.hand = in_base(hand, frames(true));
  auto serving = std::make_unique<Service>(options);
  service = serving.get();
  DeviceOptions where;
  where.port = serving->port();
  auto device = std::make_unique<Device>(where);
  return opened_with(std::move(device), std::move(serving));
}
#endif

Kind haply_kind() {
  return {.name = "haply",
          .what = "Haply Inverse3, by its Inverse Service",
          .look = look_for_service,
          .open = open_service};
}

Kind haply_simulated_kind() {
  return {.name = "haply-simulated",
          .what = "an Inverse3, computed, behind the same protocol",
          .simulated = true,
          .look = look_for_counterpart,
          .open = open_counterpart};
}

}  // namespace devices
