// SPDX-License-Identifier: MIT
#include "pick_study.hpp"
#include "pick_text.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <stdexcept>

namespace pick {
namespace {

/// A setting in the run.
struct Runner {
  std::size_t trial;
  std::size_t place;  ///< in the trial's measurements
  std::unique_ptr<Player> player;
  std::vector<float> ns;
};

std::vector<float> no_times(const std::vector<Case>& cases) {
  return std::vector<float>(tick_count(cases), std::numeric_limits<float>::max());
}

void take_times(const std::vector<float>& ns, Measured& m) {
  const std::vector<double> times(ns.begin(), ns.end());
  m.median_us = 1e-3 * trephine::bench::percentile(times, 0.5);
  m.p999_us = 1e-3 * trephine::bench::percentile(times, 0.999);
}

constexpr int kLooks = 2;  // repetitions of all settings: what interrupts a tick seldom does so twice

/// Whether another one is no farther from the truth and so much quicker that more repetitions would not bring this one
/// onto the front. By medians, which a single run knows well.
bool is_beaten(const Measured& m, const std::vector<Measured>& all, double clearly) {
  for (const Measured& other : all)
    if (other.worst_share <= m.worst_share && clearly * other.median_us < m.median_us) return true;
  return false;
}

// Below this p99 and p95 are the worst of a handful.
constexpr int kFewestTicks = 100;

}  // namespace

Truth find_truth(Algorithm algorithm, const Grid& bone, const std::vector<Case>& cases, const Scene& scene,
                 const SweepOptions& options, const Progress& progress) {
  Truth truth;
  const std::string part = std::string("the truth, ") + name_of(algorithm);
  const auto answers = [&](const Setting& setting, double from, double to) {
    std::vector<Wrenchd> wrenches;
    const auto player = make_player(setting, scene, bone);
    // Case by case: it takes seconds, and somebody may be watching.
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const std::vector<Case> one{cases[i]};
      auto ns = no_times(one);
      player->play(one, ns, &wrenches);
      progress(part, from + (to - from) * static_cast<double>(i + 1) / static_cast<double>(cases.size()));
    }
    return wrenches;
  };
  truth.wrenches = answers(truth_setting(algorithm, options.quick), 0, 0.75);
  const auto check = answers(check_setting(algorithm, options.quick), 0.75, 1);
  truth.ticks = sort_ticks(truth.wrenches, check, options.limits, scene.max_force, scene.max_torque);
  truth.check = compare(truth.wrenches, check, truth.ticks.counts);
  return truth;
}

void measure(std::vector<Trial>& trials, const std::vector<std::vector<Setting>>& settings, const Grid& bone,
             const Scene& scene, const SweepOptions& options, const Progress& progress) {
  std::vector<Runner> entries;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    trials[t].measured.clear();
    for (const Setting& s : settings[t]) {
      entries.push_back({t, trials[t].measured.size(), make_player(s, scene, bone), no_times(trials[t].cases)});
      trials[t].measured.push_back({.setting = s});
    }
  }
  Random random(options.order_seed);
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    for (std::size_t i = entries.size(); i > 1; --i)
      std::swap(entries[i - 1], entries[static_cast<std::size_t>(random.below(static_cast<int>(i)))]);
    std::size_t done = 0;
    for (Runner& e : entries) {
      Trial& trial = trials[e.trial];
      Measured& m = trial.measured[e.place];
      std::vector<Wrenchd> wrenches;
      e.player->play(trial.cases, e.ns, repetition == 0 ? &wrenches : nullptr);
      ++m.repetitions;
      take_times(e.ns, m);
      if (repetition == 0) {
        m.errors = compare(trial.truth.wrenches, wrenches, trial.truth.ticks.counts);
        m.worst_share = options.limits.worst_share(m.errors);
      }
      const double turn = static_cast<double>(++done) / static_cast<double>(entries.size());
      progress("measuring settings", (repetition + turn) / options.repetitions);
    }
    if (repetition + 1 == kLooks)
      std::erase_if(entries, [&](const Runner& e) {
        return is_beaten(trials[e.trial].measured[e.place], trials[e.trial].measured, options.clearly);
      });
  }
  for (Trial& trial : trials) mark_front(trial.measured);
}

