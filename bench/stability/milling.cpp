// SPDX-License-Identifier: MIT
// Scenario 20: voxels vanish in contact, under 1 to 10 N, for a minute; on the phantom's block and on a real skull.
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"
#include "stability/places.hpp"

#include "bone.hpp"
#include "spot.hpp"

#include <cmath>
#include <sstream>

namespace trephine::bench {
namespace {

struct Site {
  std::string name;
  std::shared_ptr<Bone> bone{};
  double isovalue = 0;
  Vec3d p = Vec3d::Zero(), n = Vec3d::UnitZ();
  Burr burr{};
  double rate = 0;  // of milling [densities/s]
};

LoopReport mill(const Site& site, const Setup& setup, double newton, double seconds, bool spindle) {
  auto tool = make_tool(setup, *site.bone, site.isovalue);
  LoopOptions o;
  o.device = device_of(0.045, 0.5, "firm");
  o.device.substeps = 5;
  o.along = site.n;
  const double radius = setup.renderer == "line" ? 0 : site.burr.tip_radius;
  const Posed start = tool_pose(site.p + (radius + 1e-3) * site.n, site.n);
  o.device.X_DH = start;
  const double k = o.device.hand_linear.stiffness;
  const Vec3d u = site.n.unitOrthogonal(), v = site.n.cross(u);
  // Presses with `newton` on the surface and sweeps slowly over 3 mm.
  o.hand = [=](double t) {
    const double in = std::min(1.0, 2 * t) * (1e-3 + newton / k);
    const double phase = 0.7 * t;
    return HandTarget(moved(start, -in * site.n + 1.5e-3 * (std::sin(phase) * u + (std::cos(1.3 * phase) - 1) * v)));
  };
  o.seconds = seconds;
  o.escape = 0.06;
  // What is declared, where a law has one spring; else as found.
  if (setup.renderer == "line" || setup.renderer == "coupled") o.stiffness = setup.stiffness;
  if (setup.renderer == "coupled") o.angular_stiffness = setup.coupled.rotational_stiffness;
  return run_loop(law_of(*tool, spindle), o);
}

Site block() {
  Site s{.name = "block",
         .isovalue = kPlaceIsovalue,
         .burr = {.tip_radius = 1.5e-3, .shaft_radius = 0.8e-3, .shaft_length = 20e-3},
         .rate = 80};
  s.bone = make_bone([](const Vec3d& p) { return p.z() - 8.5e-3; });
  s.p = Vec3d(0, 0, 8.5e-3);
  return s;
}

Site from(drill::Bone bone) {
  const drill::Spot spot = drill::find_spot(bone);
  Site s{
      .name = bone.name, .isovalue = bone.isovalue, .p = spot.p_W, .n = spot.normal_W, .burr = bone.burr, .rate = 300};
  s.bone = std::make_shared<Bone>(std::move(bone.grid));
  return s;
}

Site scanned(const std::string& skull) {
  drill::Options o;
  o.skull = skull;
  return from(drill::load_bone(o));
}

/// The ways to mill that keep steps small are the default options' alone.
std::vector<Setup> tools() {
  std::vector<Setup> all = usual_setups();
  for (const char* renderer : {"line", "surface", "coupled"}) {
    for (const Cut cut : {Cut::kAtOnce, Cut::kAdvancing}) all.push_back({.renderer = renderer, .cut = cut});
    all.push_back({.renderer = renderer});
    all.back().stack.rate = {.force = 190, .torque = 6};
    // The coupled tool has this limit within, and Surface's stiffness is beyond any that the limit could take.
    if (all.back().renderer != "line") continue;
    for (const Cut cut : {Cut::kByRate, Cut::kAdvancing}) {
      all.push_back({.renderer = renderer, .cut = cut});
      all.back().stack.release = ReleaseLimit::Options{};
    }
  }
  return all;
}

}  // namespace

Place scanned_place(const std::string& skull, bool milled) {
  Site site = scanned(skull);
  const Setup coupled{.renderer = "coupled", .burr = site.burr, .mill_rate = site.rate};
  Vec3d end = site.p;
  if (milled) end = mill(site, coupled, 3, 3, true).last.translation();
  // Where the burr, led down the normal, first meets bone.
  auto tool = make_tool(coupled, *site.bone, site.isovalue);
  const Vec3d top = end + (site.p - end).dot(site.n) * site.n;
  const auto at = [&](double height) { return tool_pose(top + height * site.n, site.n); };
  double high = site.burr.tip_radius + 2e-3, low = (end - site.p).dot(site.n) - site.burr.tip_radius;
  for (int i = 0; i < 20; ++i) {
    const double height = 0.5 * (low + high);
    tool->reset();
    const Wrenchd w = lead_tool(*tool, at(site.burr.tip_radius + 2e-3), at(height));
    (w.force.dot(site.n) > 0.01 ? low : high) = height;
  }
  Place p{.name = site.name + (milled ? ", milled" : ""), .burr = site.burr, .bone = site.bone};
  p.isovalue = site.isovalue;
  p.touching = at(high);
  p.touching_line = moved(p.touching, -site.burr.tip_radius * site.n);
  p.outward = site.n;
  p.across = site.n.unitOrthogonal();
  p.mill_rate = site.rate;
  return p;
}

void plan_milling(const StabilityOptions& options, Plan& plan) {
  const auto measured = [=](bool skull, Setup s, double newton, bool spindle) {
    Site site = skull ? scanned(options.skull) : block();
    s.burr = site.burr;
    s.mill_rate = site.rate;
    const double seconds = (options.quick ? 3.0 : 60.0) / (skull ? 3 : 1);
    const LoopReport r = mill(site, s, newton, seconds, spindle);
    std::ostringstream name;
    name << site.name << ", " << newton << " N, " << (spindle ? "milling" : "sliding") << ", " << seconds << " s";
    Measured m;
    m.judge("20 greatest force step a tick", name.str(), s, r.force_step, s.renderer == "coupled" ? 0.1 : 0.2, "N",
            r.most_force);
    m.judge("20 energy beyond Rule E", name.str(), s, 1e3 * r.beyond, 1e-3, "mJ", 1e3 * r.energy);
    return m;
  };
  for (const bool skull : {false, true}) {
    if (skull && options.quick && options.skull.empty()) continue;
    for (const Setup& tool : tools())
      for (const double newton : options.quick ? std::vector{3.0} : std::vector{1.0, 3.0, 10.0})
        for (const bool spindle : {false, true}) {
          if (!spindle && (!skull || tool.cut != Cut::kByRate || tool.stack.rate || tool.stack.release)) continue;
          plan.push_back({tool.renderer + ", milling", [=] { return measured(skull, tool, newton, spindle); }});
        }
  }
}

}  // namespace trephine::bench
