// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "common/percentile.hpp"
#include "common/ripple.hpp"
#include "common/table.hpp"
#include "cutting/times.hpp"
#include "stage/cutting_runs.hpp"
#include "support/poses.hpp"
#include "support/raster.hpp"

#include <trephine/everything.hpp>
#include <trephine/tool/named_tools.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

/// The cutting law against measured forces, in closed loops with hands, and beside plain contact.
///   bench_cutting --out DIR [--quick]
/// writes DIR/cutting.csv. `measured` and `spread` are a source's; `law` is the closed form, `simulated` a run.
namespace trephine::bench {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr double kAir = -1000, kBone = 1700, kIso = 350;  // HU; the bone has strength 1

class Report {
 public:
  explicit Report(const std::string& folder)
      : table_(folder + "/cutting.csv", "part,case,quantity,unit,measured,spread,law,simulated,fitted,within") {}

  struct Row {
    std::string part, name, quantity, unit;
    double measured = kNone, spread = kNone, law = kNone, simulated = kNone;
    bool fitted = false;
  };
  /// `within`: whether law and simulation lie within the spread of what was measured.
  void row(const Row& r) {
    const auto text = [](double v) { return std::isnan(v) ? std::string() : format(v); };
    std::string within;
    if (!std::isnan(r.measured) && !std::isnan(r.spread) && !r.fitted) {
      const auto off = [&](double v) { return !std::isnan(v) && std::abs(v - r.measured) > r.spread; };
      within = off(r.law) || off(r.simulated) ? "no" : "yes";
    }
    table_.row(without_commas(r.part), without_commas(r.name), r.quantity, r.unit, text(r.measured), text(r.spread),
               text(r.law), text(r.simulated), r.fitted ? "yes" : "", within);
    std::fprintf(stderr, "cutting: %-12s %-44s %-22s %9s +- %-6s law %-9s run %-9s %-7s %s\n", r.part.c_str(),
                 r.name.c_str(), r.quantity.c_str(), text(r.measured).c_str(), text(r.spread).c_str(),
                 text(r.law).c_str(), text(r.simulated).c_str(), r.unit.c_str(), r.fitted ? "fitted" : within.c_str());
  }

