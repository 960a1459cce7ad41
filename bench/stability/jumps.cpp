// SPDX-License-Identifier: MIT
// Scenarios 18 and 19: jumps, turns, and grids and isovalues at their ends.
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

Bone small_grid(const std::array<int, 3>& size, int fill) {
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const int density = fill == 0 ? 0 : fill == 1 ? 200 : (i + j + k) % 2 * 200;
        voxels.push_back(static_cast<std::int16_t>(density));
      }
  return Bone({.size = size, .spacing = Vec3d::Constant(2e-3), .outside = 0.0}, voxels, {.stored_gradients = true});
}

Measured ends_of_grids(const Who& who) {
  Worst w;
  int cases = 0;
  for (const auto& size : {std::array{1, 1, 1}, std::array{2, 2, 2}, std::array{16, 16, 1}, std::array{8, 8, 8}})
    for (const int fill : {0, 1, 2})  // empty, full, checkerboard
      for (const double isovalue : {-1.0, 0.0, 100.0, 200.0, 200.5}) {
        Bone bone = small_grid(size, fill);
        Setup s{.renderer = who.renderer, .options = who.options, .mill_rate = 1e4, .stack = limited()};
        s.burr.shaft_length = 10e-3;
        auto tool = make_tool(s, bone, isovalue);
        ++cases;
        for (int i = 0; i < 400; ++i) {
          const Vec3d p(1e-4 * (i % 40), 0, 4e-3 - 3e-5 * i);
          const Posed X = make_pose<double>(rotation_from_vector<double>(Vec3d(0.01 * i, 0, 0)), p);
          w.take(tool->tick({X, i > 200}, 1e-3));
        }
        // Where nothing is bone, or all is, there is still an answer; far away it is a clean one.
        const Posed away = tool_pose(Vec3d(0.5, 0, 0), Vec3d::UnitZ());
        if (isovalue > 0) w.recovery = std::max(w.recovery, recovery(*tool, away));
      }
  const std::string name = std::to_string(cases) + " grids and isovalues at their ends";
  Measured m;
  m.judge("19 answers that are not finite or above the limits", name, who, w.bad, 0, "");
  m.judge("19 ticks until a good pose is answered well", name, who, w.recovery, 2, "ticks");
  return m;
}

}  // namespace

void plan_jumps(const StabilityOptions&, Plan& plan) {
  for (const std::string renderer : {"line", "surface", "coupled"})
    for (const std::string choice : {"default", "thesis"}) {
      if (choice == "thesis" && thesis_choices(renderer).empty()) continue;
      const Who who(renderer, choice);
      plan.push_back({renderer + ", jumps", [=] { return jumps(who); }});
      plan.push_back({renderer + ", ends of grids", [=] { return ends_of_grids(who); }});
    }
}

}  // namespace trephine::bench
