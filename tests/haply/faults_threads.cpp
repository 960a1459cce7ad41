// SPDX-License-Identifier: MIT
// Every fault of the service takes the force off the arm within 10 ms, by the service's clock, and what comes back
// afterwards comes back by the ramp.
#include "haply/fixture.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>
#include <string>

namespace {

using namespace haply;
using namespace haply::test;

constexpr double kWithin = kTimed ? 0.010 : 1.0;  // [s]
/// [N] of 2. The ramp takes 0.1 s; on a busy machine a few of its ticks, each 20 ms at most, may pass before one is
/// sent.
constexpr double kFirstOfRamp = 1;

/// The name under which the user is told of a fault.
Trouble told(Fault fault) {
  switch (fault) {
    case Fault::kKilled:
    case Fault::kHuge:  // refused unread, by closing the connection
      return Trouble::kLost;
    case Fault::kFrozen:
      return Trouble::kFrozen;
    case Fault::kNan:
    case Fault::kGarbage:
      return Trouble::kMessage;
    case Fault::kUnplugged:
    case Fault::kShape:
      return Trouble::kTooFewDevices;
    case Fault::kJump:
      return Trouble::kJump;
    case Fault::kRange:
      return Trouble::kRange;
    case Fault::kNotReady:
      return Trouble::kNotReady;
    case Fault::kHandle:
      return Trouble::kHandle;
    case Fault::kFlood:
      return Trouble::kFlood;
    default:
      return Trouble::kSilent;
  }
}

/// Runs one fault; what the service has seen, and whether the user was told.
Witness suffer(Fault fault, bool& was_told) {
  Service service(served());
  Device device(at(service));
  Pushing pushing(device);
  REQUIRE(wait_for([&] { return feels_all(service); }));
  service.inject(fault, 0.3);
  REQUIRE(wait_for([&] { return service.witness().fault_at.has_value(); }));
  REQUIRE(wait_for([&] { return service.witness().quiet_at.has_value(); }));
  // The loop has gone on, and the whole force returns.
  CHECK(wait_for([&] {
    const Witness w = service.witness();
    return !w.in_fault && w.back_at && feels_all(service);
  }));
  CHECK(pushing.stop().end == trephine::RunEnd::kStopped);
  for (Change change; device.next_change(change);) was_told = was_told || change.trouble == told(fault);
  CHECK(wait_for([&] { return felt(service) == 0; }));
  return service.witness();
}

}  // namespace

TEST_CASE("Haply faults: zero force within 10 ms of each, then a ramp") {
  for (const FaultText& f : kFaults) {
    const std::string name = f.name;
    CAPTURE(name);
    // A machine that is busy with something else may hold up either program for longer; three times in a row it is the
    // adapter's fault.
    double soonest = std::numeric_limits<double>::infinity();
    bool was_told = false;
    for (int attempt = 0; attempt < 3 && !(soonest <= kWithin && was_told); ++attempt) {
      const Witness seen = suffer(f.fault, was_told);
      REQUIRE(seen.quiet_at);
      REQUIRE(seen.back_at);
      CHECK(seen.back_force <= kFirstOfRamp);
      CHECK(*seen.back_at > *seen.quiet_at);
      // A service that hangs reads the zero when it reads again; until then it must have got silence.
      const bool silence = f.fault == Fault::kHang && seen.pushes <= 1;
      soonest = std::min(soonest, silence ? 0 : *seen.quiet_at - *seen.fault_at);
      INFO(1e3 * (*seen.quiet_at - *seen.fault_at), " ms, ", seen.pushes, " forces in between");
    }
    CHECK(soonest <= kWithin);
    CHECK((was_told || !kTimed));
  }
}