 private:
  [[nodiscard]] static std::string format(double v) {
    std::array<char, 32> out{};
    std::snprintf(out.data(), out.size(), "%.4g", v);
    return out.data();
  }
  Table table_;
};

// --- Drills at a machine's feed ----------------------------------------------------------------------------

/// Thrust [N] and torque [N m].
struct Cut {
  double thrust = 0, torque = 0;
};

[[nodiscard]] Cut by_law(const CuttingLaw& law, const NamedTool& tool, double turns, double feed) {
  const auto says = test::cutting::plunge_of(tool.tool, {.edges = tool.edges, .speed = rpm(turns), .law = law}, feed);
  return {says.thrust, says.torque};
}

[[nodiscard]] VoxelGrid<std::int16_t> block(double edge, double h, double top) {
  const int n = static_cast<int>(edge / h);
  return test::rasterise<std::int16_t>(
      test::HalfSpace{Vec3d(0, 0, top), Vec3d::UnitZ()},
      {.size = {n, n, n}, .spacing = Vec3d::Constant(h), .blur = 0.7, .contrast = kBone - kAir, .air = kAir});
}

/// Feeds a drill at constant speed until thrust and torque are steady, as a machine does.
[[nodiscard]] Cut by_machine(const CuttingLaw& law, const NamedTool& tool, double turns, double feed) {
  // A stiff coupling that feels little: as steady as a machine, within the coupling's largest force.
  const double force_scale = std::min(1.0, 2 / by_law(law, tool, turns, feed).thrust);
  const test::cutting::Fed fed = test::cutting::feed(
      test::cutting::BoneBlock<std::int16_t>{}, tool, {.speed = rpm(turns), .law = law, .force_scale = force_scale},
      {.speed = feed, .deep = 6.5e-3}, Vec3d::UnitZ(), Vec3d(1.1e-4, -0.7e-4, 0));
  return {fed.thrust, fed.torque};
}

/// MacAvelia et al. 2012: 3.2 mm drill, 120 mm/min, three speeds.
struct Series {
  const char* specimen;
  std::array<double, 3> thrust, thrust_sd, torque, torque_sd;  // [N], [N mm]
};
constexpr std::array<double, 3> kTurns{1000, 1250, 1500};
constexpr Series kHuman{"human femurs", {198, 181, 176}, {14, 14, 11}, {186, 158, 140}, {17, 16, 16}};
constexpr Series kArtificial{"artificial femurs", {87, 82, 76}, {19, 11, 9}, {67, 61, 53}, {8.4, 2.9, 2.9}};

/// Share of the edges' own force in a series at its first speed, by least squares: what does not fall with the speed.
[[nodiscard]] double own_share(const std::array<double, 3>& values) {
  // value / first = (1 − s) n₀/n + s.
  double top = 0, bottom = 0;
  for (std::size_t i = 1; i < 3; ++i) {
    const double chips = kTurns[0] / kTurns[i];
    top += (values[i] / values[0] - chips) * (1 - chips);
    bottom += (1 - chips) * (1 - chips);
  }
  return top / bottom;
}

/// The law with these values at the first speed, and these shares of edges. K_n is K_t; the rest of the thrust that is
/// not chips is the chisel's.
[[nodiscard]] CuttingLaw fitted(const NamedTool& drill, double feed, double thrust, double torque, double own_thrust,
                                double own_torque, double edge_radius) {
  CuttingLaw law;
  law.edge_radius = edge_radius;
  const Engagement on = test::cutting::whole(drill.tool);
  const double x = feed / rpm(kTurns[0]), whole_edge = law.edge_share(CuttingLaw::chip(x, drill.edges.count()));
  const double per_edge = drill.edges.count() / (2 * std::numbers::pi);
  law.energy = (1 - own_torque) * torque / (x * on.hard_area);
  law.edge_force = own_torque * torque / (per_edge * on.hard_area * whole_edge);
  law.thrust_ratio = (1 - own_thrust) * thrust / (law.energy * x * on.pressed);
  law.edge_thrust = law.edge_force;
  law.chisel = std::max(0.0, (own_thrust * thrust / whole_edge - law.edge_thrust * per_edge * on.pressed) /
                                 (drill.tool.burr().tip_radius * on.tip));
  return law;
}

void compare_series(Report& report, const Series& s, const Series& shares_of, bool quick) {
  const NamedTool drill = tool_by_name("twist-3.2");
  const double feed = 2e-3;
  const CuttingLaw law = fitted(drill, feed, s.thrust[0], 1e-3 * s.torque[0], own_share(shares_of.thrust),
                                own_share(shares_of.torque), CuttingLaw{}.edge_radius);
  const std::string part = std::string("MacAvelia 2012: ") + s.specimen;
  report.row({part, "u", "energy", "J/mm3", kNone, kNone, 1e-9 * law.energy, kNone, true});
  report.row({part, "K_t", "edge force", "N/mm", kNone, kNone, 1e-3 * law.edge_force, kNone, true});
  report.row({part, "kappa", "thrust ratio", "", kNone, kNone, law.thrust_ratio, kNone, true});
  report.row({part, "chisel", "thrust by radius", "N/mm", kNone, kNone, 1e-3 * law.chisel, kNone, true});
  for (std::size_t i = 0; i < 3; ++i) {
    const Cut exact = by_law(law, drill, kTurns[i], feed);
    const Cut run = quick && i == 1 ? Cut{kNone, kNone} : by_machine(law, drill, kTurns[i], feed);
    const std::string at = std::to_string(static_cast<int>(kTurns[i])) + " rpm";
    report.row({part, at, "thrust", "N", s.thrust[i], s.thrust_sd[i], exact.thrust, run.thrust, i == 0});
    report.row({part, at, "torque", "N mm", s.torque[i], s.torque_sd[i], 1e3 * exact.torque, 1e3 * run.torque, i == 0});
  }
}

void compare_drills(Report& report, bool quick) {
  compare_series(report, kHuman, kArtificial, quick);
  compare_series(report, kArtificial, kHuman, quick);
  const NamedTool two = tool_by_name("twist-2");
  const Cut thin = by_law(CuttingLaw{}, two, 12000, 50e-3 / 60);
  report.row({"J Braz Soc 2020", "2 mm, 12000 rpm, 50 mm/min", "thrust", "N", 14.1, kNone, thin.thrust,
              by_machine(CuttingLaw{}, two, 12000, 50e-3 / 60).thrust, true});
  const NamedTool drill = tool_by_name("twist-3.2");
  // An edge alone, by sawing: its force against the feed grew by a third from chips of 2 to 10 µm.
  const auto edge_thrust = [](double chip) {
    const CuttingLaw law;
    return law.thrust_ratio * law.energy * chip + law.edge_thrust * law.edge_share(chip);
  };
  report.row({"James 2013", "sawing; chips of 10 over 2 um", "thrust over thrust", "", 1.3, 0.3,
              edge_thrust(10e-6) / edge_thrust(2e-6), kNone, false});
  // Others measured a twentieth to a third of this thrust, at conditions of their own. No law of one material fits all.
  const Cut at_1000 = by_law(CuttingLaw{}, drill, 1000, 2e-3);
  const auto strength = [&](const char* who, double low, double high) {
    report.row({"other femurs", who, "thrust over the law's", "", (low + high) / 2 / at_1000.thrust,
                (high - low) / 2 / at_1000.thrust, 1, kNone, false});
  };
  strength("bovine (12 to 20 N)", 12, 20);
  strength("porcine (8 to 11 N)", 8, 11);
  strength("Hillery (24 to 48 N)", 24, 48);
  strength("Alam (25 to 85 N)", 25, 85);
}

// --- Hands -------------------------------------------------------------------------------------------------

/// What a hand-held run felt.
struct Held {
  double mean = 0, peak = 0;  // of the force felt while cutting [N]
  double ripple = 0;          // rms of the force less its mean over 50 ms [N]
  double removed_mm3 = 0,
         trembling = 0;  // [mm³]; rms of the handle's speed beyond the script's, over the last half [m/s]
  int not_ok = 0;        // ticks whose status is not ok
};

/// A hand that presses a tool into a block: down at a speed, or along a slot after it.
struct Operator {
  Vec3d start;
  double down = 1e-3, along = 0;  // [m/s]
  double deep = 3e-3;             // [m], where `along` begins
  HandTarget operator()(double t) const {
    const double way = std::min(down * t, deep);
    const double slid = along * std::max(0.0, t - deep / down);
    return test::tool_at(start + Vec3d(slid, 0, -way), Vec3d::UnitZ());
  }
};

template <class MakeScene>
[[nodiscard]] Held hold(const SimulatedDeviceOptions& options, const Operator& hand, double seconds, double h,
                        double top, MakeScene&& make_scene) {
  VoxelGrid<std::int16_t> bone = block(14e-3, h, top);
  auto scene = make_scene(bone);
  SimulatedDevice device(options, hand);
  const double dt = 1 / options.rate;
  Held out;
  std::vector<double> forces;
  double speeds = 0;
  int moving = 0;
  for (double t = 0; t < seconds; t += dt) {
    DeviceState state;
    static_cast<void>(device.read(state));
    const TickResult r = scene.tick({.X_WT = state.X_DH, .spindle_on = true}, dt);
    out.not_ok += r.status != Status::kOk ? 1 : 0;
    static_cast<void>(device.write(r.wrench));
    device.advance(dt);
    out.removed_mm3 += r.removed_mm3;
    if (r.removed_mm3 > 0 || r.contact.count > 0) forces.push_back(r.wrench.force.norm());
    if (t < seconds / 2) continue;
    const Vec3d script = (hand(t + 1e-4).X_DH.translation() - hand(t).X_DH.translation()) / 1e-4;
    speeds += (device.velocity().linear - script).squaredNorm();
    ++moving;
  }
  out.trembling = std::sqrt(speeds / std::max(1, moving));
  if (forces.empty()) return out;
  double sum = 0;
  for (const double f : forces) {
    sum += f;
    out.peak = std::max(out.peak, f);
  }
  out.mean = sum / static_cast<double>(forces.size());
  out.ripple = ripple(forces, static_cast<std::size_t>(0.05 / dt));
  return out;
}

[[nodiscard]] SimulatedDeviceOptions strong_arm(const Vec3d& at, double limit) {
  SimulatedDeviceOptions o;
  o.linear = {.inertia = 0.1, .damping = 2, .friction = 0.05, .quantum = 0.01e-3, .limit = limit};
  o.hand_linear = {.inertia = 0.2, .damping = 20, .stiffness = 1500};
  o.X_DH = test::tool_at(at, Vec3d::UnitZ());
  return o;
}

/// Holes and slots in bone, held by hand, on a device that gives 20 N.
void compare_operators(Report& report) {
  const NamedTool burr = tool_by_name("round-2.3");
  const double top = 10e-3;
  const Vec3d start(7e-3, 7e-3, top + burr.tool.burr().tip_radius + 0.2e-3);
  const auto with_law = [&](VoxelGrid<std::int16_t>& bone) {
    return HapticScene{bone, kIso, CoupledToolRenderer{burr.tool, CoupledOptions{.stiffness = 3000, .force = 20}},
                       Cutting{PressureCut{}, CuttingForce({.edges = burr.edges, .speed = rpm(20'000)})}};
  };
  // A hole: twenty operators held 4.2 to 18.9 N in the mean, 12.5 N at the peak.
  const auto row = [&](const char* name, const Operator& hand, double seconds) {
    const Held h = hold(strong_arm(start, 20), hand, seconds, 0.3e-3, top, with_law);
    report.row({"operators", name, "mean force", "N", 11.55, 7.35, kNone, h.mean, false});
    report.row({"operators", name, "peak force", "N", 12.5, kNone, kNone, h.peak, false});
  };
  row("hole, hand down at 2 mm/s", {.start = start, .down = 2e-3, .deep = 16e-3}, 8);
  row("hole, hand down at 4 mm/s", {.start = start, .down = 4e-3, .deep = 20e-3}, 5);
  Operator slot{.start = start, .down = 8e-3, .along = 4e-3, .deep = 8e-3};
  slot.start.x() = 4e-3;
  row("slot, hand along at 4 mm/s", slot, 3);
}

/// The law beside plain contact and the thesis' milling, by the same hand.
void compare_cuts(Report& report) {
  const NamedTool burr = tool_by_name("match-head-3");
  const double top = 10e-3;
  const Vec3d start(7e-3, 7e-3, top + burr.tool.burr().tip_radius + 0.2e-3);
  const SimulatedDeviceOptions arm = strong_arm(start, 8.5);
  const Operator hand{.start = start, .down = 8e-3, .along = 3e-3, .deep = 6e-3};
  const CoupledToolRenderer renderer{burr.tool, CoupledOptions{.stiffness = 800}};
  const auto row = [&](const char* name, const auto& make) {
    const Held h = hold(arm, hand, 2.2, 0.3e-3, top, make);
    report.row({"beside", name, "mean force", "N", kNone, kNone, kNone, h.mean, false});
    report.row({"beside", name, "ripple rms", "N", kNone, kNone, kNone, h.ripple, false});
    report.row({"beside", name, "removed", "mm3", kNone, kNone, kNone, h.removed_mm3, false});
  };
  row("plain contact", [&](auto& bone) { return HapticScene{bone, kIso, renderer}; });
  row("geometric cut", [&](auto& bone) { return HapticScene{bone, kIso, renderer, Cutting{}}; });
  row("cut by rate (thesis)", [&](auto& bone) {
    return HapticScene{bone, kIso, renderer, Cutting{RateLimitedCut<>{.rate = 2e5}}};
  });
  row("receding surface", [&](auto& bone) {
    return HapticScene{bone, kIso, renderer, Cutting{AdvancingCut{.speed = 5e-3}}};
  });
  row("cutting law", [&](auto& bone) {
    return HapticScene{bone, kIso, renderer,
                       Cutting{PressureCut{}, CuttingForce({.edges = burr.edges, .speed = rpm(40'000)})}};
  });
}

/// Closed loops of presets' devices, hands, tools and shares: how much the handle trembles with the law, and without.
void map_stability(Report& report, bool quick) {
  struct Grip {
    const char* name;
    HandAxes hand;
  };
  const std::array<Grip, 3> grips{{{"light", {.inertia = 0.02, .damping = 3, .stiffness = 150}},
                                   {"usual", {.inertia = 0.04, .damping = 8, .stiffness = 400}},
                                   {"firm", {.inertia = 0.1, .damping = 20, .stiffness = 1000}}}};
  double worst = 0;
  int loops = 0, trembling = 0;
  for (const std::string_view name : device_preset_names()) {
    if (quick && name != "Touch" && name != "sigma.7") continue;
    const DevicePreset preset = device_preset(name);
    for (const Grip& grip : grips)
      for (const char* const tool_name : {"round-3", "twist-3.2"}) {
        const NamedTool tool = tool_by_name(tool_name);
        const bool drill = tool.edges.chisel;
        const double top = 10e-3;
        const Vec3d start(7e-3, 7e-3, top + tool.tool.burr().tip_radius + 0.2e-3);
        SimulatedDeviceOptions o;
        o.linear = {.inertia = 0.08,
                    .damping = preset.capabilities.stiffness * 0.5e-3,
                    .friction = 0.05,
                    .quantum = preset.passivity.quantum,
                    .limit = preset.capabilities.max_force};
        o.hand_linear = grip.hand;
        o.output_dof = preset.capabilities.output_dof;
        o.X_DH = test::tool_at(start, Vec3d::UnitZ());
        Operator hand{.start = start, .down = 4e-3, .along = 0, .deep = 8e-3};
        if (!drill) hand.along = 4e-3, hand.deep = 5e-3, hand.start.x() = 4e-3;
        o.X_DH = test::tool_at(hand.start, Vec3d::UnitZ());
        const CoupledOptions gains{.stiffness = preset.stiffness, .force = preset.capabilities.max_force};
        const auto run = [&](const auto& cutting) {
          return hold(o, hand, 2.4, 0.3e-3, top, [&](auto& bone) {
            return HapticScene{bone, kIso, CoupledToolRenderer{tool.tool, gains}, cutting, DeviceLimits{preset.limits}};
          });
        };
        const Held with = run(Cutting{PressureCut{}, CuttingForce({.edges = tool.edges,
                                                                   .speed = rpm(drill ? 1000 : 40'000),
                                                                   .force_scale = drill ? 1 / 60.0 : 1})});
        const Held without = run(Cutting{});
        const std::string what = std::string(name) + "; " + grip.name + " grip; " + tool_name;
        report.row({"stability", what, "ripple rms with the law", "N", kNone, kNone, kNone, with.ripple, false});
        report.row({"stability", what, "ripple rms without", "N", kNone, kNone, kNone, without.ripple, false});
        ++loops;
        worst = std::max(worst, with.ripple);
        trembling += with.ripple > 0.1 * preset.capabilities.max_force ? 1 : 0;
      }
  }
  report.row({"stability", "worst of " + std::to_string(loops) + " loops", "ripple rms with the law", "N", kNone, kNone,
              kNone, worst, false});
  report.row({"stability", "of " + std::to_string(loops) + " loops", "ripple over a tenth of the device's force", "",
              kNone, kNone, kNone, static_cast<double>(trembling), false});
}

/// What the law and soft structures add to a tick.
void time_ticks(Report& report, bool quick) {
  const int ticks = quick ? 1300 : 3800;
  const auto row = [&](const std::string& name, const TickTimes& t) {
    report.row({"time", name, "tick without", "us", kNone, kNone, kNone, t.without, false});
    report.row({"time", name, "more; median", "us", kNone, kNone, 2, t.more, false});
    report.row({"time", name, "p99 without", "us", kNone, kNone, kNone, t.without_p99, false});
    report.row({"time", name, "p99 with", "us", kNone, kNone, kNone, t.with_p99, false});
  };
  for (const char* const name : {"round-3", "twist-3.2"})
    row(std::string("law; ") + name + " in a slot", time_of_law(tool_by_name(name), ticks));
  row("membrane; in air", OverDura{.over = 2e-3}.measure(ticks));
  row("membrane; milling over it", OverDura{.over = -1e-3}.measure(ticks));
  row("membrane; resting on it", OverDura{.hole = 6.5e-3, .over = -3.2e-3}.measure(ticks));
}

}  // namespace

int main_of(int argc, char** argv) {
  const CommandLine command(argc, argv);
  Report report(command.folder);
  compare_drills(report, command.quick);
  compare_operators(report);
  compare_cuts(report);
  map_stability(report, command.quick);
  time_ticks(report, command.quick);
  return 0;
}

}  // namespace trephine::bench

int main(int argc, char** argv) { return trephine::bench::main_of(argc, argv); }
