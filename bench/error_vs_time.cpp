// SPDX-License-Identifier: MIT
#include "common/command_line.hpp"
#include "sweep/sweep.hpp"
#include "truth/scenario.hpp"

#include <cstdio>
#include <fstream>
#include <map>
#include <memory>

/// Error against run time of all renderers: a row or two of error_vs_time.csv for each job of the plan.
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

}  // namespace

int main(int argc, char** argv) {
  const CommandLine options(argc, argv);
  const std::string path = options.folder + "/error_vs_time.csv";
  const std::vector<Job> plan = make_plan(options.quick);
  std::ofstream out(path);
  write_header(out);
  BonesOfJobs bones(options.quick);
  for (std::size_t i = 0; i < plan.size(); ++i) {
    for (const Row& row : run(plan[i].setting, bones(plan[i]))) write(out, row);
    if (i % 25 == 24)
      std::fprintf(stderr, "error_vs_time: %zu of %zu (%s)\n", i + 1, plan.size(), plan[i].name().c_str());
  }
  if (out.flush()) return 0;
  std::fprintf(stderr, "error_vs_time: cannot write %s\n", path.c_str());
  return 1;
}
