// SPDX-License-Identifier: MIT
#pragma once

#include <functional>
#include <string>
#include <vector>

/// The table that everything here ends in, and the work that fills it on all cores in a fixed order.
namespace trephine::bench {

struct StabilityRow {
  std::string scenario, name, renderer, options;
  double measured = 0, reference = 0;  ///< NaN where there is none
  std::string unit;
  double limit = 0;  ///< NaN: reported, not judged
  bool pass = true;
};

/// `measured` must be at most `limit`.
[[nodiscard]] StabilityRow at_most(const std::string& scenario, const std::string& name, const std::string& renderer,
                                   const std::string& options, double measured, double limit, const std::string& unit,
                                   double reference);
/// Reported without a limit.
[[nodiscard]] StabilityRow told(const std::string& scenario, const std::string& name, const std::string& renderer,
                                const std::string& options, double measured, const std::string& unit, double reference);

struct StabilityOptions {
  std::string folder;
  std::string skull{};  ///< folder with the skull's CT; empty: the phantom alone
  bool quick = false;
};

/// One measurement: rows, and lines of further tables by file name.
struct Measured {
  std::vector<StabilityRow> rows;
  std::vector<std::pair<std::string, std::string>> lines;
};
struct Work {
  std::string name;
  std::function<Measured()> run;
};
using Plan = std::vector<Work>;

void plan_critical(const StabilityOptions& options, Plan& plan);      // 13: flat wall, theory, stability plane
void plan_places(const StabilityOptions& options, Plan& plan);        // 14 to 16: shapes in the loop
void plan_sweep(const StabilityOptions& options, Plan& plan);         // 10² to 10⁶ N/m, every place and factor
void plan_thin_walls(const StabilityOptions& options, Plan& plan);    // 17
void plan_jumps(const StabilityOptions& options, Plan& plan);         // 18, 19
void plan_milling(const StabilityOptions& options, Plan& plan);       // 20, skull
void plan_closed_paths(const StabilityOptions& options, Plan& plan);  // 21
void plan_stages(const StabilityOptions& options, Plan& plan);        // what each stage does and costs; presets

}  // namespace trephine::bench
