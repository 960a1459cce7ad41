// SPDX-License-Identifier: MIT
// Scenario 13: the greatest stable stiffness on a flat wall, against an analytic wall of the same law and against
// theory.
#include "stability/closed_loop.hpp"
#include "stability/measured.hpp"

#include <cmath>

namespace trephine::bench {
namespace {

LoopOptions pressed(const Case& c, const Vec3d& n, double K) {
  LoopOptions o;
  o.device = c.device();
  o.bias = -bias_for(K) * n;
  o.along = n;
  return o;
}

/// Whether a small disturbance about the pressed rest dies down.
bool settles(const Law& law, const Case& c, const Posed& rest, const Vec3d& n, double K, double depth) {
  LoopOptions o = pressed(c, n, K);
  o.device.X_DH = moved(rest, -0.03 * depth * n);
  const double mass = o.device.linear.inertia + o.device.hand_linear.inertia;
  const double omega = std::sqrt((K + o.device.hand_linear.stiffness) / mass);
  o.seconds = std::max(2.0, 60 * 6.283 / omega);
  o.escape = 0.9 * depth;
  const LoopReport r = run_loop(law, o);
  return !r.escaped && (r.late <= r.early || r.late < 1e-9);
}

double analytic_critical(Setup setup, const Case& c, const Vec3d& n) {
  return largest_stable(0.4 * c.theory(), 1.6 * c.theory(), 1.001, [&](double K) {
    const PlaneLaw law(with_tangent(setup, n, K, bias_for(K)), n);
    const double depth = law.depth_at(bias_for(K));
    const Law wall = [&](const Posed& X, double) {
      return Wrenchd{law.force(-X.translation().dot(n)) * n, Vec3d::Zero()};
    };
    return settles(wall, c, tool_pose(-depth * n, Vec3d::UnitZ()), n, K, depth);
  });
}

/// A tool led straight onto a place until it is held with the force that presses.
struct Rest {
  std::unique_ptr<AnyTool> tool;
  Posed touch;
  Vec3d n;
  double room;
  double depth = 0;  ///< [m]
  double guess = 0;  ///< the same by the plane's law

