// SPDX-License-Identifier: MIT
// The bound on a wrench's change from tick to tick.
#include "support/cases.hpp"
#include "support/near.hpp"
#include "support/random.hpp"

#include <trephine/contact/release_bound.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

namespace {

using namespace trephine;
using namespace trephine::test;

constexpr double kStiffness = 800, kLever = 0.02, kRelease = 60;

[[nodiscard]] double size(const Wrenchd& w) { return std::hypot(w.force.norm(), w.torque.norm() / kLever); }
[[nodiscard]] Wrenchd minus(const Wrenchd& a, const Wrenchd& b) { return {a.force - b.force, a.torque - b.torque}; }
/// The change of a spring's wrench under a motion of its device.
[[nodiscard]] Wrenchd push(const Vec6d& motion) {
  return {-kStiffness * motion.head<3>(), -kStiffness * kLever * kLever * motion.tail<3>()};
}

TEST_CASE("release bound: the wrench's change is bounded as a vector, and unchanged where it is within the bound") {
  Random random(733);
  int held_back = 0, free = 0;
  for (int n = 0; n < cases(60); ++n) {
    ReleaseBound bound(kStiffness, kLever, kRelease);
    Wrenchd last;
    for (int i = 0; i < 200; ++i) {
      const double dt = std::pow(10, random.uniform(-4.6, -2));
      Vec6d motion;
      motion << 1e-4 * random.uniform() * random.unit(), 5e-3 * random.uniform() * random.unit();
      // Often near the last one, sometimes far off or none at all.
      Wrenchd wanted = last;
      wanted.force += 0.4 * random.uniform() * random.unit();
      if (i % 7 == 3) wanted = {3 * random.uniform() * random.unit(), 0.1 * random.uniform() * random.unit()};
      if (i % 11 == 5) wanted = {};
      Wrenchd sent = wanted;
      const bool is_held_back = bound.apply(sent, motion, dt);
      const double by_motion = size(push(motion)), most = by_motion + kRelease * dt;
      const Wrenchd middle = last + 0.5 * push(motion);
      constexpr double kRounding = 1e-15;  // of some newtons
      CHECK(size(minus(sent, last)) <= most + kRounding);
      CHECK(size(minus(sent, middle)) <= by_motion / 2 + kRelease * dt + kRounding);
      CHECK(is_held_back == (size(minus(wanted, middle)) > by_motion / 2 + kRelease * dt));
      if (is_held_back) {
        // As far as allowed, and no more energy than with a tool that stands still, or than wanted.
        CHECK(std::abs(size(minus(sent, middle)) - (by_motion / 2 + kRelease * dt)) <= kRounding);
        CHECK(size(sent) <= std::max(size(last + push(motion)), size(wanted)) + kRounding);
        ++held_back;
      } else {
        CHECK(sent == wanted);
        ++free;
      }
      last = sent;
    }
  }
  CHECK(held_back > 100);
  CHECK(free > 100);
}

// The tool rests on a plane, or on the outer side of any convex bone-free space, and a spring ties it to the device.
TEST_CASE("release bound: a device at any speed that presses a rigid tool on planes is never held back") {
  Random random(734);
  for (int n = 0; n < cases(40); ++n) {
    ReleaseBound bound(kStiffness, kLever, kRelease);
    // A wedge between two planes through the origin.
    const Vec3d a = random.unit(), b = random.unit();
    const auto projected = [&](Vec3d p) {
      Vec3d u = Vec3d::Zero(), v = u;
      for (int i = 0; i < 2000; ++i) {  // alternating projections with Dykstra's corrections
        const Vec3d q = p + u, x = q - std::min(0.0, q.dot(a)) * a;
        u = q - x;
        const Vec3d r = x + v;
        p = r - std::min(0.0, r.dot(b)) * b;
        v = r - p;
      }
      return p;
    };
    Vec3d device = 2e-3 * random.unit();
    for (int i = 0; i < 30; ++i) {
      Vec6d motion = Vec6d::Zero();
      if (i > 0) motion.head<3>() = 1e-3 * random.uniform() * random.unit();
      device += motion.head<3>();
      Wrenchd wrench{kStiffness * (projected(device) - device), Vec3d::Zero()};
      const double dt = i == 0 ? 1 : 1e-5;  // the first wrench is there at once
      CHECK_FALSE(bound.apply(wrench, motion, dt));
    }
  }
}

TEST_CASE("release bound: it starts without a wrench, forgets it, and passes everything with an infinite slope") {
  ReleaseBound bound(kStiffness, kLever, kRelease);
  Wrenchd full{Vec3d(0, 0, 3), Vec3d(0.01, 0, 0)};
  Wrenchd sent = full;
  CHECK(bound.apply(sent, Vec6d::Zero(), 1e-3));
  CHECK(std::abs(size(sent) - kRelease * 1e-3) <= 1e-16);
  for (int i = 0; i < 100; ++i) {
    sent = full;
    static_cast<void>(bound.apply(sent, Vec6d::Zero(), 1e-3));
  }
  CHECK(sent == full);
  CHECK(bound.acts());
  bound.reset();
  CHECK_FALSE(bound.acts());
  sent = full;
  CHECK(bound.apply(sent, Vec6d::Zero(), 1e-3));

  ReleaseBound none(kStiffness, kLever, std::numeric_limits<double>::infinity());
  CHECK_FALSE(none.is_bounded());
  sent = full;
  CHECK_FALSE(none.apply(sent, Vec6d::Zero(), 1e-3));
  CHECK(sent == full);
}

TEST_CASE(
    "release bound: at a jump the wrench falls as its spring does where the device yields to it, and else stays") {
  const double dt = 1e-3, slope = kRelease * dt;
  const auto after_jump = [&](const Wrenchd& held, const Vec3d& shift, const Vec3d& turn, bool jumped) {
    ReleaseBound bound(kStiffness, kLever, std::numeric_limits<double>::infinity());
    Wrenchd sent = held;
    bound.follow(Posed::Identity(), false);
    static_cast<void>(bound.apply(sent, Vec6d::Zero(), dt));
    bound.set(kStiffness, kLever, kRelease);
    bound.follow(make_pose<double>(rotation_from_vector(turn), shift), jumped);
    sent = {};
    static_cast<void>(bound.apply(sent, Vec6d::Zero(), dt));
    return sent;
  };
  const Wrenchd pushed{Vec3d(0, 0, 2), Vec3d::Zero()}, turned{Vec3d::Zero(), Vec3d(0, 2 * kLever, 0)};
  const Vec3d away(0, 0, 1 / kStiffness), none = Vec3d::Zero(), back(0, 1 / (kStiffness * kLever), 0);
  CHECK(after_jump(pushed, away, none, true).force.z() == near(1 - slope));
  CHECK(after_jump(pushed, -away, none, true).force.z() == near(2 - slope));
  CHECK(after_jump(pushed, 9 * away, none, true) == Wrenchd::zero());
  CHECK(after_jump(pushed, away, none, false).force.z() == near(2 - slope));
  CHECK(after_jump(turned, none, back, true).torque.y() == near((1 - slope) * kLever));
}

TEST_CASE("release bound: a wrench beyond all reason does not overflow") {
  for (const double huge : {1e150, 1e200, 1e300}) {
    ReleaseBound bound(kStiffness, kLever, kRelease);
    Wrenchd sent{Vec3d(huge, -huge, 0), Vec3d(0, huge, 0)};
    CHECK(bound.apply(sent, Vec6d::Zero(), 1e-3));
    CHECK(std::abs(size(sent) - kRelease * 1e-3) <= 1e-16);
  }
}

// Without a spring for rotation no torque comes of it, while turning counts as motion.
TEST_CASE("release bound: without a rotational spring a turn gives no torque") {
  ReleaseBound bound(kStiffness, kLever, kRelease, false);
  Vec6d turn = Vec6d::Zero();
  turn[4] = 0.01;  // by kLever: 0.2 mm, 0.16 N
  Wrenchd sent{Vec3d(0.19, 0, 0), Vec3d::Zero()};
  CHECK_FALSE(bound.apply(sent, turn, 2e-3));  // 0.08 N by half the motion, 0.12 N by the time
  sent = {Vec3d(1, 0, 0), Vec3d::Zero()};
  CHECK(bound.apply(sent, turn, 2e-3));
  CHECK(sent.torque == Vec3d::Zero());
}

}  // namespace
