// SPDX-License-Identifier: MIT
#include "support/figures.hpp"
#include "support/near.hpp"

#include <trephine/render/coupled/gains.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;

struct Setup {
  double tip_radius, stiffness, force;
  Vec3d spacing;

  [[nodiscard]] Burr burr() const {
    return {.tip_radius = tip_radius, .shaft_radius = tip_radius / 2, .shaft_length = 0.04};
  }
  [[nodiscard]] CoupledOptions options() const { return {.stiffness = stiffness, .force = force}; }
  /// What contact resolves: a voxel, or a fifteenth of the radius where voxels are finer.
  [[nodiscard]] double resolved() const { return std::max(spacing.minCoeff(), tip_radius / 15); }
  /// Longest side of an element. At level 0 it is the longest spacing over the parts that elements are cut into, none
  /// longer than half as much again as they are wide; then the side of a cell, which doubles with each level.
  [[nodiscard]] double longest_part(int level) const {
    if (level > 0) return std::ldexp(spacing.minCoeff(), level - 1);
    double longest = 0;
    for (const double h : spacing) longest = std::max(longest, h / std::round(h / spacing.minCoeff()));
    return longest;
  }
  [[nodiscard]] CoupledGains gains() const { return CoupledGains::derive(burr(), options(), spacing); }
};
// The default, a weak device, a small burr, a large burr, fine and long voxels, soft and hard coupling.
const std::vector<Setup> kSetups{{1.5e-3, 800, 8.5, {3e-4, 3e-4, 3e-4}},   {1.5e-3, 800, 1, {3e-4, 3e-4, 3e-4}},
                                 {3e-4, 800, 3.3, {3e-4, 3e-4, 3e-4}},     {6e-3, 800, 3.3, {3e-4, 3e-4, 3e-4}},
                                 {3e-3, 800, 3.3, {5e-5, 5e-5, 5e-5}},     {3e-3, 800, 3.3, {3e-5, 4e-5, 4e-5}},
                                 {1.5e-3, 800, 3.3, {1e-4, 1e-4, 1e-4}},   {1.5e-3, 800, 3.3, {2e-4, 2e-4, 4e-4}},
                                 {1.5e-3, 800, 3.3, {2e-4, 2e-4, 2.9e-4}}, {1.5e-3, 200, 3.3, {3e-4, 3e-4, 3e-4}},
                                 {1.5e-3, 3000, 8.5, {3e-4, 3e-4, 3e-4}}};

/// Force of the law's pressure on a ball whose lowest point is `sink` [m] below a plane, by quadrature over rings.
double pressure_force(const FoundationLaw& law, double R, double sink) {
  constexpr int kRings = 1000;
  const double rim = std::sqrt(std::max(0.0, 2 * R * (sink + law.offset)));
  double force = 0;
  for (int i = 0; i < kRings; ++i) {
    // A point of the plane at the distance r from the axis is ψ deep in the ball, which pushes along its own normal.
    const double r = rim * (i + 0.5) / kRings, to_centre = std::hypot(r, R - sink), depth = R - to_centre;
    const double u = std::max(depth + law.offset, 0.0), v = std::max(u - law.ramp, 0.0);
    const double pressure = law.stiffness * (u * u - v * v) / (2 * law.ramp);
    force += pressure * (R - sink) / to_centre * 2 * std::numbers::pi * r * rim / kRings;
  }
  return force;
}

TEST_CASE("gains: contact and coupling in series are felt with the stated stiffness, from the surface on") {
  // The closed form takes the offset for small against R: they are 1.3 % apart at most, and the spring has most of the
  // compliance.
  constexpr double kSecant = 0.002;
  Figures secant, sink_voxels;
  for (const Setup& s : kSetups) {
    CAPTURE(s.tip_radius);
    CAPTURE(s.stiffness);
    const CoupledGains g = s.gains();
    const double R = s.tip_radius, h = s.resolved();
    for (const double share : {0.1, 0.3, 0.6, 0.99}) {
      // Equilibrium of a device pressed by `deep` below the plane: the coupling's force is the pressure's.
      const double deep = share * s.force / s.stiffness;
      double low = -g.law.offset, high = std::min(deep, R / 2);
      for (int i = 0; i < 60; ++i) {
        const double sink = (low + high) / 2;
        const double coupling = g.coupling.translation_spring.evaluate(deep - sink).magnitude;
        (pressure_force(g.law, R, sink) < coupling ? low : high) = sink;
      }
      secant.add(std::abs(pressure_force(g.law, R, low) / (s.stiffness * deep) - 1));
      sink_voxels.add(low / h);
    }
    CHECK(g.coupling.translation_spring.max_force() == near(s.force));
    CHECK(g.coupling.rotation_spring.limit == s.options().torque);
  }
  MESSAGE("secant stiffness off by ", secant, "; virtual tool sinks in by ", sink_voxels, " of what contact resolves");
  CHECK(secant.worst() <= kSecant);
  CHECK(sink_voxels.worst() <= CoupledConstants::kMaxYield);
}

