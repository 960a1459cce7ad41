// SPDX-License-Identifier: MIT
#pragma once

#include "structure_show.hpp"
#include "surgeon.hpp"
#include "tool_show.hpp"

#include <string>
#include <vector>

namespace drill {

/// Whether gnuplot can be called.
[[nodiscard]] bool have_gnuplot();

/// Writes a gnuplot script into `folder` next to the logs it plots and runs it there; returns the picture's name. Each
/// script can be run again by hand: `gnuplot line.gp`. Throws std::runtime_error where gnuplot fails.
std::string plot_run(const std::string& folder, const std::string& algorithm, const std::string& bone,
                     const Surgeon& surgeon);
std::string plot_line_verification(const std::string& folder, const Surgeon& surgeon);
/// `slices`: those that ever collide, counted from the tip.
std::string plot_surface_verification(const std::string& folder, const Surgeon& surgeon,
                                      const std::vector<int>& slices);
/// Distance and guard's push on the way to each structure, of `structures.csv`.
std::string plot_structures(const std::string& folder, const StructureShow& show);
/// Force of each tool with the cutting law and without, of `tools.csv`.
std::string plot_tools(const std::string& folder, const ToolShow& show);

}  // namespace drill
