// SPDX-License-Identifier: MIT
// Scenario 21: net work on random closed paths, which start and end out of contact.
#include "stability/measured.hpp"
#include "stability/places.hpp"
#include "support/path_work.hpp"

#include <cmath>

namespace trephine::bench {
namespace {

using test::Random;

struct Path {
  Posed start;
  Vec3d in;  // way into contact at the middle [m]
  Vec3d move[3], turn[2];
  /// t in [0, 1]: out of contact at both ends.
  [[nodiscard]] Posed at(double t) const {
    const double phase = 6.283185307179586 * t, s = std::sin(phase), c = 1 - std::cos(phase), s2 = std::sin(2 * phase);
    const Vec3d w = s * turn[0] + 0.5 * s2 * turn[1];
    return make_pose<double>(rotation_from_vector<double>(w) * start.linear(),
                             start.translation() + 0.5 * c * in + s * move[0] + s2 * move[1] + 0.5 * c * move[2]);
  }
};

test::PathWork round(AnyTool& tool, const Path& path, int steps) {
  tool.reset();
  test::PathWork work(path.at(0), tool.tick({path.at(0), false}, 1e-3).wrench);
  for (int i = 1; i <= steps; ++i) {
    const Posed X = path.at(static_cast<double>(i) / steps);
    work.go(X, tool.tick({X, false}, 1e-3).wrench);
  }
  return work;
}

struct Total {
  double mean = 0, worst = 0, gain = 0, gained = 0, jump = 0;
  double gained_by_tip = 0, gained_by_shaft = 0;
  int paths = 0, converged = 0;
};
Total all(const Setup& s, int count, bool rough) {
  // A ball of bone, no direction special; the tool comes from anywhere, tip or shaft first.
  constexpr double kBone = 6e-3;
  static const std::shared_ptr<Bone> bone = make_bone(test::Ball{Vec3d(5e-5, -3e-5, 8e-5), kBone}, 56);
  auto tool = make_tool(s, *bone, kPlaceIsovalue);
  Random random(21);
  Total total;
  for (int i = 0; i < count; ++i) {
    const Vec3d n = random.unit();
    const bool shaft = i % 3 == 2;
    const double reach = shaft ? s.burr.shaft_radius : s.burr.tip_radius;
    const double own = s.renderer == "line" ? 0 : reach;
    Path p;
    const Vec3d axis = shaft ? n.unitOrthogonal() : (n + 0.6 * random.unit()).normalized();
    const double depth = random.uniform(0.15, i % 3 == 1 ? 1.6 : 0.7) * reach;
    p.start = tool_pose((kBone + own + 1.2e-3) * n - (shaft ? 6e-3 : 0.0) * axis, axis);
    p.in = -(1.2e-3 + depth) * n;
    for (auto& m : p.move) {
      const Vec3d u = random.unit();
      m = random.uniform(0.3, 1) * 5e-4 * (u - u.dot(n) * n);
    }
    for (auto& t : p.turn) t = 0.05 * random.arrow(0.2, 1);
    // Halved until the work no longer changes by 1e-5 of the path's, twice running, for it may do so by chance; laws
    // that jump never get there, and need not.
    int steps = 500, still = 0;
    test::PathWork w = round(*tool, p, steps);
    const int most = rough ? 1000 : 4000;
    while (steps < most && still < 2) {
      steps *= 2;
      const test::PathWork finer = round(*tool, p, steps);
      const double change = std::abs(finer.net - w.net) / std::max(finer.length, 1e-12);
      still = change <= 1e-5 ? still + 1 : 0;
      w = finer;
      if (still == 0 && std::abs(finer.net) > 1e-3 * finer.length) break;  // plain enough
    }
    if (!(w.length > 1e-7)) continue;
    const double ratio = w.net / w.length;
    ++total.paths;
    total.converged += still == 2;
    total.mean += std::abs(ratio);
    total.gain += ratio;
    total.worst = std::max(total.worst, std::abs(ratio));
    total.gained = std::max(total.gained, ratio);
    double& by_part = shaft ? total.gained_by_shaft : total.gained_by_tip;
    by_part = std::max(by_part, ratio);
    total.jump = std::max(total.jump, w.jump);
  }
  total.mean /= std::max(1, total.paths);
  total.gain /= std::max(1, total.paths);
  return total;
}

Measured measured(const Setup& s, bool main, bool quick) {
  const Total t = all(s, quick ? 30 : main ? 1000 : 200, !main || quick);
  const std::string c = std::to_string(t.paths) + " paths, " + std::to_string(t.converged) + " converged";
  Measured m;
  if (s.friction > 0) {
    m.judge("21 closed paths: most net work gained", c, s, 100 * t.gained, 0.01, "%", 100 * t.gain);
  } else {
    m.judge("21 closed paths: worst net work", c, s, 100 * t.worst, 0.01, "%");
    m.tell("21 closed paths: mean net work", c, s, 100 * t.mean, "%", 100 * t.gain);
  }
  m.tell("21 closed paths: most net work gained, tip first", c, s, 100 * t.gained_by_tip, "%");
  m.tell("21 closed paths: most net work gained, shaft first", c, s, 100 * t.gained_by_shaft, "%");
  m.tell("21 closed paths: greatest force step", c, s, t.jump, "N");
  return m;
}

}  // namespace

void plan_closed_paths(const StabilityOptions& options, Plan& plan) {
  constexpr StiffnessBudget kBudget{800, 0.3};
  std::vector<Setup> setups = usual_setups({{.renderer = "line", .friction = 0.3},
                                            {.renderer = "line", .options = "thesis", .friction = 0.3},
                                            {.renderer = "line", .budget = kBudget},
                                            {.renderer = "surface", .budget = kBudget}});
  const std::size_t main = setups.size();  // the others: fewer paths
  setups.push_back({.renderer = "surface", .options = "thesis' counts"});
  for (std::size_t i = 0; i < setups.size(); ++i) {
    setups[i].burr.shaft_length = 12e-3;
    plan.push_back({setups[i].renderer + ", closed paths", [s = setups[i], is_main = i < main, quick = options.quick] {
                      return measured(s, is_main, quick);
                    }});
  }
}

}  // namespace trephine::bench
