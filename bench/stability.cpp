// SPDX-License-Identifier: MIT
#include "stability/rows.hpp"
#include "studies/arguments.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <mutex>
#include <string>
#include <thread>

/// The closed-loop measurements: bench_stability --out DIR [--quick] [--skull FOLDER] [--only WORD] [--renderer NAME]
namespace {

using namespace trephine::bench;

const std::map<std::string, std::string> kHeaders = {
    {"stability_plane", "renderer,damping,stiffness,outcome"},
    {"stability_sweep",
     "place,damping,delay,hand,friction,quantum_mm,renderer,options,stable_N_per_m,theory_N_per_m,beyond_mJ,"
     "amplitude_mm,frequency_Hz,force_step_N,torque_step_mNm,drawn"},
    {"stability_thin_walls", "renderer,options,stiffness,voxels,speed,through,held_N"},
    {"stability_energy", "renderer,options,time,energy_mJ,allowed_mJ,force_N"},
};

std::string number(double v) {
  if (!std::isfinite(v)) return "";
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", v);
  return text;
}

/// Commas part columns.
std::string plain(std::string s) {
  std::replace(s.begin(), s.end(), ',', ';');
  return s;
}

/// Runs the plan on all cores; what comes out stands in the plan's order. What throws is a row that fails.
std::vector<Measured> run(const Plan& plan) {
  std::vector<Measured> results(plan.size());
  std::atomic<std::size_t> next{0};
  std::mutex talk;
  std::map<std::string, double> seconds;
  const auto work = [&] {
    for (std::size_t i = next++; i < plan.size(); i = next++) {
      const auto began = std::chrono::steady_clock::now();
      try {
        results[i] = plan[i].run();
      } catch (const std::exception& e) {
        results[i].rows.push_back(
            at_most("could not be measured", plan[i].name + ": " + e.what(), "", "", 1, 0, "", 0));
      }
      const std::lock_guard lock(talk);
      seconds[plan[i].name] += std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
      if (i % 20 == 0) std::fprintf(stderr, "\rstability: %zu of %zu", i, plan.size());
    }
  };
  std::vector<std::thread> threads;
  for (unsigned t = 1; t < std::max(1U, std::thread::hardware_concurrency()); ++t) threads.emplace_back(work);
  work();
  for (auto& t : threads) t.join();
  std::fprintf(stderr, "\n");
  for (const auto& [name, s] : seconds) std::fprintf(stderr, "stability: %s: %.1f s of processor\n", name.c_str(), s);
  return results;
}

void write(const std::string& folder, const std::vector<Measured>& results) {
  std::ofstream table(folder + "/stability.csv");
  table << "scenario,case,renderer,options,measured,reference,unit,limit,pass\n";
  std::map<std::string, std::ofstream> further;
  for (const auto& [name, header] : kHeaders) {
    further[name].open(folder + "/" + name + ".csv");
    further[name] << header << '\n';
  }
  for (const Measured& m : results) {
    for (const StabilityRow& r : m.rows) {
      const bool judged = std::isfinite(r.limit);
      table << plain(r.scenario) << ',' << plain(r.name) << ',' << r.renderer << ',' << plain(r.options) << ','
            << number(r.measured) << ',' << number(r.reference) << ',' << r.unit << ',' << number(r.limit) << ','
            << (judged ? (r.pass ? "pass" : "fail") : "") << '\n';
    }
    for (const auto& [file, line] : m.lines) further.at(file) << line << '\n';
  }
  if (!table) throw std::runtime_error("cannot write " + folder + "/stability.csv");
}

}  // namespace

int main(int argc, char** argv) {
  StabilityOptions options{.folder = "build/report"};
  std::string only, renderer;
  if (!read_arguments(
          argc, argv, "bench_stability", {{"--quick", &options.quick}},
          {{"--out", &options.folder}, {"--skull", &options.skull}, {"--only", &only}, {"--renderer", &renderer}}))
    return 2;
  try {
    std::filesystem::create_directories(options.folder);
    Plan plan;
    for (const auto part : {plan_closed_paths, plan_milling, plan_critical, plan_places, plan_sweep, plan_thin_walls,
                            plan_jumps, plan_stages})
      part(options, plan);
    std::erase_if(plan, [&](const Work& w) { return w.name.find(only) == std::string::npos; });
    std::erase_if(plan, [&](const Work& w) { return w.name.rfind(renderer, 0) != 0; });
    const auto results = run(plan);
    write(options.folder, results);
    std::size_t judged = 0, failed = 0;
    for (const Measured& m : results)
      for (const StabilityRow& r : m.rows)
        if (std::isfinite(r.limit)) {
          ++judged;
          failed += !r.pass;
        }
    std::printf("stability: %zu limits, %zu met, %zu not met\n", judged, judged - failed, failed);
  } catch (const std::exception& e) {
    std::cerr << "bench_stability: " << e.what() << '\n';
    return 1;
  }
}
