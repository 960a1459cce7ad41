// SPDX-License-Identifier: MIT
// How smooth a slide over a ball of bone feels, for every renderer.
#include "render/coupled_helpers.hpp"
#include "support/cases.hpp"

#include <trephine/render/line/line_approx_renderer.hpp>
#include <trephine/render/surface/surface_approx_renderer.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::coupled;

constexpr unsigned kSeed = 977;
constexpr double kBoneRadius = 6e-3;

/// Rms of values less the mean of the 50 before and the 50 after.
double ripple(const std::vector<double>& values) {
  constexpr std::size_t kHalf = 50;
  double square = 0;
  for (std::size_t i = kHalf; i + kHalf < values.size(); ++i) {
    const auto first = values.begin() + static_cast<std::ptrdiff_t>(i - kHalf), last = first + 2 * kHalf + 1;
    const double off = values[i] - std::accumulate(first, last, 0.0) / (2 * kHalf + 1);
    square += off * off;
  }
  return std::sqrt(square / static_cast<double>(values.size() - 2 * kHalf));
}

/// Ripple of the force along the ball's normal [N], slid along a great circle at 30 mm/s and 1 kHz, `depth` deep [m].
template <class Renderer>
void slide(const Renderer& renderer, double radius, double depth, Figures& ripples, Figures& forces) {
  Random random(kSeed);
  for (int n = 0; n < cases(18); ++n) {
    const ImageOptions o{.size = {52, 52, 52}, .sigma = n % 3 == 0 ? 0.5 : n % 3 == 1 ? 0.7 : 1};
    const Vec3d centre = o.near_middle(random), from = random.unit(), side = from.cross(random.unit()).normalized();
    Bone bone = image(Ball{centre, kBoneRadius}, o);
    HapticScene scene{bone, kIso, renderer};
    std::vector<double> force;
    for (int i = 0; i < 700; ++i) {
      const double angle = i * 30e-6 / kBoneRadius, deep = depth * std::min(1.0, i / 100.0);
      const Vec3d out = std::cos(angle) * from + std::sin(angle) * side;
      const TickResult r = scene.tick({.X_WT = tool_at(centre + (kBoneRadius + radius - deep) * out, out)}, kDt);
      if (i >= 100) force.push_back(r.wrench.force.dot(out));
    }
    ripples.add(ripple(force));
    forces.add(std::accumulate(force.begin(), force.end(), 0.0) / static_cast<double>(force.size()));
  }
}

TEST_CASE("a slide over a ball at 1 N: ripple of every renderer") {
  CAPTURE(kSeed);
  const auto bound = [](const std::string& name, const auto& renderer, double radius, double depth, double most) {
    Figures ripples, forces;
    slide(renderer, radius, depth, ripples, forces);
    MESSAGE(name, ": ripple [N rms] ", ripples, " at ", forces.median(), " N");
    const std::string column = name == "line" ? "Line" : name == "coupled" ? "Coupled tool" : "Surface";
    if (name.find("26 ") == std::string::npos) {
      documented("ripple", "Median / " + column, 1e3 * ripples.median());
      documented("ripple", "Worst / " + column, 1e3 * ripples.worst());
    }
    CHECK(ripples.worst() <= most);
    CHECK(forces.least() >= 0.9);
    CHECK(forces.worst() <= 1.1);
  };
  // Line's force is k times the depth of the tip's point, which is the ball's centre; Surface's is 2kδ²/R on a plane.
  const double R = kDrill.tip_radius, law = std::sqrt(R / (2 * kK));
  using Line = ToolDiscretization<LineCounts, double>;
  using Surface = ToolDiscretization<SurfaceCounts, double>;
  bound("line", LineApproxRenderer{Line(kDrill, {}), LineOptions{.stiffness = kK}}, 0, 1 / kK, 0.01);
  bound("coupled", CoupledToolRenderer{kDrill, kGains}, R, 1 / kK, 0.006);
  for (const int sphere : {260, 26})
    bound("surface, " + std::to_string(sphere) + " vertices",
          SurfaceApproxRenderer{Surface(kDrill, {.sphere = sphere}), SurfaceOptions{.stiffness = kK}}, R, 1.04 * law,
          sphere < 100 ? 0.01 : 0.005);
}

}  // namespace
