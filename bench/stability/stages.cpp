// SPDX-License-Identifier: MIT
// What each stage does to the greatest stable stiffness, and what it costs in felt stiffness and force error.
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"

#include <trephine/device/presets.hpp>

#include <cmath>
#include <numbers>

namespace trephine::bench {
namespace {

struct Named {
  std::string name;
  Stack stack;
};
std::vector<Named> stacks() {
  const Damping::Options damped{.linear = 5, .angular = 5e-3};
  const Damping::Options damped_in_contact{.linear = 5, .angular = 5e-3, .only_in_contact = true};
  const HuntCrossley::Options soft{.lambda = 1}, hard{.lambda = 5};
  const PassivityController::Options watch{.stiffness = 700, .angular_stiffness = 0.7};
  PassivityController::Options stored = watch;
  stored.contact_stiffness = 20000;
  stored.reserve = 2e-3;
  PassivityController::Options damps = stored;
  damps.damping = 20;
  damps.force = 3;
  damps.force_rate = 1000;
  return {{"none", {}},
          {"filter 100 Hz", {.filter = FirstOrderFilter::Options{100}}},
          {"filter 200 Hz", {.filter = FirstOrderFilter::Options{200}}},
          {"damping 5 N·s/m", {.damping = damped}},
          {"damping 5 N·s/m in contact", {.damping = damped_in_contact}},
          {"Hunt-Crossley 1 s/m", {.hunt_crossley = soft}},
          {"Hunt-Crossley 5 s/m", {.hunt_crossley = hard}},
          {"release limit 60 N/s", {.release = ReleaseLimit::Options{}}},
          {"rate limit 600 N/s", {.rate = WrenchRateLimit::Options{600, 18}}},
          {"passivity controller", {.passivity = watch}},
          {"passivity controller, stored energy known", {.passivity = stored}},
          {"Hunt-Crossley 1 s/m + passivity controller", {.hunt_crossley = soft, .passivity = stored}},
          {"damping 5 + passivity controller", {.damping = damped, .passivity = damps}}};
}

/// rms of the force's difference from the one without stages, over the rms of that: pressed, slid, let go.
double force_error(const Setup& s, const Place& place) {
  Setup plain = s;
  plain.stack = {};
  auto with = make_tool(s, *place.bone, place.isovalue), without = make_tool(plain, *place.bone, place.isovalue);
  const Posed touch = place.start(s);
  double error = 0, all = 0;
  for (int i = 0; i < 3000; ++i) {
    const double t = 1e-3 * i;
    const double depth =
        1e-3 * std::sin(2 * std::numbers::pi * 0.8 * t) + 2e-4 * std::sin(2 * std::numbers::pi * 3 * t);
    const double aside = 2e-3 * std::sin(2 * std::numbers::pi * 1.5 * t);
    const Posed X = moved(touch, aside * place.across - depth * place.outward);
    const Vec3d a = with->tick({X, false}, 1e-3).wrench.force, b = without->tick({X, false}, 1e-3).wrench.force;
    error += (a - b).squaredNorm();
    all += b.squaredNorm();
  }
  return std::sqrt(error / all);
}

/// A device that starts a millimetre off the bone.
LoopOptions off_bone(const Place& place, const Setup& s, const SimulatedDeviceOptions& device) {
  LoopOptions o;
  o.device = device;
  o.device.X_DH = moved(place.start(s), 1e-3 * place.outward);
  o.along = place.outward;
  return o;
}

/// A hand that goes in by `way` [m] at `speed` [m/s].
std::function<HandTarget(double)> led_in(const Posed& from, const Vec3d& outward, double way, double speed = 0.05) {
  return [=](double t) { return HandTarget(moved(from, -std::min(way, speed * t) * outward)); };
}

/// From there a hand pushes it on with 1 N.
LoopOptions pressed_by_hand(const Place& place, const Setup& s, const SimulatedDeviceOptions& device) {
  LoopOptions o = off_bone(place, s, device);
  const Posed target = moved(place.start(s), -1 / device.hand_linear.stiffness * place.outward);
  o.hand = [target](double) { return HandTarget(target); };
  return o;
}

LoopReport hit(const Setup& s, const Place& place, const SimulatedDeviceOptions& device, double newton, double speed) {
  auto tool = make_tool(s, *place.bone, place.isovalue);
  LoopOptions o = off_bone(place, s, device);
  const double k = device.hand_linear.stiffness;
  if (k > 0)
    o.hand = led_in(o.device.X_DH, place.outward, 1e-3 + newton / k, speed);
  else
    o.bias = -newton * place.outward;
  o.seconds = 4;
  return run_loop(along(law_of(*tool), place.outward), o);
}

double critical(Setup s, const Place& place, const SimulatedDeviceOptions& device, double within) {
  return largest_stable(1e2, 1e6, within, [&](double K) {
    s.stiffness = K;
    const LoopReport r = hit(s, place, device, bias_for(K), 0.1);
    return comes_to_rest(r, 1e-4);
  });
}

Measured preset_rows(std::string_view name, const std::string& renderer, const std::string& hand, bool staged) {
  const DevicePreset p = device_preset(name);
  Setup s{.renderer = renderer, .stiffness = p.stiffness};
  s.stack.limits = p.limits;
  s.coupled.rotational_stiffness = p.budget.angular;
  s.coupled.force = p.limits.force;
  if (p.limits.torque > 0) s.coupled.torque = p.limits.torque;
  if (staged) {
    s.budget = p.budget;
    s.stack.hunt_crossley = p.hunt_crossley;
    s.stack.passivity = p.passivity;
    s.stack.rate = p.rate;
  }
  const auto device = [&](const std::string& held) {
    SimulatedDeviceOptions d = device_of(0.06, p.stiffness * 1e-3 / 2, held);
    d.linear.quantum = p.passivity.quantum;
    d.linear.limit = p.limits.force;
    d.output_dof = p.capabilities.output_dof;
    return d;
  };
  const double rest = 0.1 + 2e3 * p.passivity.quantum;  // [mm]
  const std::string stack = staged ? "preset" : "renderer alone", who = std::string(name);
  Measured m;
  const LoopReport r = hit(s, make_place("flat wall"), device(hand), std::min(3.0, 0.5 * p.limits.force), 0.2);
  m.judge("presets: amplitude left at the stated stiffness", who + ", hand " + hand, {renderer, stack},
          1e3 * r.amplitude, rest, "mm");
  // The shaft laid flush needs a hand that keeps it there.
  const Place flush = make_place("shaft flush");
  const std::string held = hand == "none" ? "light" : hand;
  s.burr = flush.burr;
  auto tool = make_tool(s, *flush.bone, flush.isovalue);
  const LoopOptions o = pressed_by_hand(flush, s, device(held));
  m.judge("presets: amplitude left with the shaft laid flush", who + ", hand " + held, {renderer, stack},
          1e3 * run_loop(law_of(*tool), o).amplitude, rest, "mm");
  return m;
}

/// What a stack does to the stable stiffness, and what it costs.
Measured stage_rows(const Named& named, const Place& flat, double within) {
  const Who who("line", named.name);
  Setup s{.renderer = "line", .stack = named.stack};
  Measured m;
  for (const int delay : {0, 1}) {
    SimulatedDeviceOptions d = device_of(kDeviceMass, 0.5, "none");
    d.delay_ticks = delay;
    Setup delayed = s;  // the controller's options say what the device bears then
    if (delay > 0 && delayed.stack.passivity) {
      delayed.stack.passivity->delay = 1e-3 * delay;
      delayed.stack.passivity->stiffness /= 1 + 2 * delay;
    }
    m.tell("stages: greatest stable K", "b .5, hand none, delay " + std::to_string(delay), who,
           critical(delayed, flat, d, within), "N/m", 0.5 / (1e-3 * (0.5 + delay)));
  }
  const SimulatedDeviceOptions free = device_of(kDeviceMass, 0.5, "none");
  s.stiffness = 5000;
  m.tell("stages: amplitude left at 5000 N/m", "b .5, hand none, delay 0", who,
         1e3 * hit(s, flat, free, 1, 0.1).amplitude, "mm");
  s.stiffness = 800;
  m.tell("stages: force error", "pressed, slid, let go at 1 to 3 Hz", who, 100 * force_error(s, flat), "%");
  SimulatedDeviceOptions coarse = device_of(kDeviceMass, 0.5, "firm");
  coarse.linear.quantum = 0.055e-3;
  m.tell("stages: ripple held with a quantum of .055 mm", "1 N, firm hand, 800 N/m", who,
         hit(s, flat, coarse, 1, 0.1).ripple, "N");
  return m;
}

/// What a choice of the thesis costs at a place.
Measured choice_rows(const Who& who, const std::string& name, double within) {
  const Place p = make_place(name);
  const SimulatedDeviceOptions light = device_of(kDeviceMass, 0.5, "light");
  Setup s{.renderer = who.renderer, .options = who.options, .burr = p.burr};
  const double K = largest_stable(1e2, 1e6, within, [&](double k) {
    s.stiffness = k;
    auto tool = make_tool(s, *p.bone, p.isovalue);
    LoopOptions o = pressed_by_hand(p, s, light);
    o.seconds = 1.5;
    o.escape = 0.03;
    const LoopReport r = run_loop(law_of(*tool), o);
    return !r.escaped && r.amplitude <= 1e-4 && r.turn < 0.02;
  });
  Measured m;
  m.tell("choices: greatest stable stiffness (as the option means it)", name + ", light hand", who, K, "N/m");
  // Pressed so that the tip's centre is in bone, where a held force is held.
  s.stiffness = 800;
  auto tool = make_tool(s, *p.bone, p.isovalue);
  LoopOptions o = off_bone(p, s, light);
  o.hand = led_in(o.device.X_DH, p.outward, 1e-3 + 3 / light.hand_linear.stiffness);
  o.seconds = 1.5;
  const LoopReport r = run_loop(law_of(*tool), o);
  m.tell("choices: energy beyond Rule E at 800 N/m, pressed with 3 N", name + ", light hand", who, 1e3 * r.beyond, "mJ",
         1e3 * r.energy);
  return m;
}

/// Energy over time of a shaft pressed flush, and what Rule E grants.
Measured energy_lines(const Who& who) {
  const Place p = make_place("shaft flush");
  const Setup s{.renderer = who.renderer, .options = who.options, .burr = p.burr};
  auto tool = make_tool(s, *p.bone, p.isovalue);
  Measured m;
  LoopOptions o = off_bone(p, s, device_of(kDeviceMass, 0.5, "light"));
  o.hand = led_in(o.device.X_DH, p.outward, 0.01);
  o.seconds = 1;
  o.stiffness = 1600;
  o.angular_stiffness = 0.3;
  int i = 0;
  o.trace = [&](double t, const Wrenchd& w, double energy, double allowed) {
    if (i++ % 4 == 0)
      m.line("stability_energy", who.renderer, who.options, t, 1e3 * energy, 1e3 * allowed, w.force.norm());
  };
  static_cast<void>(run_loop(law_of(*tool), o));
  return m;
}

}  // namespace

void plan_stages(const StabilityOptions& options, Plan& plan) {
  const auto flat = std::make_shared<Place>(make_place("flat wall"));
  const double within = options.quick ? 1.2 : 1.06;
  for (const Named& named : stacks())
    plan.push_back({"line, stages", [=] { return stage_rows(named, *flat, within); }});
  for (const std::string renderer : {"line", "surface", "coupled"}) {
    // A device whose own damping bears just its preset's stiffness, with its quantum.
    for (const std::string_view name : device_preset_names())
      for (const std::string hand : {"none", "firm"})
        for (const bool staged : {false, true})
          plan.push_back({renderer + ", presets", [=] { return preset_rows(name, renderer, hand, staged); }});
    // Ours and the thesis'.
    std::vector<std::string> choices{"default"};
    if (renderer != "coupled") choices.push_back("thesis");
    if (renderer == "surface") choices.push_back("thesis' counts");
    for (const auto& choice : choices) {
      const Who who(renderer, choice);
      for (const std::string place :
           {"flat wall", "edge 90", "concave corner", "one bar under the shaft", "shaft flush"})
        plan.push_back({renderer + ", choices", [=] { return choice_rows(who, place, within); }});
      if (choice != "thesis' counts")
        plan.push_back({renderer + ", energy over time", [=] { return energy_lines(who); }});
    }
  }
}

}  // namespace trephine::bench
