// SPDX-License-Identifier: MIT
#include "sweep/plan.hpp"
#include "sweep/runs.hpp"
#include "truth/scenario.hpp"

#include <benchmark/benchmark.h>

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>

/// Error against run time of both renderers: every job of the plan is a benchmark (one iteration over all its cases;
/// its time is the median tick), its errors are counters, and a row or two of error_vs_time.csv. Interrupted, it goes
/// on where it stopped: rows are kept in error_vs_time.csv.part.
///   bench_error_vs_time --out DIR [--quick] [Google Benchmark's options]
namespace {

using namespace trephine::bench;
using Clock = std::chrono::steady_clock;

struct Sweep {
  std::ofstream csv;
  std::size_t done = 0, total = 0;
  Clock::time_point begin = Clock::now();
  bool quick = false;
  std::map<std::string, std::unique_ptr<Scenario>> scenarios;
  std::string image_name;
  std::unique_ptr<Bones> bones;

  const Bones& bones_of(const Job& job) {
    // Fine voxels take much memory and time: fewer bones, the same number of cases.
    const bool large = job.image.voxel_mm < 0.2;
    const std::string scenario_key = job.scenario + (large ? " few" : "");
    auto& scenario = scenarios[scenario_key];
    if (!scenario)
      scenario = std::make_unique<Scenario>(make_scenario(job.scenario,
                                                          large   ? 2
                                                          : quick ? 4
                                                                  : 8,
                                                          large   ? 32
                                                          : quick ? 16
                                                                  : 8));
    const std::string key = scenario_key + job.image.name() + std::to_string(job.image.voxel_mm);
    if (key != image_name) {
      bones = nullptr;
      bones = std::make_unique<Bones>(*scenario, job.image);
      image_name = key;
    }
    return *bones;
  }

  void progress(const std::string& name) {
    ++done;
    const double spent = std::chrono::duration<double>(Clock::now() - begin).count();
    const double left = spent / static_cast<double>(done) * static_cast<double>(total - done);
    if (done % 25 == 0 || done == total)
      std::fprintf(stderr, "error_vs_time: %zu of %zu, %.0f s left  (%s)\n", done, total, left, name.c_str());
  }
};

void run_job(benchmark::State& state, const Job& job, Sweep& sweep) {
  for (auto _ : state) {
    const auto rows = run(job.setting, sweep.bones_of(job));
    sweep.csv << "# " << job.name() << '\n';
    for (const Row& row : rows) {
      write(sweep.csv, row);
      if (row.error_kind != "discretisation") continue;
      state.SetIterationTime(1e-9 * row.tick_ns_median);
      state.counters["tick_ns_p999"] = row.tick_ns_p999;
      state.counters["force_rel_p95"] = row.force_error_rel_p95;
      state.counters["direction_deg_p99"] = row.direction_error_deg_p99;
      state.counters["torque_rel_p95"] = row.torque_error_rel_p95;
      state.counters["point_vx_p95"] = row.point_error_voxel_p95;
      state.counters["misses"] = row.misses;
    }
    if (rows.empty()) state.SetIterationTime(0);
    sweep.csv.flush();
  }
  sweep.progress(job.name());
}

// Names of the jobs that an interrupted run finished: all that stand in the part file before its last one.
std::vector<std::string> finished_in(const std::string& part) {
  std::vector<std::string> names;
  std::ifstream in(part);
  for (std::string text; std::getline(in, text);)
    if (text.rfind("# ", 0) == 0) names.push_back(text.substr(2));
  if (!names.empty()) names.pop_back();
  return names;
}

// The part file without its last job, which may be cut off.
void trim(const std::string& part, const std::vector<std::string>& keep) {
  std::ifstream in(part);
  std::string kept;
  std::size_t jobs = 0;
  for (std::string text; std::getline(in, text);) {
    if (text.rfind("# ", 0) == 0 && ++jobs > keep.size()) break;
    kept += text + '\n';
  }
  std::ofstream(part) << kept;
}

// The finished table: header and rows.
void finish(const std::string& part, const std::string& csv) {
  std::ifstream in(part);
  std::ofstream out(csv);
  write_header(out);
  for (std::string text; std::getline(in, text);)
    if (text.rfind("# ", 0) != 0) out << text << '\n';
}

}  // namespace

int main(int argc, char** argv) {
  std::string out = "build/report";
  Sweep sweep;
  std::vector<char*> rest{argv[0]};
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    if (a == "--quick") {
      sweep.quick = true;
    } else if (a == "--out" && i + 1 < argc) {
      out = argv[++i];
    } else {
      rest.push_back(argv[i]);
    }
  }
  int count = static_cast<int>(rest.size());
  benchmark::Initialize(&count, rest.data());
  if (benchmark::ReportUnrecognizedArguments(count, rest.data())) return 2;
  std::filesystem::create_directories(out);
  const std::string part = out + "/error_vs_time.csv.part";
  const auto finished = finished_in(part);
  if (!finished.empty()) trim(part, finished);
  sweep.csv.open(part, finished.empty() ? std::ios::trunc : std::ios::app);
  if (!sweep.csv) {
    std::cerr << "error_vs_time: cannot write " << part << '\n';
    return 2;
  }
  const std::vector<Job> plan = make_plan(sweep.quick);
  std::vector<std::string> sorted = finished;
  std::sort(sorted.begin(), sorted.end());
  for (const Job& job : plan) {
    if (std::binary_search(sorted.begin(), sorted.end(), job.name())) continue;
    ++sweep.total;
    benchmark::RegisterBenchmark(job.name().c_str(),
                                 [&sweep, job](benchmark::State& state) { run_job(state, job, sweep); })
        ->Iterations(1)
        ->UseManualTime()
        ->Unit(benchmark::kNanosecond);
  }
  if (!finished.empty()) std::cerr << "error_vs_time: going on after " << finished.size() << " jobs\n";
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  sweep.csv.close();
  if (sweep.done == 0 && sweep.total > 0) {  // listed only, or filtered away: the last table stays
    if (finished.empty()) std::filesystem::remove(part);
    return 0;
  }
  finish(part, out + "/error_vs_time.csv");
  std::filesystem::remove(part);
  std::cerr << "error_vs_time: wrote " << out << "/error_vs_time.csv\n";
}
