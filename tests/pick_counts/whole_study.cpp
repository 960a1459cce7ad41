// SPDX-License-Identifier: MIT
// The whole way on a bone that is not the phantom: what is recommended holds on a second run and in a full sweep.
#include "pick_study.hpp"
#include "volumes.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <limits>

using namespace pick;
using namespace pick::test;

namespace {

// Wide limits and budget, as a busy machine measures and compilers differ: the test is that the choice holds.
constexpr double kBudget = 2000;
const Limits kLimits{.force = 0.2, .direction_deg = 25, .torque = 0.2};
const Scene kScene{.burr = kBurr, .stiffness = 800, .isovalue = kIsovalue, .max_force = 3.3, .max_torque = 0.1};
const Progress kSilent = [](const std::string&, double) {};

const Measured& measured(const Trial& trial, const Setting& setting) {
  return *std::find_if(trial.measured.begin(), trial.measured.end(),
                       [&](const auto& m) { return m.setting == setting; });
}

}  // namespace

TEST_SUITE("timed") {
  TEST_CASE("a recommendation is on the front and within the budget on a second run, and a full sweep bears it out") {
    const Grid bone = knuckle();
    const StudyOptions options{.cases = {.per_kind = 8},
                               .sweep = {.quick = true, .limits = kLimits, .repetitions = 3},
                               .budget_us = kBudget,
                               .algorithms = {Algorithm::kLine, Algorithm::kSurface}};
    const Study first = carry_out(bone, kScene, options, kSilent);
    REQUIRE(first.verdict.winner);

    // The second run times the front and what lies near it, in another order.
    SweepOptions other = options.sweep;
    other.order_seed = 99;
    other.clearly = std::numeric_limits<double>::infinity();
    std::vector<Trial> second = first.trials;
    std::vector<std::vector<Setting>> near_front(second.size());
    for (std::size_t i = 0; i < first.trials.size(); ++i)
      for (const Measured& m : first.trials[i].measured)
        if (m.front || m.repetitions > 1) near_front[i].push_back(m.setting);
    measure(second, near_front, bone, kScene, other, kSilent);

    // A full sweep's truth, at twice as many places drawn from another seed.
    SweepOptions full = options.sweep;
    full.quick = false;
    full.repetitions = 1;
    const Field field(bone, kIsovalue);
    const CaseOptions other_places{.per_kind = 16, .deepest = 3.3 / 800, .seed = 1234};

    for (std::size_t i = 0; i < first.trials.size(); ++i) {
      const std::string name = name_of(first.algorithms[i]);
      CAPTURE(name);
      REQUIRE(first.choices[i].recommended);
      const Measured& chosen = *first.choices[i].recommended;
      CAPTURE(describe(chosen.setting));
      CHECK(chosen.front);
      CHECK(chosen.worst_share <= kMargin);

      const Measured& again = measured(second[i], chosen.setting);
      CHECK(again.p999_us <= kBudget);
      CHECK(again.errors.force_p95 == chosen.errors.force_p95);  // errors do not depend on the run
      // Times do: another may be a little quicker now, but not by much.
      constexpr double kNoise = 0.7;
      for (const Measured& m : second[i].measured)
        CHECK_FALSE((m.worst_share <= again.worst_share && m.p999_us < kNoise * again.p999_us));

      std::vector<Trial> trial(1);
      trial[0].cases = make_cases(field, kBurr, first.algorithms[i], other_places);
      trial[0].truth = find_truth(first.algorithms[i], bone, trial[0].cases, kScene, full, kSilent);
      measure(trial, {{chosen.setting}}, bone, kScene, full, kSilent);
      const Measured& swept = trial[0].measured[0];
      MESSAGE(name << ": " << describe(chosen.setting) << ", share of the limits " << chosen.worst_share
                   << ", in the full sweep " << swept.worst_share << ", p99.9 " << chosen.p999_us << " us, again "
                   << again.p999_us << " us");
      CHECK(swept.errors.force_p95 <= kLimits.force);
      CHECK(swept.errors.direction_p99 <= kLimits.direction_deg);
      CHECK(swept.errors.torque_p95 <= kLimits.torque);
    }
  }

  TEST_CASE("the coupled tool is led through contacts of its own, and there is nothing to choose") {
    const Grid bone = knuckle();
    const StudyOptions options{.cases = {.per_kind = 8},
                               .sweep = {.quick = true, .limits = kLimits, .repetitions = 3},
                               .budget_us = kBudget,
                               .algorithms = {Algorithm::kCoupled}};
    const Study study = carry_out(bone, kScene, options, kSilent);
    REQUIRE(study.trials[0].measured.size() == 1);
    CHECK(study.trials[0].measured[0].worst_share == 0);  // it is its own truth
    CHECK(study.verdict.winner == 0U);
  }

  TEST_CASE("a bone that offers nothing is refused in words") {
    const Grid bone = rasterise({20, 20, 20}, trephine::Vec3d::Constant(5e-4), [](const trephine::Vec3d& p) {
      return (p - trephine::Vec3d(5e-3, 5e-3, 5e-3)).norm() - 2e-4;
    });
    const StudyOptions options{.cases = {.per_kind = 2}, .sweep = {.quick = true}};
    CHECK_THROWS_AS((void)carry_out(bone, kScene, options, kSilent), std::runtime_error);
  }
}
