// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "sweep/sweep.hpp"
#include "truth/scenario.hpp"

#include <chrono>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>
#include <utility>

/// Error against run time of all renderers: a row or two of error_vs_time.csv for each job of the plan. Interrupted, it
/// goes on where it stopped: rows are kept in error_vs_time.csv.part.
///   bench_error_vs_time --out DIR [--quick]
namespace {

using namespace trephine::bench;

/// The bones of a job, kept while jobs share them.
class BonesOfJobs {
 public:
  explicit BonesOfJobs(bool quick) : quick_(quick) {}
  [[nodiscard]] const Bones& operator()(const Job& job) {
    // Fine voxels take much memory and time: fewer bones, the same number of cases.
    const bool large = job.image.voxel_mm < 0.2;
    const int bones = large ? 2 : quick_ ? 4 : 8;
    const std::string scenario = job.scenario + (large ? " few" : "");
    const auto [made, fresh] = scenarios_.try_emplace(scenario);
    if (fresh) made->second = std::make_unique<Scenario>(make_scenario(job.scenario, bones, 64 / bones));
    const std::string name = scenario + job.image.name() + std::to_string(job.image.voxel_mm);
    if (name != name_) {
      bones_ = nullptr;
      bones_ = std::make_unique<Bones>(*made->second, job.image);
      name_ = name;
    }
    return *bones_;
  }

 private:
  bool quick_;
  std::map<std::string, std::unique_ptr<Scenario>> scenarios_{};
  std::string name_{};
  std::unique_ptr<Bones> bones_{};
};

// The rows that an interrupted run left, by job: a line "# job" stands after the rows of each.
std::map<std::string, std::string> finished_in(const std::string& part) {
  std::map<std::string, std::string> finished;
  std::ifstream in(part);
  std::string rows;
  for (std::string text; std::getline(in, text);)
    if (text.rfind("# ", 0) == 0)
      finished[text.substr(2)] = std::exchange(rows, "");
    else
      rows += text + '\n';
  return finished;
}

}  // namespace

int main(int argc, char** argv) {
  using Clock = std::chrono::steady_clock;
  const CommandLine options(argc, argv);
  const std::string path = options.folder + "/error_vs_time.csv", part = path + ".part";
  const std::vector<Job> plan = make_plan(options.quick);
  auto finished = finished_in(part);
  const std::size_t before = finished.size();
  std::ofstream kept(part);
  for (const auto& [job, rows] : finished) kept << rows << "# " << job << std::endl;
  BonesOfJobs bones(options.quick);
  const auto begin = Clock::now();
  for (const Job& job : plan) {
    const auto [rows, fresh] = finished.try_emplace(job.name());
    if (!fresh) continue;
    std::ostringstream text;
    for (const Row& row : run(job.setting, bones(job))) write(text, row);
    rows->second = text.str();
    kept << rows->second << "# " << job.name() << std::endl;
    const double share = static_cast<double>(finished.size() - before) / static_cast<double>(plan.size() - before);
    const double spent = std::chrono::duration<double>(Clock::now() - begin).count();
    if (finished.size() % 25 == 0)
      std::fprintf(stderr, "error_vs_time: %zu of %zu, %.0f s left  (%s)\n", finished.size(), plan.size(),
                   spent / share - spent, job.name().c_str());
  }
  std::ofstream out(path);
  write_header(out);
  for (const Job& job : plan) out << finished.at(job.name());
  if (!out.flush() || !kept) {
    std::fprintf(stderr, "error_vs_time: cannot write %s\n", path.c_str());
    return 1;
  }
  std::filesystem::remove(part);
}
