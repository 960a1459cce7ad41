// SPDX-License-Identifier: MIT
#pragma once

#include "pick_study.hpp"

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace pick {

/// A wrong argument, in one line.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The command line. SI units but for the budget; unset lengths are chosen to fit the volume.
struct Options {
  bool help = false;
  std::string skull, ct, series;  ///< none of them: the built-in tooth
  std::optional<double> isovalue;
  bool largest_piece = false;
  std::string tool;                                              ///< as `trephine::tool_by_name`; empty: a burr
  std::optional<double> tip_radius, shaft_radius, shaft_length;  ///< [m]
  std::string device;                                            ///< as `trephine::device_preset`; empty: none
  std::optional<double> stiffness;                               ///< [N/m]
  std::optional<double> max_force;                               ///< [N]
  std::optional<double> max_torque;                              ///< [N·m]
  std::optional<double> budget_us;
  std::optional<double> rate_Hz;
  Limits limits{};
  std::vector<Algorithm> algorithms{kAlgorithms.begin(), kAlgorithms.end()};
  bool quick = false;
  unsigned seed = 1;
  std::string out = "build/report/pick_counts";

  /// Of a tick [µs]. Of a period at the given rate half is left to device, other stages and the system.
  [[nodiscard]] double budget() const { return rate_Hz ? 0.5e6 / *rate_Hz : budget_us.value_or(50); }
};

/// Throws UsageError with one clear line.
[[nodiscard]] Options parse_options(int argc, const char* const* argv);
/// What --help prints.
[[nodiscard]] std::string usage();

}  // namespace pick
