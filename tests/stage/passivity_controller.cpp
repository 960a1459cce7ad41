// SPDX-License-Identifier: MIT
#include <trephine/core/rotation.hpp>
#include <trephine/stage/passivity_controller.hpp>

#include <trephine/device/simulated_device.hpp>
#include <trephine/stage/damping.hpp>

#include "fakes.hpp"
#include "support/near.hpp"

#include <numbers>

using namespace trephine;
using namespace trephine::test;

namespace {

using Options = PassivityController::Options;

/// Makes energy: a force along the velocity, in contact.
struct Generator {
  double gain = 0;  // [N·s/m]
  void apply(const TickContext& c, Wrenchd& w) const noexcept {
    if (c.contact.count > 0) w.force += gain * c.twist.linear;
  }
};
/// Takes it: Coulomb friction.
struct Rubbing {
  double newton = 0;
  void apply(const TickContext& c, Wrenchd& w) const noexcept {
    const double v = c.twist.linear.norm();
    if (c.contact.count > 0 && v > 0) w.force -= newton / v * c.twist.linear;
  }
};

double sine(int k, double hertz) { return std::sin(2 * std::numbers::pi * hertz * k * kTick); }

}  // namespace

TEST_CASE("passivity: what is observed is the work of the wrench that was sent, after limits, over the next motion") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, PassivityController({.damping = 0, .angular_damping = 0}),
                           DeviceLimits{.force = 2, .torque = 0.5}};
  double work = 0;
  Wrenchd sent;
  Posed before = at(0, 0, 1e-3);
  for (int k = 0; k < 400; ++k) {
    const Posed X = turned(Vec3d(0.3 * sine(k, 7), 0.1 * sine(k, 11), 0), Vec3d(0, 0, 4e-3 * sine(k, 5)));
    const TickResult r = scene.tick({.X_WT = X}, kTick);
    if (k > 0) {
      work += sent.force.dot(X.translation() - before.translation());
      work += sent.torque.dot(turn_between(before, X));
    }
    sent = r.wrench;
    before = X;
  }
  const double seen = scene.part<PassivityController>().given();
  CHECK(std::abs(work) > 1e-6);
  CHECK(seen == near(work, 1e-13));
}

TEST_CASE("passivity: a tick that sent zero counts as zero") {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{}, PassivityController({.damping = 0}), DeviceLimits{.force = 9}};
  (void)scene.tick({.X_WT = at(0, 0, -1e-3)}, kTick);
  (void)scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick);
  (void)scene.tick({.X_WT = at(0, 0, -1e-3)}, kTick);
  (void)scene.tick({.X_WT = at(kNaN, 0, 0)}, kTick);
  (void)scene.tick({.X_WT = at(0, 0, 0)}, kTick);
  CHECK(scene.part<PassivityController>().given() == 0);
}

TEST_CASE("passivity: a held spring's leak is K T/2 of v², and one within the stated stiffness is left alone") {
  constexpr double kFrequency = 5, kAmplitude = 2e-3;
  const auto run = [](double k, double stated, double stored, double reserve) {
    auto bone = small_grid();
    auto plain = HapticScene{bone, 300, Floor<>{k}, DeviceLimits{.force = 99, .torque = 0}};
    auto watched =
        HapticScene{bone, 300, Floor<>{k},
                    PassivityController({.stiffness = stated, .contact_stiffness = stored, .reserve = reserve}),
                    DeviceLimits{.force = 99, .torque = 0}};
    double speed2 = 0, injected = 0, given = 0;
    bool same = true;
    // Touches all the time but for a moment a period, from no depth on; whole periods.
    for (int k_tick = 0; k_tick <= 2000; ++k_tick) {
      const double phase = 2 * std::numbers::pi * kFrequency * kTick;
      const double z = -kAmplitude + kAmplitude * std::cos(phase * k_tick);  // first in, then out: nothing lies stored
      const TickInput input{.X_WT = at(0, 0, z)};
      same = same && plain.tick(input, kTick).wrench == watched.tick(input, kTick).wrench;
      const auto& part = watched.template part<PassivityController>();
      injected = std::max(injected, part.injected().force.norm());
      if (k_tick == 0) continue;
      const double v = kAmplitude * phase / kTick * std::sin(phase * (k_tick - 0.5));
      speed2 += v * v * kTick;
      given = part.given();
    }
    return std::tuple(same, injected, given / (k * kTick / 2 * speed2));
  };
  // A little more than is needed, so that rounding does not decide. The spring stores up to 8 mJ, which is credit
  // where its stiffness is not known.
  for (const auto& within : {run(1000, 1001, 0, 0.009), run(1000, 1001, 1000, 1e-3)}) {
    CHECK(std::get<0>(within));
    CHECK(std::get<1>(within) == 0);
    CHECK(std::get<2>(within) == near(1, 2.4e-4));
  }
  for (const auto& above : {run(1000, 500, 0, 0.009), run(1000, 500, 1000, 1e-3)}) {
    CHECK(std::get<1>(above) > 0);
    CHECK(std::get<2>(above) < 0.7);  // about half of it is taken out
  }
}

