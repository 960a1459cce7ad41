// SPDX-License-Identifier: MIT
#pragma once

#include "case_maker.hpp"
#include "front.hpp"

#include <string>

namespace pick {

/// A whole study of one bone: places, truth, measurements, choice.
struct StudyOptions {
  CaseOptions cases{};
  SweepOptions sweep{};
  double budget_us = 50;
  std::vector<Algorithm> algorithms{kAlgorithms.begin(), kAlgorithms.end()};
};

struct Study {
  std::vector<Algorithm> algorithms;
  std::vector<Trial> trials;    ///< one for each algorithm
  std::vector<Choice> choices;  ///< likewise
  Verdict verdict;
  int holes = 0;
};

/// `milled` is a copy of `whole` of its own; holes are milled into it. Throws std::runtime_error where the bone offers
/// too few contacts to say anything.
[[nodiscard]] Study carry_out(const Grid& whole, Grid& milled, const Scene& scene, const StudyOptions& options,
                              const Progress& progress);

}  // namespace pick
