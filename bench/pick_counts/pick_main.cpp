// SPDX-License-Identifier: MIT
#include "bone.hpp"
#include "pick_options.hpp"
#include "pick_report.hpp"

#include <chrono>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>

namespace pick {
namespace {

namespace fs = std::filesystem;

drill::Bone load(const Options& o) {
  drill::Options options;
  options.skull = o.skull;
  options.ct = o.ct;
  options.series = o.series;
  options.isovalue = o.isovalue;
  options.tip_radius = o.tip_radius;
  options.shaft_radius = o.shaft_radius;
  options.shaft_length = o.shaft_length;
  return drill::load_bone(options);
}

StudyOptions study_options(const Options& o) {
  return {.cases = {.per_kind = o.quick ? 30 : 60, .seed = o.seed},
          .sweep = {.quick = o.quick, .limits = o.limits, .repetitions = o.quick ? 4 : 5},
          .budget_us = o.budget(),
          .algorithms = o.algorithms};
}

/// Makes the folder for the results before the work, so that nobody waits for results that cannot be kept.
fs::path made_folder(const std::string& out) {
  std::error_code error;
  fs::create_directories(out, error);
  if (!fs::is_directory(out))
    throw UsageError("--out " + out + ": cannot be made (" + (error ? error.message() : "a file has that name") + ")");
  return out;
}

void write(const fs::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

/// A line on standard error where a part begins, and every few seconds.
class ProgressLines {
 public:
  void operator()(const std::string& part, double share) {
    const auto now = std::chrono::steady_clock::now();
    if (part == part_ && now - written_ < std::chrono::seconds(5)) return;
    part_ = part;
    written_ = now;
    std::fprintf(stderr, "%-34s %3.0f %%\n", part.c_str(), 100 * share);
  }

 private:
  std::string part_{};
  std::chrono::steady_clock::time_point written_{};
};

/// `code` becomes 1 once nothing but the disk can go wrong.
int perform(const Options& options, const drill::Bone& bone, int& code) {
  const StudyOptions wanted = study_options(options);
  const Subject subject{.bone = bone.name,
                        .notes = bone.notes,
                        .scene = {.burr = bone.burr,
                                  .stiffness = options.stiffness,
                                  .isovalue = bone.isovalue,
                                  .max_force = options.max_force,
                                  .max_torque = options.max_torque},
                        .spacing = bone.grid.spacing(),
                        .size = bone.grid.size(),
                        .options = wanted};
  const fs::path folder = made_folder(options.out);
  Study study;
  try {
    study = carry_out(bone.grid, subject.scene, wanted, ProgressLines());
  } catch (const std::exception&) {
    std::error_code ignored;
    fs::remove(folder, ignored);  // if it is empty
    throw;
  }
  code = 1;
  write(folder / "settings.csv", as_csv(study));
  std::fputs(as_text(subject, study).c_str(), stdout);
  std::printf("\nevery setting: %s/settings.csv\n", options.out.c_str());
  return study.verdict.winner ? 0 : 3;
}

}  // namespace
}  // namespace pick

/// Exit code: 0; 1 where results could not be written; 2 for a wrong argument or file; 3 where nothing keeps to limits
/// and budget.
int main(int argc, char** argv) {
  int code = 2;
  try {
    const pick::Options options = pick::parse_options(argc, argv);
    if (options.help) {
      std::fputs(pick::usage().c_str(), stdout);
      return 0;
    }
    const drill::Bone bone = pick::load(options);
    return pick::perform(options, bone, code);
  } catch (const std::exception& e) {
    std::fflush(stdout);
    std::fprintf(stderr, "pick_counts: %s\n", e.what());
    return code;
  }
}
