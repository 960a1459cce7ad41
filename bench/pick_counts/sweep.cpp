// SPDX-License-Identifier: MIT
#include "sweep.hpp"

#include "front.hpp"
#include "random.hpp"

#include <limits>

namespace pick {
namespace {

/// A setting in the run.
struct Runner {
  std::size_t trial;
  std::size_t place;  ///< in the trial's measurements
  std::unique_ptr<Player> player;
  std::vector<float> ns;
  double work;  ///< about proportional to the time of a run
};

std::vector<float> no_times(const std::vector<Case>& cases) {
  return std::vector<float>(tick_count(cases), std::numeric_limits<float>::max());
}

void take_times(const std::vector<float>& ns, Measured& m) {
  const std::vector<double> times(ns.begin(), ns.end());
  m.median_us = 1e-3 * quantile(times, 0.5);
  m.p999_us = 1e-3 * quantile(times, 0.999);
}

/// Of a tick, for the estimate of the time left: a constant part and one for each vertex.
double work_of(const Setting& setting) {
  if (const auto* l = std::get_if<LineSetting>(&setting)) return 100 + 1.2 * l->vertices;
  if (std::holds_alternative<CoupledSetting>(setting)) return 500;
  const auto& s = std::get<SurfaceSetting>(setting);
  return (s.patches ? 2.0 : 1.0) * (100 + s.sphere + s.slices * (1 + s.per_slice));
}

constexpr int kLooks = 2;      // repetitions of all settings: what interrupts a tick seldom does so twice
constexpr double kStay = 0.3;  // share of the work that stays after them, usually

/// Whether another one is no farther from the truth and so much quicker that more repetitions would not bring this one
/// onto the front. By medians, which a single run knows well.
bool is_beaten(const Measured& m, const std::vector<Measured>& all, double clearly) {
  for (const Measured& other : all)
    if (other.worst_share <= m.worst_share && clearly * other.median_us < m.median_us) return true;
  return false;
}

}  // namespace

Truth find_truth(Algorithm algorithm, const Bones& bones, const std::vector<Case>& cases, const Scene& scene,
                 const SweepOptions& options, const Progress& progress) {
  Truth truth;
  const std::string part = std::string("the truth, ") + name_of(algorithm);
  const auto answers = [&](const Setting& setting, double from, double to) {
    std::vector<Wrenchd> wrenches;
    const auto player = make_player(setting, scene, bones);
    // Case by case: it takes seconds, and somebody may be watching.
    for (std::size_t i = 0; i < cases.size(); ++i) {
      const std::vector<Case> one{cases[i]};
      auto ns = no_times(one);
      player->play(bones, one, ns, &wrenches);
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

void measure(std::vector<Trial>& trials, const std::vector<std::vector<Setting>>& settings, const Bones& bones,
             const Scene& scene, const SweepOptions& options, const Progress& progress) {
  std::vector<Runner> entries;
  for (std::size_t t = 0; t < trials.size(); ++t) {
    trials[t].measured.clear();
    for (const Setting& s : settings[t]) {
      entries.push_back({t, trials[t].measured.size(), make_player(s, scene, bones), no_times(trials[t].cases),
                         work_of(s) * static_cast<double>(tick_count(trials[t].cases))});
      trials[t].measured.push_back({.setting = s});
    }
  }
  Random random(options.order_seed);
  double done = 0;
  for (int repetition = 0; repetition < options.repetitions; ++repetition) {
    random.shuffle(entries);
    double round = 0;
    for (const Runner& e : entries) round += e.work;
    // How many settings stay is not known before they have all been looked at.
    const int looks = std::max(0, std::min(kLooks, options.repetitions) - 1 - repetition);
    const int later = options.repetitions - 1 - repetition - looks;
    const double end = done + round * (1 + looks + (repetition < kLooks ? kStay : 1.0) * later);
    for (Runner& e : entries) {
      Trial& trial = trials[e.trial];
      Measured& m = trial.measured[e.place];
      std::vector<Wrenchd> wrenches;
      e.player->play(bones, trial.cases, e.ns, repetition == 0 ? &wrenches : nullptr);
      ++m.repetitions;
      take_times(e.ns, m);
      if (repetition == 0) {
        m.errors = compare(trial.truth.wrenches, wrenches, trial.truth.ticks.counts);
        m.worst_share = options.limits.worst_share(m.errors);
      }
      done += e.work;
      progress("measuring settings", done / end);
    }
    if (repetition + 1 == kLooks)
      std::erase_if(entries, [&](const Runner& e) {
        return is_beaten(trials[e.trial].measured[e.place], trials[e.trial].measured, options.clearly);
      });
  }
  for (Trial& trial : trials) mark_front(trial.measured);
}

}  // namespace pick
