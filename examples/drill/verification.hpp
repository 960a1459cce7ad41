// SPDX-License-Identifier: MIT
#pragma once

#include "options.hpp"
#include "run_log.hpp"
#include "surgeon.hpp"

#include <string>
#include <vector>

/// The thesis' own verification (section 5.1): a cube, a hole milled with the tip, tip and part of the shaft in it, the
/// shaft leaning on the edge. What the thesis reads off its Figures 21 to 24 by eye is computed here.
namespace drill {

/// The runs of both algorithms, ours and as the thesis writes them, and when their phases end.
struct Verification {
  RunLog line, surface;
  RunLog thesis_line, thesis_surface;
  Surgeon surgeon;
};

[[nodiscard]] Verification run_verification(const Options& options);

/// One statement, checked.
struct Finding {
  std::string says;
  std::string figures;
  enum class Verdict { kPass, kFail, kInformation } verdict = Verdict::kInformation;
};

[[nodiscard]] std::vector<Finding> check_line(const RunLog& log);
[[nodiscard]] std::vector<Finding> check_surface(const RunLog& log, const Surgeon& surgeon);
[[nodiscard]] std::vector<Finding> compare_roughness(const RunLog& line, const RunLog& surface, const Surgeon& surgeon);

/// The same findings without a verdict: of a law that they do not belong to.
[[nodiscard]] std::vector<Finding> as_information(std::vector<Finding> findings);
/// Prints findings, one or two lines each; returns how many failed.
int print_findings(const std::string& title, const std::vector<Finding>& findings);

/// `time_s,rate_Hz,spring_m,lever_m,reaction_N,torque_Nm`, a row a tick, zeros without shaft contact. The rate is what
/// this tick's time would allow, at most the loop's 1000 Hz.
void write_line_csv(const RunLog& log, const std::string& path);
/// `time_s,rate_Hz,slice,lever_m,reaction_N,torque_Nm,total_torque_Nm`, a row for each colliding slice (from the tip
/// up, the lowest is 1); a tick without any has one row with slice 0.
void write_surface_csv(const RunLog& log, const std::string& path);

}  // namespace drill
