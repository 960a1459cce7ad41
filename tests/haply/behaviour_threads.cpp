// SPDX-License-Identifier: MIT
// The adapter on the loopback service: one state a message, each force once, zero at every end, the handle and its age.
#include "haply/fixture.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/malloc_hook.hpp"
#include "support/near.hpp"

namespace {

using namespace haply;
using namespace haply::test;
using namespace std::chrono_literals;
using trephine::DeviceState;
using trephine::DeviceStatus;
using trephine::Vec3d;
using trephine::Wrenchd;
using trephine::test::within;

bool is_good(Device& device, DeviceState& state) {
  return wait_for([&] { return device.read(state) == DeviceStatus::kOk; });
}

Wrenchd push(double force) { return {Vec3d(0, 0, force), Vec3d::Zero()}; }

std::string refusal(const DeviceOptions& options) {
  try {
    const Device device(options);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "no refusal";
}

}  // namespace

TEST_CASE("Haply: the loop's force reaches the arm, one state a message, and zero follows its end") {
  for (const bool older : {false, true}) {
    CAPTURE(older);
    ServiceOptions options = served();
    options.older = older;
    const Service service(options);
    Device device(at(service));
    CHECK((device.warnings().empty() || !kTimed));
    CHECK(device.capabilities().input_dof == 6);
    CHECK(device.capabilities().output_dof == 3);
    CHECK(device.capabilities().max_force == 10);
    Pushing pushing(device);
    CHECK(wait_for([&] { return feels_all(service) && service.witness().messages > 100; }));
    const trephine::RunReport report = pushing.stop();
    CHECK(report.end == trephine::RunEnd::kStopped);
    CHECK(report.zeroed);
    CHECK(wait_for([&] { return felt(service) == 0; }));
    device.stop();
    const Witness seen = service.witness();
    CHECK(seen.states == seen.messages + 1);  // the inventory
    CHECK(device.round_trip().count <= seen.messages);
  }
}

TEST_CASE("Haply: read gives the arm's place and the handle's rotation; neither call takes memory") {
  const Service service(served());
  Device device(at(service));
  DeviceState state;
  REQUIRE(is_good(device, state));
  CHECK((state.X_DH.translation() - service.witness().position).norm() == within(0, 1e-3));
  // The upright handle's +y points down.
  CHECK(Vec3d(state.X_DH.linear().col(1)).z() < -0.99);
  CHECK(device.handle_age() >= 0);
  CHECK(wait_for([&] { return device.handle_age() < 0.05; }));  // it moves: a new sample every 18 ms
  std::int64_t heap = 0;
  for (int i = 0; i < 100; ++i) {
    heap += trephine::test::heap_calls([&] {
      (void)device.read(state);
      (void)device.write(push(0.5));
    });
    std::this_thread::sleep_for(250us);
  }
  CHECK(heap == 0);
}

TEST_CASE("Haply: the age of a handle at rest grows, and without a handle no rotation is promised") {
  ServiceOptions options = served();
  options.hand = SimulatedHand{false};
  {
    const Service service(options);
    const Device device(at(service));
    CHECK(wait_for([&] { return device.handle_age() > 0.2; }));
  }
  options.handle = false;
  const Service service(options);
  Device device(at(service));
  CHECK(device.capabilities().input_dof == 3);
  REQUIRE_FALSE(device.warnings().empty());
  CHECK(device.warnings().back().find("VerseGrip") != std::string::npos);
  DeviceState state;
  REQUIRE(is_good(device, state));
  CHECK(state.X_DH.linear().isIdentity());
}

TEST_CASE("Haply: forces are shortened to the limit, and no number is a fault with zero force") {
  const Service service(served());
  Device device(at(service));
  DeviceState state;
  REQUIRE(is_good(device, state));
  double most = 0;
  CHECK(wait_for([&] {
    (void)device.read(state);
    (void)device.write(push(-50));
    most = std::max(most, felt(service));
    return most > 9.99;
  }));
  CHECK(most == within(10, 1e-5));
  CHECK(device.write(push(std::numeric_limits<double>::quiet_NaN())) == DeviceStatus::kFault);
  CHECK(wait_for([&] { return felt(service) == 0; }));
  CHECK(device.read(state) == DeviceStatus::kFault);
  CHECK(device.fault_text().find("no number") != std::string::npos);
}

TEST_CASE("Haply: a loop that stops writing leaves no force, and its late force is not sent") {
  const Service service(served());
  Device device(at(service));
  DeviceState state;
  REQUIRE(is_good(device, state));
  CHECK(wait_for([&] {
    (void)device.read(state);
    (void)device.write(push(1));
    return felt(service) > 0;
  }));
  // Nobody writes. Not asked whether within 10 ms: faults_threads.cpp asks that of what the service times.
  CHECK(wait_for([&] { return felt(service) == 0 && device.trouble() == Trouble::kTick; }));
  (void)device.write(push(1));  // computed from the state before
  for (int i = 0; i < 20; ++i) {
    std::this_thread::sleep_for(1ms);
    CHECK(felt(service) == 0);
  }
  REQUIRE(is_good(device, state));
}

TEST_CASE("Haply: a service at 200 Hz is warned of, and works") {
  ServiceOptions options = served();
  options.rate = 200;
  const Service service(options);
  Device device(at(service));
  REQUIRE(device.warnings().size() == 1);
  CHECK(device.warnings()[0].find("times a second, not 4000") != std::string::npos);
  CHECK(device.capabilities().rate < 400);  // by the round trip, which is shorter than the period
  DeviceState state;
  CHECK(is_good(device, state));
}

TEST_CASE("Haply: what is missing is said, with what to do") {
  DeviceOptions nowhere;
  {
    const Service service(served());
    nowhere = at(service);
    DeviceOptions other = at(service);
    other.device_id = "049D";
    CHECK(refusal(other).find("USB cable") != std::string::npos);
  }
  CHECK(refusal(nowhere).find("start the Haply Inverse Service") != std::string::npos);
  nowhere.address = "localhost";
  CHECK(refusal(nowhere).find("start the Haply Inverse Service") != std::string::npos);
}

TEST_CASE("Haply: a service that stays away is a fault, which says so") {
  auto service = std::make_unique<Service>(served());
  DeviceOptions options = at(*service);
  options.give_up = 0.1;
  Device device(options);
  Pushing pushing(device);
  CHECK(wait_for([&] { return feels_all(*service); }));
  service.reset();
  REQUIRE(wait_for([&] { return device.fault_text().find("did not come back") != std::string::npos; }));
  const trephine::RunReport report = pushing.finish();
  CHECK(report.end == trephine::RunEnd::kFault);
  CHECK(report.reason.find("start the Haply Inverse Service") != std::string::npos);
  Change change;
  std::vector<Trouble> changes;
  while (device.next_change(change)) changes.push_back(change.trouble);
  REQUIRE_FALSE(changes.empty());
  CHECK(changes.back() == Trouble::kLost);
}
