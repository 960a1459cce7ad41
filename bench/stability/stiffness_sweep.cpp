// SPDX-License-Identifier: MIT
// Stiffness from 10² to 10⁶ N/m at every place, over the device's damping, friction, encoders, delay and hand: the
// greatest that comes to rest, what it gives the hand, how it steps, and the cycle beyond it.
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"

#include <future>

namespace trephine::bench {
namespace {

constexpr double kSoftest = 1e2, kStiffest = 1e6;  // [N/m]
constexpr double kRuleE = 1e-3;                    // [mJ] as on the shapes: rounding and the image's ripple
constexpr double kMilled = 15e-3;                  // [m] bone that a run on the skull has to each side

/// Where a tool is pressed: a shape that all read, or scanned bone that each run carves. Made when first asked for.
struct Ground {
  std::shared_future<Place> place;
  bool milled = false;
};

std::shared_future<Place> later(std::function<Place()> make) {
  return std::async(std::launch::deferred, std::move(make)).share();
}

Place milled_meanwhile(const std::string& skull) {
  Place place = scanned_place(skull, false);
  place.bone = round(place, kMilled);
  place.name += ", milled meanwhile";
  return place;
}

enum class End { kRests, kGoesOn, kFallsThrough };

struct Run {
  LoopReport report;
  End end = End::kRests;
};

Run run(const Ground& ground, const Setup& tool, const Case& c, double K) {
  const Place& place = ground.place.get();
  Setup s = tool;
  s.burr = place.burr;
  s.stiffness = K;
  s.mill_rate = place.mill_rate;
  const auto bone = ground.milled ? copy_of(*place.bone) : place.bone;
  auto any = make_tool(s, *bone, place.isovalue);
  LoopOptions o = press(place, s, c.device(), bias_for(K));
  const bool held = c.hand != "none";
  // What slides off an edge needs its time to rest beside it; what nobody holds, and moves along one line, swings
  // longer.
  o.seconds = held ? 2.5 : 4;
  o.escape = 0.03;
  // What is declared, where a law has one spring; else as found.
  if ((s.renderer == "line" && !place.by_shaft) || s.renderer == "coupled") o.stiffness = K;
  if (s.renderer == "coupled") o.angular_stiffness = s.coupled.rotational_stiffness;
  const Law law = law_of(*any, ground.milled);
  Run r{.report = run_loop(held ? law : along(law, way_in(place).normalized()), o)};
  // Comes to rest; on bone that is milled away meanwhile, sinks in without a tremble.
  const LoopReport& found = r.report;
  const bool rests =
      (ground.milled ? found.tremble : found.amplitude) <= 1e-4 + 2 * c.quantum && (ground.milled || found.turn < 0.02);
  const double in = (found.last.translation() - place.start(s).translation()).dot(way_in(place));
  if (found.escaped)
    r.end = in > 0 ? End::kFallsThrough : End::kGoesOn;
  else if (rests)
    r.end = found.mean_force.norm() > 0.1 * bias_for(K) ? End::kRests : End::kFallsThrough;
  else
    r.end = End::kGoesOn;
  return r;
}

Measured measure(const Ground& ground, const Setup& tool, const Case& c) {
  constexpr double kWithin = 1.1;
  double rested = 0;  // the stiffest that did; soft springs that let the tool fall through are passed over
  const double found = largest_stable(kSoftest, kStiffest, kWithin, [&](double K) {
    const Run r = run(ground, tool, c, K);
    if (r.end == End::kRests) rested = std::max(rested, K);
    return r.end == End::kRests || (r.end == End::kFallsThrough && (rested == 0 || !r.report.escaped));
  });
  const double K = std::min(found, kWithin * rested);
  const LoopReport at = run(ground, tool, c, std::max(kSoftest, rested)).report;
  const std::string place = ground.place.get().name;
  Measured m;
  m.judge("sweep: energy beyond Rule E at the greatest stable K", place + ", " + c.text(), tool, 1e3 * at.beyond,
          kRuleE, "mJ", 1e3 * at.energy);
  m.line("stability_sweep", place, c.damping, c.delay, c.hand, c.friction, 1e3 * c.quantum, tool.renderer, label(tool),
         K, c.theory(), 1e3 * at.beyond, at.force_step);
  return m;
}

const std::vector<Setup> kTools =
    usual_setups({{.renderer = "surface", .budget = StiffnessBudget{.linear = 800, .angular = 0.3}}});

}  // namespace

void plan_sweep(const StabilityOptions& options, Plan& plan) {
  std::vector<Ground> grounds;
  for (const char* name : {"flat wall", "edge 90", "corner", "concave corner", "slot", "shaft in a hole",
                           "one bar under the shaft", "shaft flush", "thin wall"})
    grounds.push_back({later([=] { return make_place(name); })});
  if (!options.quick || !options.skull.empty())
    grounds.push_back({later([skull = options.skull] { return milled_meanwhile(skull); }), true});
  const std::vector<Case> all = swept_cases(12);
  for (const Ground& ground : grounds)
    for (const Setup& tool : kTools)
      for (std::size_t i = 0; i < all.size(); ++i) {
        if (options.quick && i % 8 != 0) continue;
        plan.push_back({tool.renderer + ", sweep", [=, c = all[i]] { return measure(ground, tool, c); }});
      }
}

}  // namespace trephine::bench