TEST_CASE("passivity: just what a device bears is left alone: of hold, delay and readings, in place and angle") {
  const double v = 0.05, w = 2, hold = kTick / 2 + 1.5e-3;
  const Options o{.stiffness = 700,
                  .angular_stiffness = 0.4,
                  .delay = 1.5e-3,
                  .quantum = 5e-5,
                  .angular_quantum = 1e-3,
                  .reserve = 1};
  // A push along the motion gives F v; the device bears K v (hold v + quantum / 2), likewise in angle.
  const double force = o.stiffness * (hold * v + o.quantum / 2);
  const double torque = o.angular_stiffness * (hold * w + o.angular_quantum / 2);
  const TickInput input{};
  const Vec3d along = Vec3d(1, -2, 2) / 3;
  for (const bool turns : {false, true})
    for (const double more : {0.95, 1.1}) {
      PassivityController controller(o);
      TickContext context = touching(input);
      context.twist_to_bone = {turns ? Vec3d::Zero() : Vec3d(v * along), turns ? Vec3d(w * along) : Vec3d::Zero()};
      for (int k = 0; k < 60; ++k) {
        controller.begin_tick();
        Wrenchd push{turns ? Vec3d::Zero() : Vec3d(more * force * along),
                     turns ? Vec3d(more * torque * along) : Vec3d::Zero()};
        const Wrenchd sent = push;
        controller.apply(context, push);
        controller.sent(sent);  // as if nothing were injected
      }
      CAPTURE(turns);
      CHECK((controller.excess() > 0) == (more > 1));
      // It brakes: against the motion, in force as in torque.
      CHECK((turns ? controller.injected().torque : controller.injected().force).dot(along) <= 0);
      CHECK((controller.injected() == Wrenchd::zero()) == (more < 1));
    }
}

TEST_CASE("passivity: energy that springs store counts at once, that of torque too") {
  const Options o{.contact_stiffness = 500, .contact_angular_stiffness = 0.25, .reserve = 1};
  const TickInput input{};
  PassivityController controller(o);
  controller.begin_tick();
  Wrenchd wrench{Vec3d(0, 2, 0), Vec3d(0, 0, 0.1)};
  controller.apply(touching(input), wrench);
  const double stored = 2.0 * 2.0 / (2 * 500) + 0.1 * 0.1 / (2 * 0.25);
  CHECK(controller.excess() == near(stored * std::exp(-kTick / o.memory), 1e-12));
}

TEST_CASE("passivity: bursts are bounded in size and rate, and no motion is no division by nothing") {
  auto bone = small_grid();
  const Options o{.stiffness = 0, .damping = 20, .force = 0.8, .force_rate = 100, .torque_rate = 1};
  for (const double amplitude : {1e-12, 1e-9, 1e-6, 1e-3}) {
    auto scene = HapticScene{
        bone, 300, Floor<>{}, Generator{50}, PassivityController(o), DeviceLimits{.force = 99, .torque = 9}};
    Wrenchd before;
    double most = 0;
    for (int k = 0; k < 2000; ++k) {
      const TickResult r = scene.tick({.X_WT = at(0, 0, -2e-3 + amplitude * sine(k, 20))}, kTick);
      const Wrenchd& now = scene.part<PassivityController>().injected();
      REQUIRE(is_finite(r.wrench));
      REQUIRE((now.force - before.force).norm() <= 100 * kTick * (1 + 1e-9));
      REQUIRE((now.torque - before.torque).norm() <= 1 * kTick * (1 + 1e-9));
      REQUIRE(now.force.norm() <= 0.8 * (1 + 1e-9));
      most = std::max(most, now.force.norm());
      before = now;
    }
    CHECK(most <=
          20 * amplitude * 2 * std::numbers::pi * 20 * (1 + 1e-6));  // never more than `damping` times the speed
    CHECK(most > 0);
  }
}

