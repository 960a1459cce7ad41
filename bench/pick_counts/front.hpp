// SPDX-License-Identifier: MIT
#pragma once

#include "sweep.hpp"

#include <optional>
#include <string>

namespace pick {

/// Marks those that no other one equals or beats in both time (p999_us) and error (worst_share) while being better in
/// one; of equals the first.
void mark_front(std::vector<Measured>& measured);

/// Other places on the bone and another hour give slightly other figures, so a choice keeps to this share of limits
/// and budget.
inline constexpr double kMargin = 0.9;

/// What is made of one algorithm's measurements.
struct Choice {
  /// The quickest that keeps to the limits and the budget.
  std::optional<Measured> recommended;
  /// Without one: the quickest that keeps to the limits, whatever it costs; and the nearest to the truth.
  std::optional<Measured> within_limits;
  Measured nearest;
  /// The nearest to the truth that keeps to the budget.
  std::optional<Measured> within_budget;
};

/// `budget_us`: of a tick's p99.9. Throws std::invalid_argument for no measurements.
[[nodiscard]] Choice choose(const std::vector<Measured>& measured, double budget_us);

/// Which of them, and why, in a sentence. Indices into `choices`; none where nothing is recommended.
struct Verdict {
  std::optional<std::size_t> winner;
  std::string reason;
};
[[nodiscard]] Verdict decide(const std::vector<Choice>& choices, double budget_us);

}  // namespace pick
