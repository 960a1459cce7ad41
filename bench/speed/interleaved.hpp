// SPDX-License-Identifier: MIT
#pragma once

#include <benchmark/benchmark.h>

#include <algorithm>
#include <functional>
#include <map>
#include <string>
#include <vector>

/// Times of many pieces of work by one interleaved run of Google Benchmark: they differ in what they do, not in when
/// the machine was busy with something else. Times are of the thread that works: what others take of a shared core is
/// no cost of the work.
namespace trephine::bench {

class SpeedRun {
 public:
  void add(const std::string& name, std::function<void()> work) {
    benchmark::RegisterBenchmark(name.c_str(), [work = std::move(work)](benchmark::State& state) {
      for (auto _ : state) work();
    })->Unit(benchmark::kNanosecond);
  }

  void run(int repetitions, double min_time) {
    std::vector<std::string> arguments{"bench_speed", "--benchmark_enable_random_interleaving=true",
                                       "--benchmark_repetitions=" + std::to_string(repetitions),
                                       "--benchmark_min_time=" + std::to_string(min_time)};
    std::vector<char*> argv;
    for (auto& a : arguments) argv.push_back(a.data());
    int argc = static_cast<int>(argv.size());
    benchmark::Initialize(&argc, argv.data());
    Reporter reporter(times_);
    benchmark::RunSpecifiedBenchmarks(&reporter);
  }

  /// Median over the repetitions [ns].
  [[nodiscard]] double ns(const std::string& name) const {
    auto t = times_.at(name);
    std::sort(t.begin(), t.end());
    return t[t.size() / 2];
  }

 private:
  class Reporter : public benchmark::BenchmarkReporter {
   public:
    explicit Reporter(std::map<std::string, std::vector<double>>& times) : times_(times) {}
    bool ReportContext(const Context&) override { return true; }
    void ReportRuns(const std::vector<Run>& runs) override {
      for (const Run& r : runs)
        if (r.run_type == Run::RT_Iteration) times_[r.run_name.function_name].push_back(r.GetAdjustedCPUTime());
    }

   private:
    std::map<std::string, std::vector<double>>& times_;
  };

  std::map<std::string, std::vector<double>> times_;
};

}  // namespace trephine::bench