  /// `off` [m]: how far the place may be from where its shape says: some microns on a wall of an image.
  Rest(const Setup& s, const Place& place, double newton, double off)
      : tool(make_tool(s, *place.bone, place.isovalue)),
        touch(place.start(s)),
        n(place.outward),
        room(place.room),
        guess(PlaneLaw(s, n).depth_at(newton)) {
    double low = guess - off, high = guess + off;
    for (int i = 0; i < 20; ++i) {
      depth = 0.5 * (low + high);
      (lead(depth) < newton ? low : high) = depth;
    }
    depth = 0.5 * (low + high);
    static_cast<void>(lead(depth));
  }
  [[nodiscard]] Posed at(double down) const { return moved(touch, -down * n); }
  /// Anew from above to `down` [m]; what it is held with there [N].
  double lead(double down) {
    tool->reset();  // on its way back up it would jump
    return lead_tool(*tool, at(-room), at(down), 10).force.dot(n);
  }
};

constexpr double kOffWall = 1e-4;     // [m]
constexpr double kOffShape = 1.2e-3;  // the same at edges, which pass between vertices, and on scanned bone

/// `beyond`: how many times theory's stiffness is looked at.
double voxel_critical(const Setup& setup, const Case& c, const Place& place, double off, double beyond = 1.6) {
  const Vec3d n = place.outward;
  return largest_stable(0.4 * c.theory(), beyond * c.theory(), 1.001, [&](double K) {
    const Rest rest(with_tangent(setup, n, K, bias_for(K)), place, bias_for(K), off);
    return settles(along(law_of(*rest.tool), n), c, rest.at(rest.depth), n, K, rest.guess);
  });
}

constexpr double kMove = 5e-6;  // [m]

/// dF/dδ [N/m] of a tool that stays where it is pressed, as `rest` leaves it, and moves to and fro there.
double felt_staying(Rest& rest) {
  const auto held = [&](double down) {
    return lead_tool(*rest.tool, rest.at(down), rest.at(down), 50).force.dot(rest.n);
  };
  static_cast<void>(held(rest.depth));
  const double in = held(rest.depth + kMove);
  return (in - held(rest.depth - kMove)) / (2 * kMove);
}

/// The coupled tool's greatest stable stiffness, stated and felt. A loop rests by the stiffness that it feels, which at
/// the border is theory's wherever the tool is pressed. The stated stiffness is felt where the contact yields as on a
/// plane. An edge yields more. Held by its shaft the tool turns too, and is felt softer by its lever. A ball without
/// friction rolls over an edge or a corner: the spring from its centre, R away from there, to the device's, r away,
/// along u, is felt as K (1 − (R/r) (1 − (n·u)²)). By the shaft and rolling the stated stiffness is not judged.
Measured coupled_critical(const Setup& setup, const Case& c, const Place& place) {
  const double analytic = analytic_critical(setup, c, place.outward);
  const double found = voxel_critical(setup, c, place, kOffShape, place.by_shaft || place.rolls ? 16 : 1.6);
  const Setup s = with_tangent(setup, place.outward, found, bias_for(found));
  const std::string name = place.name + ", " + c.text();
  Rest rest(s, place, bias_for(found), kOffShape);
  const double felt = felt_staying(rest);  // a search ends within a share of the device's motion
  const auto off = [&](double K) { return 100 * std::abs(K / analytic - 1); };
  Measured m;
  m.tell("13 K_crit by place", name, s, found, "N/m", c.theory());
  if (!place.by_shaft && (!place.rolls || setup.friction > 0))
    m.judge("13 K_crit by place off theory's", name, s, off(found), 2, "%", analytic);
  m.judge("13 stiffness felt by place at K_crit off theory's", name, s, off(felt), 2, "%", analytic);
  m.tell("13 farther in than the shape lets it", name, s, 1e3 * (rest.depth - rest.guess), "mm");
  return m;
}

Measured small_signal(const Setup& s, const Case& c, const Place& place) {
  const double analytic = analytic_critical(s, c, place.outward);
  const double found = voxel_critical(s, c, place, kOffWall);
  const std::string name = place.name + ", " + c.text();
  Measured m;
  m.tell("13 K_crit", name, s, found, "N/m", c.theory());
  m.judge("13 K_crit off the analytic wall's", name, s, 100 * std::abs(found / analytic - 1), 2, "%", analytic);
  return m;
}

const std::vector<Setup> kCoupled = {{.renderer = "coupled"}, {.renderer = "coupled", .friction = 0.3}};
const std::vector<Setup> kTools = usual_setups({{.renderer = "surface", .options = "thesis' counts"}});

}  // namespace

void plan_critical(const StabilityOptions& options, Plan& plan) {
  const bool quick = options.quick;
  const auto flat = std::make_shared<Place>(make_place("flat wall"));
  const auto tilted = std::make_shared<Place>(make_place("tilted wall"));
  std::vector<Case> cases;
  for (const double b : quick ? std::vector{0.5} : std::vector{0.05, 0.5, 5.0})
    for (const int d : {0, 1, 2}) cases.push_back({.damping = b, .delay = d});
  cases.push_back({.delay = 0, .hand = "firm"});
  if (!quick) cases.push_back({.delay = 1, .hand = "firm"});
  for (const Setup& s : kTools)
    for (const Case& c : cases)
      for (const auto& place : {flat, tilted})
        if (!quick || place == flat)
          plan.push_back({s.renderer + ", flat wall, small signal", [=] { return small_signal(s, c, *place); }});

  std::vector<Case> pressed_cases{{.damping = 0.5, .delay = 0}, {.damping = 0.5, .delay = 1}};
  if (!quick)
    pressed_cases.insert(pressed_cases.end(),
                         {{.damping = 5, .delay = 0}, {.damping = 5, .delay = 2}, {.delay = 0, .hand = "firm"}});
  const auto by_place = [pressed_cases](const Place& place) {
    Measured m;
    for (Setup s : kCoupled) {
      s.burr = place.burr;
      for (const Case& c : pressed_cases) {
        const Measured one = coupled_critical(s, c, place);
        m.rows.insert(m.rows.end(), one.rows.begin(), one.rows.end());
      }
    }
    return m;
  };
  for (const std::string& name : pressed_place_names())
    plan.push_back({"coupled, by place, small signal", [=] { return by_place(make_place(name)); }});
  for (const bool milled : {false, true})
    if (!quick || !options.skull.empty())
      plan.push_back({"coupled, scanned bone, small signal",
                      [=, skull = options.skull] { return by_place(scanned_place(skull, milled)); }});
}

}  // namespace trephine::bench
