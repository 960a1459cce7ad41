// SPDX-License-Identifier: MIT
// Scenario 18: jumps and turns.
#include "stability/measured.hpp"
#include "stability/places.hpp"

#include <cmath>
#include <limits>

namespace trephine::bench {
namespace {

Stack limited() { return {.limits = {3.3, 0.1}}; }

/// Ticks until a good pose is answered well again; large if never.
int recovery(AnyTool& tool, const Posed& free) {
  for (int i = 1; i <= 20; ++i) {
    const TickResult r = tool.tick({free, false}, 1e-3);
    if (r.status == Status::kOk && r.contact.count == 0 && r.wrench.force.norm() < 1e-9) return i;
  }
  return 99;
}

struct Worst {
  int recovery = 0, bad = 0;
  double force = 0;
  void take(const TickResult& r) {
    bad += !is_finite(r.wrench) || !(r.wrench.force.norm() <= 3.3) || !(r.wrench.torque.norm() <= 0.1);
    force = std::max(force, r.wrench.force.norm());
  }
};

void tick_thrice(AnyTool& tool, const Posed& X, const Posed& free, Worst& w) {
  for (int i = 0; i < 3; ++i) w.take(tool.tick({X, false}, 1e-3));
  w.recovery = std::max(w.recovery, recovery(tool, free));
}

Measured jumps(const Who& who) {
  const Place place = make_place("flat wall");
  Setup s{.renderer = who.renderer, .options = who.options, .stack = limited()};
  s.burr.shaft_length = 20e-3;
  auto tool = make_tool(s, *place.bone, place.isovalue);
  const Posed free = tool_pose(Vec3d(0, 0, 5e-3), Vec3d::UnitZ());
  const Posed pressed = tool_pose(Vec3d(0, 0, 0.9e-3), Vec3d::UnitZ());
  Worst w;
  for (const double jump : {5e-3, 10e-3, 20e-3, 50e-3})
    for (const Vec3d& way : {Vec3d(0, 0, -1), Vec3d(0, 0, 1), Vec3d(1, 0, 0), Vec3d(0.6, 0, -0.8)})
      for (const Posed& start : {free, pressed}) {
        static_cast<void>(lead_tool(*tool, free, start));
        Posed X = start;
        X.translation() += jump * way;
        tick_thrice(*tool, X, free, w);
      }
  for (int a = 0; a < 3; ++a) {
    static_cast<void>(lead_tool(*tool, free, pressed));
    const Vec3d half_turn = 3.14159265 * Vec3d::Unit(a);
    tick_thrice(*tool, make_pose<double>(rotation_from_vector<double>(half_turn), pressed.translation()), free, w);
  }
  const std::string name = "jumps of 5 to 50 mm, half turns";
  Measured m;
  m.judge("18 answers that are not finite or above the limits", name, who, w.bad, 0, "");
  m.judge("18 ticks until a good pose is answered well", name, who, w.recovery, 2, "ticks");
  m.tell("18 greatest force", name, who, w.force, "N", 3.3);
  return m;
}

}  // namespace

void plan_jumps(const StabilityOptions&, Plan& plan) {
  for (const std::string renderer : {"line", "surface", "coupled"})
    for (const std::string choice : {"default", "thesis"}) {
      if (choice == "thesis" && thesis_choices(renderer).empty()) continue;
      const Who who(renderer, choice);
      plan.push_back({renderer + ", jumps", [=] { return jumps(who); }});
    }
}

}  // namespace trephine::bench
