// SPDX-License-Identifier: MIT
#pragma once

#include <cmath>
#include <ostream>

/// What a number is compared with: doctest's own comparison adds one to the size it takes shares of, under which
/// milliseconds and micrometres are all alike, so a source rule keeps it out.
namespace trephine::test {

/// Equal to what differs from `expected` by at most `tolerance`; a NaN equals nothing.
struct Within {
  double expected;
  double tolerance;
};

inline bool operator==(double actual, const Within& w) { return std::abs(actual - w.expected) <= w.tolerance; }

inline std::ostream& operator<<(std::ostream& out, const Within& w) {
  return out << w.expected << " within " << w.tolerance;
}

/// By absolute difference, in the number's own unit.
inline Within within(double expected, double tolerance) { return {expected, tolerance}; }

/// By a share of the expected number's size. Near zero there is only zero: say `within`.
inline Within near(double expected, double share = 1e-9) { return {expected, share * std::abs(expected)}; }

}  // namespace trephine::test
