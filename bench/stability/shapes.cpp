// SPDX-License-Identifier: MIT
// Scenarios 14 to 16: edges, corners, slots, holes, from one contact to the whole shaft, in the loop and sliding.
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace trephine::bench {
namespace {

constexpr StiffnessBudget kPremium{.linear = 800, .angular = 0.3};
// A search ends within a thousandth of a voxel of the surface, so that stiffness by differences is off by so much. The
// coupled tool touches some hundred points at most, fewer the less it is pressed: its stiffness is asked for to 2 %.
constexpr double kByDifferences = 1.0075, kByPoints = 1.02;
constexpr double kRuleE = 1e-3;  // [mJ] what counts as nothing: rounding of a run's sums and the image's ripple

const std::vector<Setup> kTools = usual_setups({{.renderer = "line", .budget = kPremium},
                                                {.renderer = "surface", .budget = kPremium},
                                                {.renderer = "surface", .options = "thesis' counts"}});

bool has_shaft(const Place& place) { return place.burr.shaft_length > 0; }

Setup setup_for(Setup tool, const Place& place, double K) {
  tool.burr = place.burr;
  tool.stiffness = K;
  return tool;
}

/// In a hand at the device's usual damping; `real`: with Coulomb friction and encoders.
LoopOptions in_hand(const Place& place, const Setup& setup, const std::string& hand, int delay, bool real) {
  const Case c{.delay = delay, .hand = hand, .friction = real ? 0.05 : 0.0, .quantum = real ? 0.055e-3 : 0.0};
  LoopOptions o = press(place, setup, c.device());
  o.device.substeps = 5;
  return o;
}

struct Felt {
  double linear = 0, angular = 0;
};
Felt felt(const Setup& s, const Place& place, double depth) {
  constexpr double kMove = 2e-5, kTurn = 1e-3;
  constexpr int kRest = 3;  // ticks: a search ends within a share of the device's motion
  const Posed touch = place.start(s);
  auto tool = make_tool(s, *place.bone, place.isovalue);
  const auto at = [&](const Vec3d& dx, const Vec3d& dr) {
    const Posed from = moved(touch, 1e-3 * place.outward);
    Posed to = moved(touch, dx - depth * place.outward);
    to.linear() = rotation_from_vector<double>(dr) * touch.linear();
    tool->reset();
    static_cast<void>(lead_tool(*tool, from, to, 30));
    return lead_tool(*tool, to, to, kRest);
  };
  Mat3d K, T;
  for (int a = 0; a < 3; ++a) {
    const Vec3d e = Vec3d::Unit(a), none = Vec3d::Zero();
    K.col(a) = -(at(kMove * e, none).force - at(-kMove * e, none).force) / (2 * kMove);
    T.col(a) = -(at(none, kTurn * e).torque - at(none, -kTurn * e).torque) / (2 * kTurn);
  }
  const auto largest = [](const Mat3d& m) {
    return Eigen::SelfAdjointEigenSolver<Mat3d>(Mat3d(0.5 * (m + m.transpose()))).eigenvalues().maxCoeff();
  };
  return {largest(K), largest(T)};
}

/// Scenario 15: open loop, 30 mm/s over the place at a depth.
double slide_step(const Setup& s, const Place& place, double depth, double& most) {
  auto tool = make_tool(s, *place.bone, place.isovalue);
  const Posed touch = place.start(s);
  const Vec3d n = place.outward;
  const double K =
      s.renderer == "line" || s.renderer == "coupled" ? s.stiffness : PlaneLaw(s, Vec3d::UnitZ()).tangent_at(2);
  Wrenchd last;
  double beyond = -1;
  for (int i = -20; i < 200; ++i) {
    const double along = 3e-5 * (std::max(i, 0) - 100);
    const Posed X = moved(touch, along * place.across - (depth + std::min(i, 0) * 1e-4) * n);
    const Wrenchd w = tool->tick({X, false}, 1e-3).wrench;
    if (i > 0) {
      beyond = std::max(beyond, (w.force - last.force).norm() - 1.5 * K * 3e-5);
      most = std::max(most, (w.force - last.force).norm());
    }
    last = w;
  }
  return beyond;
}

/// At the nominal stiffness.
Measured in_the_hand(const Setup& tool, const Place& place, const std::string& hand, int delay, bool real) {
  const std::string& name = place.name;
  const Setup s = setup_for(tool, place, 800);
  auto any = make_tool(s, *place.bone, place.isovalue);
  const LoopReport r = run_loop(law_of(*any), in_hand(place, s, hand, delay, real));
  const std::string c =
      name + ", hand " + hand + ", delay " + std::to_string(delay) + (real ? ", friction and quantum" : "");
  const std::string group = has_shaft(place) ? "14 " : name == "slot" ? "16 " : "15 ";
  Measured m;
  m.judge(group + "energy beyond Rule E at 800 N/m", c, tool, 1e3 * r.beyond, kRuleE, "mJ", 1e3 * r.energy);
  m.judge(group + "amplitude left at 800 N/m", c, tool, 1e3 * r.amplitude, real ? 0.21 : 0.1, "mm");
  return m;
}

/// The device's side.
Measured stiffness_felt(const Setup& tool, const Place& place) {
  Felt most;
  for (const double depth : {1e-4, 3e-4, 6e-4}) {
    if (place.name == "shaft in a hole" && depth < 3e-4) continue;
    const Felt f = felt(setup_for(tool, place, 800), place, depth);
    most = {std::max(most.linear, f.linear), std::max(most.angular, f.angular)};
  }
  const double more = tool.renderer == "coupled" ? kByPoints : kByDifferences;
  Measured m;
  m.judge("14 stiffness felt", place.name, tool, most.linear, more * kPremium.linear, "N/m", kPremium.linear);
  m.judge("14 rotational stiffness felt", place.name, tool, most.angular, more * kPremium.angular, "N·m/rad",
          kPremium.angular);
  return m;
}

Measured slid(const Setup& tool, const Place& place) {
  Measured m;
  for (const auto& [depth, name] : {std::pair(3e-4, ", depth 0.3 mm"), std::pair(8e-4, ", depth 0.8 mm")}) {
    double most = 0;
    const double beyond = slide_step(setup_for(tool, place, 800), place, depth, most);
    m.judge("15 force step beyond 1.5 K |Δx|, slid at 30 mm/s", place.name + name, tool, beyond, 0.02, "N", most);
  }
  return m;
}

}  // namespace

void plan_places(const StabilityOptions& options, Plan& plan) {
  for (const std::string& name : place_names()) {
    const auto place = std::make_shared<Place>(make_place(name));
    const bool shaft = has_shaft(*place);
    for (const Setup& tool : kTools) {
      if (tool.budget && !shaft) continue;
      if (options.quick && tool.options == "thesis' counts") continue;
      for (const std::string hand : {"light", "firm"})
        for (const int delay : {0, 1})
          for (const bool real : {false, true})
            if (!options.quick || (hand == "firm" && delay == 0))
              plan.push_back({tool.renderer + ", " + name + " in the hand",
                              [=] { return in_the_hand(tool, *place, hand, delay, real); }});
      if (shaft || name == "flat wall")
        plan.push_back({tool.renderer + ", " + name + " felt", [=] { return stiffness_felt(tool, *place); }});
      if (!shaft && name != "slot")
        plan.push_back({tool.renderer + ", " + name + ", slide", [=] { return slid(tool, *place); }});
    }
  }
}

}  // namespace trephine::bench