void mark_front(std::vector<Measured>& measured) {
  std::vector<std::size_t> order(measured.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    const Measured &x = measured[a], &y = measured[b];
    return x.p999_us != y.p999_us ? x.p999_us < y.p999_us : x.worst_share < y.worst_share;
  });
  double best = std::numeric_limits<double>::infinity();
  for (const std::size_t i : order) {
    measured[i].front = measured[i].worst_share < best;
    best = std::min(best, measured[i].worst_share);
  }
}

Choice choose(const std::vector<Measured>& measured, double budget_us) {
  if (measured.empty()) throw std::invalid_argument("choose: there are no measurements");
  Choice c{.recommended = {}, .within_limits = {}, .nearest = measured.front()};
  for (const Measured& m : measured) {
    const bool limits = m.worst_share <= kMargin;
    const bool budget = m.p999_us <= kMargin * budget_us;
    const auto quicker = [&](const std::optional<Measured>& than) {
      if (!than || m.p999_us < than->p999_us) return true;
      return m.p999_us == than->p999_us && m.worst_share < than->worst_share;
    };
    if (limits && quicker(c.within_limits)) c.within_limits = m;
    if (limits && budget && quicker(c.recommended)) c.recommended = m;
    const auto nearer = [&](const Measured& than) {
      return m.worst_share != than.worst_share ? m.worst_share < than.worst_share : m.p999_us < than.p999_us;
    };
    if (nearer(c.nearest)) c.nearest = m;
  }
  return c;
}

Verdict decide(const std::vector<Choice>& choices, double budget_us) {
  // In the order of preference: the coupled tool and Line stay on the surface and can have friction.
  std::vector<std::size_t> fit;
  for (const Algorithm a : {Algorithm::kCoupled, Algorithm::kLine, Algorithm::kSurface})
    for (std::size_t i = 0; i < choices.size(); ++i)
      if (choices[i].recommended && algorithm_of(choices[i].recommended->setting) == a) fit.push_back(i);
  std::string reason;
  for (const std::size_t i : fit) {
    const Measured& m = *choices[i].recommended;
    reason += text("%s%s %.3g us", reason.empty() ? "keep to limits and budget, the preferred first: " : ", ",
                   title_of(algorithm_of(m.setting)), m.p999_us);
  }
  if (!fit.empty()) return {fit[0], reason};
  const Measured* best = nullptr;
  for (const Choice& c : choices)
    if (c.within_limits && (!best || c.within_limits->p999_us < best->p999_us)) best = &*c.within_limits;
  reason = text("nothing keeps to the limits within %.4g us, a tenth to spare; ", budget_us);
  if (!best) return {std::nullopt, reason + "nothing that was tried keeps to the limits at any cost"};
  return {std::nullopt, reason + text("the quickest that keeps to the limits takes %.3g us: %s, %s", best->p999_us,
                                      title_of(algorithm_of(best->setting)), describe(best->setting).c_str())};
}

Study carry_out(const Grid& bone, const Scene& scene, const StudyOptions& options, const Progress& progress) {
  Study study;
  study.algorithms = options.algorithms;
  CaseOptions cases = options.cases;
  cases.deepest = scene.max_force / scene.stiffness;
  const Field field(bone, scene.isovalue);
  std::vector<std::vector<Setting>> settings;
  for (const Algorithm a : options.algorithms) {
    const std::string part = std::string("finding contacts, ") + name_of(a);
    Trial trial;
    trial.cases = make_cases(
        field, scene.burr, a, cases,
        [&](int made) { progress(part, static_cast<double>(made) / (kKinds * cases.per_kind)); }, scene.tool());
    progress(part, 1);
    trial.truth = find_truth(a, bone, trial.cases, scene, options.sweep, progress);
    if (trial.truth.ticks.used < kFewestTicks)
      throw std::runtime_error(
          text("this tool finds too few contacts on this bone (%d places, %d ticks that count); "
               "look at --isovalue, the tool's sizes and the device's limits",
               static_cast<int>(trial.cases.size()), trial.truth.ticks.used));
    study.trials.push_back(std::move(trial));
    settings.push_back(settings_to_try(a, options.sweep.quick));
  }
  measure(study.trials, settings, bone, scene, options.sweep, progress);
  for (const Trial& t : study.trials) study.choices.push_back(choose(t.measured, options.budget_us));
  study.verdict = decide(study.choices, options.budget_us);
  return study;
}

}  // namespace pick