TEST_CASE("passivity: what a contact has taken from the hand hides a generator for no more than the reserve") {
  const auto ticks_to_act = [](double reserve) {
    auto bone = small_grid();
    auto scene = HapticScene{bone,
                             300,
                             Floor<>{0},
                             Rubbing{},
                             Generator{},
                             PassivityController({.stiffness = 0, .angular_stiffness = 0, .reserve = reserve}),
                             DeviceLimits{.force = 99}};
    scene.template part<Rubbing>().newton = 2;
    int k = 0;
    // 2 N at .1 m/s for a second: .2 J.
    const auto tick = [&] { (void)scene.tick({.X_WT = at(1e-4 * k++, 0, -1e-3)}, kTick); };
    while (k < 1000) tick();
    scene.template part<Rubbing>().newton = 0;
    scene.template part<Generator>().gain = 20;  // 2 N along .1 m/s: .2 mJ a tick
    const int began = k;
    while (scene.template part<PassivityController>().injected() == Wrenchd::zero()) {
      tick();
      if (k > 5000) break;
    }
    return k - began;
  };
  // One tick late by the hold, one more to exceed.
  CHECK(ticks_to_act(5e-3) >= 25);
  CHECK(ticks_to_act(5e-3) <= 25 + 3);
  CHECK(ticks_to_act(1e-3) <= 5 + 3);
  CHECK(ticks_to_act(0.2) > 990);
}

TEST_CASE("passivity: credit ends with the contact, debt is forgotten in its time") {
  auto bone = small_grid();
  auto scene = HapticScene{bone,
                           300,
                           Floor<>{1000},
                           Rubbing{1},
                           PassivityController({.damping = 0, .memory = 0.05}),
                           DeviceLimits{.force = 99}};
  const auto excess = [&] { return scene.part<PassivityController>().excess(); };
  for (int k = 0; k < 50; ++k) (void)scene.tick({.X_WT = at(1e-4 * k, 0, -1e-3)}, kTick);
  CHECK(excess() < -1e-3);
  (void)scene.tick({.X_WT = at(5e-3, 0, 1e-3)}, kTick);  // the spring throws it out: 1 N over 2 mm
  const double debt = excess();
  CHECK(debt >= 0);
  for (int k = 0; k < 50; ++k) (void)scene.tick({.X_WT = at(5e-3, 0, 1e-3)}, kTick);
  CHECK(excess() == near(debt * std::exp(-1.0), 1e-9));
}

TEST_CASE("passivity: a force that jumps up from nothing is seen at once where the law's stiffness is known") {
  // 1 N appears without motion; ½ F²/K of energy then lies in the spring that the hand has not put there.
  const auto excess = [](double known) {
    auto bone = small_grid();
    auto scene = HapticScene{bone,
                             300,
                             Floor<>{},
                             Add{0},
                             PassivityController({.contact_stiffness = known, .damping = 0}),
                             DeviceLimits{.force = 99}};
    (void)scene.tick({.X_WT = at(0, 0, 0)}, kTick);
    scene.template part<Add>().newton = 1;
    (void)scene.tick({.X_WT = at(0, 0, 0)}, kTick);
    return scene.template part<PassivityController>().excess();
  };
  CHECK(excess(0) == 0);
  CHECK(excess(1000) == near(0.5e-3 * std::exp(-kTick / 0.2), 1e-9));
}

