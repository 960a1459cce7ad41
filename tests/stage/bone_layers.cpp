// SPDX-License-Identifier: MIT
// Vibration through layers of bone, by which a hand tells where its burr is.
#include "pushed_cut.hpp"
#include "support/cases.hpp"
#include "support/spectrum.hpp"

#include <trephine/stage/cutting_vibration.hpp>

#include <doctest/doctest.h>

#include <array>
#include <string>
#include <vector>

namespace {

using namespace trephine;
using namespace trephine::test;
using namespace trephine::test::cutting;

constexpr unsigned kSeed = 1154;
constexpr double kRate = 10e3;

/// Amplitudes of the torque on the hand at .5, 1 and 1.5 kHz [N·m], over the next 0.2 s.
template <class Cut>
std::array<double, 3> lines_now(Cut& cut) {
  std::vector<double> torque;
  for (int i = 0; i < 2048; ++i) torque.push_back(cut.tick(1 / kRate).wrench.torque.dot(cut.up()));
  const Spectrum s(torque);
  return {s.at(500 / kRate), s.at(1000 / kRate), s.at(1500 / kRate)};
}

TEST_CASE("layers of bone: at .5, 1 and 1.5 kHz the far cortex shakes more than cancellous bone, and air not at all") {
  // Porcine laminae under a blade of 2 mm (Eur J Med Res 2023, doi 10.1186/s40001-023-01154-y) are told apart at these
  // frequencies. Two edges at 30 000 rpm that run out of true have a line at each: the spindle's, the teeth's, and one
  // beside it.
  CAPTURE(kSeed);
  Random random(kSeed);
  std::array<double, 3> least{1e9, 1e9, 1e9};
  for (int run = 0; run < cases(5); ++run) {
    constexpr double near_cortex = 1e-3, cancellous = 3e-3, far_cortex = 2e-3;
    const Vec3d up = (Vec3d::UnitZ() + random.arrow(0, 0.3)).normalized();
    const double spongy = random.uniform(450, 750), force = random.uniform(3, 6), fastest = random.uniform(1e-3, 2e-3);
    const LayeredBone layers{.layers = {{near_cortex, 1700}, {cancellous, spongy}, {far_cortex, 1700}},
                             .up = up,
                             .offset = random.arrow(0, 3e-4)};
    CAPTURE(spongy);
    CAPTURE(force);
    CAPTURE(fastest);
    const CuttingForce law({.edges = {.flutes = 2}, .speed = rpm(30e3)});
    PushedCut cut(layers, long_round(1e-3), CuttingVibration{law, {.pattern = {.runout = 0.2}}},
                  {.force = force, .fastest = fastest});
    // Where the head's whole front is in a layer, and beyond them all.
    cut.go(near_cortex + 2e-3);
    const auto in_cancellous = lines_now(cut);
    cut.go(near_cortex + cancellous + 1.2e-3);
    const auto in_far_cortex = lines_now(cut);
    cut.go(near_cortex + cancellous + far_cortex + 1.5e-3);
    const auto in_air = lines_now(cut);
    CHECK(cut.status() == Status::kOk);
    for (std::size_t i = 0; i < 3; ++i) {
      CAPTURE(500 * (i + 1));
      CHECK(in_far_cortex[i] > 3 * in_cancellous[i]);  // 4.9 and more, measured
      CHECK(in_cancellous[i] > 1e-5);
      CHECK(in_air[i] < 1e-6 * in_cancellous[i]);
      least[i] = std::min(least[i], in_far_cortex[i] / in_cancellous[i]);
    }
    MESSAGE("spongy ", spongy, " HU, ", force, " N, ", 1e3 * fastest,
            " mm/s: N mm at .5, 1, 1.5 kHz: ", 1e3 * in_cancellous[0], " ", 1e3 * in_cancellous[1], " ",
            1e3 * in_cancellous[2], "; far cortex ", 1e3 * in_far_cortex[0], " ", 1e3 * in_far_cortex[1], " ",
            1e3 * in_far_cortex[2], "; air ", 1e3 * in_air[1]);
  }
  MESSAGE("far cortex by cancellous at least: ", least[0], ", ", least[1], ", ", least[2]);
}

TEST_CASE("layers of bone: under a set force, however fast the feed, weak bone takes thicker chips and more torque") {
  // So the order of the layers is that of a hand or robot whose speed is bounded.
  const CuttingForce::Options o{.edges = {.flutes = 2}, .speed = rpm(30e3)};
  const HeadElements head(long_round(1e-3).cutting_head(0).outline);
  const auto torque = [&](double strength) {
    HeadElements::Numbers whole, strong;
    whole.fill(1);
    strong.fill(static_cast<float>(strength));
    const Engagement on = engagement_of(head, -Vec3d::UnitZ(), whole, strong);
    return o.law.torque(o.law.feed_under(5, on, o.edges, 1e-3), on, o.edges);
  };
  MESSAGE("torque in bone of an eighth by that in cortical bone, both under 5 N: ", torque(0.125) / torque(1));
  CHECK(torque(0.125) > 1.1 * torque(1));
}

}  // namespace
