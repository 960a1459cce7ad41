// SPDX-License-Identifier: MIT
#pragma once

#include "common/table.hpp"
#include "stability/places.hpp"

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

/// The table that everything here ends in, and the work that fills it on all cores in a fixed order.
namespace trephine::bench {

inline constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// A renderer with its options.
struct Who {
  std::string renderer, options;
  Who(std::string of, std::string with) : renderer(std::move(of)), options(std::move(with)) {}
  Who(const Setup& setup) : Who(setup.renderer, label(setup)) {}  // NOLINT: a setup is one
};

struct StabilityRow {
  std::string scenario, name;
  Who who;
  double measured, reference;  ///< NaN where there is none
  std::string unit;
  double limit;  ///< the most that passes; NaN: reported, not judged
  [[nodiscard]] bool judged() const { return std::isfinite(limit); }
  [[nodiscard]] bool pass() const { return !judged() || measured <= limit; }
};

struct StabilityOptions {
  std::string skull{};  ///< folder with the skull's CT; empty: the phantom alone
  bool quick = false;
};

/// One measurement: rows, and lines of further tables by file name.
struct Measured {
  std::vector<StabilityRow> rows;
  std::vector<std::pair<std::string, std::string>> lines;

  /// `measured` must be at most `limit`.
  void judge(const std::string& scenario, const std::string& name, const Who& who, double measured, double limit,
             const std::string& unit, double reference = kNaN) {
    rows.push_back({scenario, name, who, measured, reference, unit, limit});
  }
  /// Reported without a limit.
  void tell(const std::string& scenario, const std::string& name, const Who& who, double measured,
            const std::string& unit, double reference = kNaN) {
    judge(scenario, name, who, measured, kNaN, unit, reference);
  }
  /// A line of the table `file`; what is not finite is left empty.
  template <class... Values>
  void line(const std::string& file, const Values&... values) {
    std::ostringstream text;
    const auto put = [&](const auto& v) {
      if constexpr (std::is_floating_point_v<std::decay_t<decltype(v)>>)
        (std::isfinite(v) ? text << v : text) << ',';
      else if constexpr (std::is_convertible_v<decltype(v), std::string>)
        text << without_commas(v) << ',';
      else
        text << v << ',';
    };
    (put(values), ...);
    std::string all = text.str();
    all.pop_back();
    lines.emplace_back(file, all);
  }
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
void plan_milling(const StabilityOptions& options, Plan& plan);       // 20, skull
void plan_closed_paths(const StabilityOptions& options, Plan& plan);  // 21
void plan_stages(const StabilityOptions& options, Plan& plan);        // each stage's effect and cost; presets

}  // namespace trephine::bench