TEST_CASE("passivity: pressing and letting go of a law with an energy is no debt, whatever its shape") {
  // The stored energy is at least F²/2K for the largest tangent stiffness; a softer start of the law does not matter.
  struct Soft {
    void apply(const TickContext& c, Wrenchd& w) const noexcept {  // f = k z²/z0, K = 2 k at z0
      const double z = c.contact.depth;
      w.force = Vec3d(0, 0, 500 * z * z / 1e-3);
      w.torque.setZero();
    }
  };
  auto bone = small_grid();
  auto scene = HapticScene{bone,
                           300,
                           Floor<>{},
                           Soft{},
                           PassivityController({.stiffness = 1000, .contact_stiffness = 1000, .reserve = 1}),
                           DeviceLimits{.force = 99}};
  for (int k = 0; k <= 2000; ++k) {
    (void)scene.tick({.X_WT = at(0, 0, -1e-3 * std::abs(sine(k, 1)))}, kTick);
    REQUIRE(scene.part<PassivityController>().injected() == Wrenchd::zero());
  }
}

namespace {

/// Amplitude [m] that a device pressed on the floor with 1 N is left with after three seconds.
template <class... Parts>
double left_over(double k, Parts... parts) {
  auto bone = small_grid();
  auto scene = HapticScene{bone, 300, Floor<>{k}, parts..., DeviceLimits{.force = 99}};
  SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.045, .damping = 0.5};  // bears 1000 N/m
  o.hand_linear = {};
  o.substeps = 1;
  o.X_DH.translation() = Vec3d(0, 0, 1e-3);
  SimulatedDevice device(o, StillHand{});
  DeviceState state;
  double low = 1, high = -1;
  for (int i = 0; i < 3000; ++i) {
    if (device.read(state) != DeviceStatus::kOk) return kInf;
    Wrenchd w = scene.tick({.X_WT = state.X_DH}, kTick).wrench;
    w.force.z() -= 1;
    w.torque.setZero();
    (void)device.write(w);
    device.advance(kTick);
    if (i < 2500) continue;
    low = std::min(low, state.X_DH.translation().z());
    high = std::max(high, state.X_DH.translation().z());
  }
  return high - low;
}

}  // namespace

TEST_CASE("passivity: in the loop a wall too stiff for the device trembles ten times less") {
  const auto controlled = [](double k) { return left_over(k, PassivityController({.stiffness = 700})); };
  CHECK(left_over(500) < 1.5e-5);
  for (const double k : {1500.0, 3000.0, 10000.0}) {
    CAPTURE(k);
    CHECK(left_over(k) > 3e-3);
    CHECK(controlled(k) < 0.1 * left_over(k));
  }
}

TEST_CASE("passivity: hostile wrenches and options") {
  auto bone = small_grid();
  for (const double huge : {1e200, 1e308, kInf, kNaN}) {
    auto scene = HapticScene{bone,
                             300,
                             Floor<>{},
                             Add{0},
                             PassivityController({.contact_stiffness = 1}),
                             DeviceLimits{.force = 3, .torque = 1}};
    for (int k = 0; k < 50; ++k) {
      scene.part<Add>().newton = k % 3 == 0 ? huge : 0;
      const TickResult r = scene.tick({.X_WT = at(0, 0, -1e-3 * sine(k, 20))}, k % 7 == 0 ? kNaN : kTick);
      REQUIRE(is_finite(r.wrench));
      REQUIRE(r.wrench.force.norm() <= 3);
      REQUIRE(std::isfinite(scene.part<PassivityController>().given()));
      REQUIRE(std::isfinite(scene.part<PassivityController>().excess()));
    }
  }
  CHECK(refusal([] { PassivityController{{.stiffness = -1}}; }) ==
        "trephine::PassivityController: stiffness must be finite and >= 0 N/m, got -1");
  for (const double bad : {-1.0, kNaN, kInf}) {
    CHECK(!refusal([&] { PassivityController{{.angular_stiffness = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.delay = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.quantum = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.angular_quantum = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.contact_stiffness = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.contact_angular_stiffness = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.damping = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.angular_damping = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.force = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.torque = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.force_rate = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.torque_rate = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.reserve = bad}}; }).empty());
    CHECK(!refusal([&] { PassivityController{{.memory = bad}}; }).empty());
  }
  CHECK(!refusal([] { PassivityController{{.memory = 0}}; }).empty());
}
