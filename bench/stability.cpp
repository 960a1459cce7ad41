// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "common/on_all_cores.hpp"
#include "common/table.hpp"
#include "stability/measured.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <iostream>
#include <map>

/// The closed-loop measurements: bench_stability --out DIR [--quick] [--skull FOLDER] [--only WORD] [--renderer NAME]
namespace {

using namespace trephine::bench;

const std::map<std::string, std::string> kHeaders = {
    {"stability_sweep",
     "place,damping,delay,hand,friction,quantum_mm,renderer,options,stable_N_per_m,theory_N_per_m,beyond_mJ,"
     "force_step_N"},
    {"stability_energy", "renderer,options,time,energy_mJ,allowed_mJ,force_N"},
};

std::string number(double v) {
  if (!std::isfinite(v)) return "";
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", v);
  return text;
}

/// Runs the plan on all cores; results stand in the plan's order. An exception is a row that fails.
std::vector<Measured> run(const Plan& plan) {
  std::vector<Measured> results(plan.size());
  const auto work = [&](std::size_t i) {
    try {
      results[i] = plan[i].run();
    } catch (const std::exception& e) {
      results[i].judge("could not be measured", plan[i].name + ": " + e.what(), {"", ""}, 1, 0, "");
    }
  };
  on_all_cores(plan.size(), "stability", work);
  return results;
}

void write(const std::string& folder, const std::vector<Measured>& results) {
  Table table(folder + "/stability.csv", "scenario,case,renderer,options,measured,reference,unit,limit,pass");
  std::map<std::string, Table> further;
  for (const auto& [name, header] : kHeaders) further.try_emplace(name, folder + "/" + name + ".csv", header);
  std::size_t judged = 0, met = 0;
  for (const Measured& m : results) {
    for (const StabilityRow& r : m.rows) {
      table.row(without_commas(r.scenario), without_commas(r.name), r.who.renderer, without_commas(r.who.options),
                number(r.measured), number(r.reference), r.unit, number(r.limit),
                r.judged() ? (r.pass() ? "pass" : "fail") : "");
      judged += r.judged();
      met += r.judged() && r.pass();
    }
    for (const auto& [file, line] : m.lines) further.at(file).row(line);
  }
  std::printf("stability: %zu limits, %zu met, %zu not met\n", judged, met, judged - met);
}

}  // namespace

int main(int argc, char** argv) {
  std::string skull, only, renderer;
  const CommandLine line(argc, argv, {{"--skull", &skull}, {"--only", &only}, {"--renderer", &renderer}});
  const StabilityOptions options{skull, line.quick};
  try {
    Plan plan;
    for (const auto part :
         {plan_closed_paths, plan_milling, plan_critical, plan_places, plan_sweep, plan_thin_walls, plan_stages})
      part(options, plan);
    std::erase_if(
        plan, [&](const Work& w) { return w.name.find(only) == std::string::npos || w.name.rfind(renderer, 0) != 0; });
    write(line.folder, run(plan));
  } catch (const std::exception& e) {
    std::cerr << "bench_stability: " << e.what() << '\n';
    return 1;
  }
}
