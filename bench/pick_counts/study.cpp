// SPDX-License-Identifier: MIT
#include "study.hpp"

#include "text.hpp"

#include <stdexcept>

namespace pick {
namespace {

// Below this p99 and p95 are the worst of a handful.
constexpr int kFewestTicks = 100;

}  // namespace

Study carry_out(const Grid& whole, Grid& milled, const Scene& scene, const StudyOptions& options,
                const Progress& progress) {
  Study study;
  study.algorithms = options.algorithms;
  CaseOptions cases = options.cases;
  cases.deepest = scene.max_force / scene.stiffness;
  progress("milling holes", 0);
  const CaseMaker maker(whole, milled, scene.isovalue, scene.burr, cases);
  study.holes = maker.holes();
  const Bones bones{&whole, &milled, scene.isovalue};
  std::vector<std::vector<Setting>> settings;
  for (const Algorithm a : options.algorithms) {
    const std::string part = std::string("finding contacts, ") + name_of(a);
    Trial trial;
    trial.cases =
        maker.make(a, [&](int made) { progress(part, static_cast<double>(made) / (kKinds * cases.per_kind)); });
    progress(part, 1);
    trial.truth = find_truth(a, bones, trial.cases, scene, options.sweep, progress);
    if (trial.truth.ticks.used < kFewestTicks)
      throw std::runtime_error(
          text("this tool finds too few contacts on this bone (%d places, %d ticks that count); "
               "look at --isovalue, the tool's sizes and the device's limits",
               static_cast<int>(trial.cases.size()), trial.truth.ticks.used));
    study.trials.push_back(std::move(trial));
    settings.push_back(settings_to_try(a, options.sweep.quick));
  }
  measure(study.trials, settings, bones, scene, options.sweep, progress);
  for (const Trial& t : study.trials) study.choices.push_back(choose(t.measured, options.budget_us));
  study.verdict = decide(study.choices, options.budget_us);
  return study;
}

}  // namespace pick