// An element has kMaxSide points a side at most: a burr with a radius of one voxel would need six, and gets four.
TEST_CASE("gains: a footprint at the largest force has three points or more along its radius, or all that fit") {
  Figures points, crossings, bounded;
  for (const Setup& s : kSetups) {
    CAPTURE(s.tip_radius);
    const CoupledGains g = s.gains();
    const double h = s.resolved(), R = s.tip_radius;
    // The depth at which the law bears the largest force.
    double low = 0, high = R / 2;
    for (int i = 0; i < 60; ++i) {
      const double middle = (low + high) / 2;
      (pressure_force(g.law, R, middle - g.law.offset) < s.force ? low : high) = middle;
    }
    const double footprint = std::sqrt(2 * R * low);
    const bool fits = s.tip_radius > h * (1 + 1e-9);
    (g.level > 0 ? crossings
     : fits      ? points
                 : bounded)
        .add(footprint / (s.longest_part(g.level) / static_cast<double>(g.points_per_side)));
    CHECK((g.points_per_side < Foundation::kMaxSide || !fits));
    CHECK(footprint <= 1.01 * CoupledConstants::kFootprint * h);
    CHECK(low <= 1.02 * std::min(h / 3, R / 4));
    // Depth slopes by footprint / R at the rim, over a cell of half a voxel.
    CHECK(g.law.ramp == near(0.5 * h * footprint / R, 0.01));
    CHECK(g.law.offset > 0);
    CHECK(g.law.offset < g.law.ramp);
  }
  MESSAGE("points along a footprint's radius: ", points, ", least ", points.least(), "; burr of one voxel: ", bounded,
          "; crossings ", crossings, ", least ", crossings.least());
  CHECK(points.least() >= 3);
  CHECK(crossings.least() >= 2);
  REQUIRE(bounded.count() == 1);
  CHECK(bounded.least() >= 2.8);
}

// A ball's surface in voxels of diagonal h is a polyhedron whose faces sag below it by h² / 24R on average. Along a
// long voxel of length h a chord sags by h² / 12R on average, which counts by as much as the voxel is longer.
TEST_CASE("gains: the cutting burr is larger by the contact's offset and the chords' sag, and by nothing else") {
  for (const Setup& s : kSetups) {
    const CoupledGains g = s.gains();
    double sag = 0, voxels = 0;
    for (const double h : s.spacing) {
      const double longer = 1 - s.spacing.minCoeff() / h;
      sag += h * h * (longer / 12 + (1 - longer) / 24) / s.tip_radius;
      voxels += h * h;
    }
    // Points at crossings sag by less, and those joined by half the mean square of their distances: that of a square's
    // points is its side's over 6, and of n points over 6 less by the square of their spacing.
    if (g.level > 0) {
      double cells = 0;
      for (double side : s.spacing) {
        while (2 * side <= s.longest_part(g.level) * (1 + 1e-9)) side *= 2;
        cells += side * side;
      }
      sag = (voxels / 54 + (cells - voxels) / 36) / s.tip_radius;
    }
    CHECK(g.cut_allowance == near(g.law.offset + sag));
  }
}

TEST_CASE("coupled gains: a force far below the stiffness keeps points per element within their bound") {
  for (const double force : {1e-6, 1e-12, 1e-30, 1e-200}) {
    const CoupledOptions options{.stiffness = 1e5, .force = force};
    const CoupledGains g = CoupledGains::derive(Burr{}, options, Vec3d::Constant(3e-4));
    CAPTURE(force);
    CHECK(g.points_per_side >= 1);
    CHECK(g.points_per_side <= Foundation::kMaxSide);
  }
}

}  // namespace
