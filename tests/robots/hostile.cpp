// SPDX-License-Identifier: MIT
// A million hostile ticks of a simulated robot with a noisy force sensor take nothing of a nerve.
#include "drill_cell.hpp"
#include "hostile_hand.hpp"
#include "robot.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <iostream>

using namespace robots;
using namespace robots::test;

namespace {

struct Outcome {
  double taken_mm3 = 0;    // of the nerve
  double removed_mm3 = 0;  // of bone
  double least = 1;        // distance of the moving tool from the nerve, by the field [m]
  double least_true = 1;   // the same from the nerve's formula, by samples of the tool's axis [m]
  double least_command = 1;
  double trail = 0;  // largest distance of a point of the tool from its command [m]
  int limited = 0;   // ticks
};

/// The least distance of the tool from the nerve's formula.
double true_distance(const Posed& X_WT) {
  double least = nerve_distance(X_WT.translation()) - burr().tip_radius;
  for (int n = 0; n <= 250; ++n)
    least = std::min(least, nerve_distance(X_WT * Vec3d(0, 0, burr().shaft_length * n / 250)) - burr().shaft_radius);
  return least;
}

Outcome rage(bool has_barrier, unsigned seed, int ticks) {
  CellOptions options;
  options.has_barrier = has_barrier;
  options.veto = {.mode = StructureVeto::Mode::kWatch};  // no veto helps, and what is taken is counted
  DrillCell cell(options);
  RobotOptions robot_options;
  robot_options.seed = seed;
  SimulatedRobot robot(DrillCell::start(), robot_options);
  HostileHand hand(seed);
  Outcome out;
  for (int tick = 0; tick < ticks; ++tick) {
    const Report report = robot.advance(hand.push(robot.X_WT(), 1e-3 * tick), true, 1e-3);
    const Command command = cell.tick(report, 1e-3);
    robot.command(command);
    const double distance = cell.barrier().distance(robot.X_WT()).distance;
    if (distance < out.least || tick % 100 == 0) out.least_true = std::min(out.least_true, true_distance(robot.X_WT()));
    out.least = std::min(out.least, distance);
    out.trail = std::max(out.trail, largest_displacement(burr(), cell.X_WT(), robot.X_WT()));
    if (has_barrier) out.least_command = std::min(out.least_command, command.distance);
    out.limited += command.limited;
  }
  out.taken_mm3 = cell.floor().taken_mm3(0);
  out.removed_mm3 = cell.removed_mm3();
  return out;
}

}  // namespace

TEST_CASE("A million hostile ticks take nothing of the nerve, and the tool keeps its margin") {
  const MotionBarrierOptions barrier;
  const double clearance = DrillCell().barrier().clearance();
  for (const unsigned seed : {1U, 2U, 3U, 4U}) {
    CAPTURE(seed);
    const Outcome out = rage(true, seed, 250'000);
    std::cout << "seed " << seed << ": nearest " << 1e3 * out.least << " mm (true " << 1e3 * out.least_true
              << ", command " << 1e3 * out.least_command << " of " << 1e3 * clearance << "), trails by "
              << 1e3 * out.trail << " mm, limited in " << out.limited << " ticks, " << out.removed_mm3
              << " mm3 of bone removed\n";
    CHECK(out.taken_mm3 == 0);
    CHECK(out.least_command >= clearance);
    CHECK(out.least >= barrier.margin);
    CHECK(out.least_true >= barrier.margin - 0.26 * 0.4e-3);  // the field's own error, in voxels of the labels
    CHECK(out.trail <= barrier.speed * barrier.lag);          // what the bound asks of the robot
    CHECK(out.limited > 25'000);                              // the hand was hostile
    CHECK(out.removed_mm3 > 100);
  }
}

TEST_CASE("Without the barrier the same hand drills the nerve") {
  const Outcome out = rage(false, 1, 25'000);
  std::cout << "without the barrier: " << out.taken_mm3 << " mm3 of the nerve removed\n";
  CHECK(out.taken_mm3 > 1);
  CHECK(out.least < 0);
}
