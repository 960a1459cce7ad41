// SPDX-License-Identifier: MIT
#pragma once

#include "error_statistics.hpp"
#include "player.hpp"

#include <functional>

namespace pick {

/// What was measured of one setting.
struct Measured {
  Setting setting;
  Errors errors{};
  double worst_share = 0;  ///< of the limits, by the worst of the three errors
  double median_us = 0;    ///< of a tick's time
  double p999_us = 0;      ///< what is compared with the budget
  int repetitions = 0;     ///< timed; fewer for settings that others beat clearly
  bool front = false;      ///< no other setting of its algorithm is as quick and as near the truth
};

/// What the truth of one algorithm was on these cases.
struct Truth {
  Ticks ticks;
  Errors check;  ///< of the setting half as fine: how far the truth itself may be off
  std::vector<Wrenchd> wrenches;
};

struct SweepOptions {
  bool quick = false;
  Limits limits{};
  int repetitions = 5;
  /// Settings that others beat this many times in median time at no more error are timed twice only; infinite: none.
  double clearly = 1.3;
  std::uint64_t order_seed = 1;  ///< of the order in which settings are timed
};

/// Says how far a part of the work is: its name, the share done.
using Progress = std::function<void(const std::string& part, double share)>;

/// One algorithm's part of a sweep.
struct Trial {
  std::vector<Case> cases;
  Truth truth;
  std::vector<Measured> measured;
};

/// Finds the truth of the algorithm on its cases.
[[nodiscard]] Truth find_truth(Algorithm algorithm, const Bones& bones, const std::vector<Case>& cases,
                               const Scene& scene, const SweepOptions& options, const Progress& progress);

/// Measures settings (each trial's algorithm: the settings' own) against the trials' truths. The errors of a setting do
/// not depend on the run; times are the shortest of several repetitions, in each of which all settings take turns in a
/// new order, so that whatever slows the machine slows them alike. Marks the fronts.
void measure(std::vector<Trial>& trials, const std::vector<std::vector<Setting>>& settings, const Bones& bones,
             const Scene& scene, const SweepOptions& options, const Progress& progress);

}  // namespace pick
