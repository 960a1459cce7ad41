// SPDX-License-Identifier: MIT
// The checks that need more than one state, at times that the test chooses.
#include "state_check.hpp"

#include <doctest/doctest.h>

#include "support/near.hpp"

namespace {

using namespace haply;
using namespace std::chrono_literals;
using trephine::Quatd;
using trephine::Vec3d;
using trephine::test::within;

constexpr auto kTick = 250us;

/// An arm that moves by 0.1 m/s, good from the start.
struct Stream {
  StateCheck check;
  Clock::time_point now = Clock::now();
  Reading last;

  explicit Stream(const Bounds& bounds = {}) : check(bounds) {
    last.velocity = Vec3d(0.1, 0, 0);
    run(400);
    REQUIRE(check.trouble() == Trouble::kNone);
  }
  void add(Reading reading, Trouble of_message = Trouble::kNone) {
    now += kTick;
    last = reading;
    check.add(reading, of_message, now);
  }
  void run(int n) {
    for (int i = 0; i < n; ++i) {
      last.position.x() += 0.1 * 250e-6;
      add(last);
    }
  }
  /// States until there is no trouble, at most a thousand.
  int settle() {
    int n = 0;
    while (check.trouble() != Trouble::kNone && n < 1000) run(1), ++n;
    return n;
  }
};

}  // namespace

TEST_CASE("Haply states: a jump is a trouble at once, and ends after the time of settling") {
  Stream stream;
  Reading jumped = stream.last;
  jumped.position.y() += 0.005;
  stream.add(jumped);
  CHECK(stream.check.trouble() == Trouble::kJump);
  CHECK(stream.settle() == 200);  // 50 ms
  // A fast hand is none: 3 m/s.
  for (int i = 0; i < 100; ++i) {
    Reading moved = stream.last;
    moved.position.z() += 3 * 250e-6;
    stream.add(moved);
    REQUIRE(stream.check.trouble() == Trouble::kNone);
  }
}

TEST_CASE("Haply states: a moving arm that repeats its position is frozen within 10 ms, a resting one is not") {
  Stream stream;
  int n = 0;
  while (stream.check.trouble() == Trouble::kNone && n < 1000) stream.add(stream.last), ++n;
  CHECK(stream.check.trouble() == Trouble::kFrozen);
  CHECK(n * kTick <= 8ms);
  CHECK(n * kTick > 6ms);
  CHECK(stream.settle() == 200);
  Reading rest = stream.last;
  rest.velocity = Vec3d(0, 0, 0.001);
  for (int i = 0; i < 1000; ++i) stream.add(rest);
  CHECK(stream.check.trouble() == Trouble::kNone);
}

TEST_CASE("Haply states: the first trouble keeps its name, and each new one starts the settling anew") {
  Stream stream;
  stream.check.fail(Trouble::kSilent, stream.now);
  CHECK(stream.check.trouble() == Trouble::kSilent);
  stream.run(100);
  stream.add(stream.last, Trouble::kNotReady);
  CHECK(stream.check.trouble() == Trouble::kNotReady);
  stream.run(150);
  stream.add(stream.last, Trouble::kMessage);
  CHECK(stream.check.trouble() == Trouble::kNotReady);
  CHECK(stream.settle() == 200);
  stream.check.forget();  // a new connection: another place is no jump
  stream.last.position = Vec3d(0, 0.3, 0);
  stream.run(1);
  CHECK(stream.check.trouble() == Trouble::kNone);
}

TEST_CASE("Haply states: the rotation follows the handle's samples without steps, and its age is known") {
  Stream stream(Bounds{.handle_limit = 200ms});
  const Quatd sample(Eigen::AngleAxisd(0.1, Vec3d::UnitZ()));
  stream.last.rotation = sample;
  Reading shown = stream.last;
  double angle = 0;
  for (int i = 0; i < 400; ++i) {  // 0.1 s, five times the handle's period
    stream.last.position.x() += 0.1 * 250e-6;
    shown = stream.last;
    stream.now += kTick;
    stream.check.add(shown, Trouble::kNone, stream.now);
    const double next = shown.rotation.angularDistance(Quatd::Identity());
    REQUIRE(next >= angle - 1e-7);
    REQUIRE(next - angle <= 0.1 * 250e-6 / 0.018);
    angle = next;
  }
  CHECK(angle == within(0.1, 0.001));
  CHECK(stream.now - stream.check.turned() == 399 * kTick);
  CHECK(stream.check.trouble() == Trouble::kNone);
  stream.run(403);
  CHECK(stream.check.trouble() == Trouble::kHandle);
}
