// SPDX-License-Identifier: MIT
#include "bone.hpp"
#include "pick_options.hpp"
#include "progress_line.hpp"
#include "report.hpp"

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>

namespace pick {
namespace {

namespace fs = std::filesystem;

constexpr const char* kPlot = "error_vs_time";

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
  StudyOptions s;
  s.cases.seed = o.seed;
  s.cases.per_kind = o.quick ? 30 : 60;
  s.cases.holes = o.quick ? 8 : 12;
  s.sweep.quick = o.quick;
  s.sweep.limits = o.limits;
  s.sweep.repetitions = o.quick ? 4 : 5;
  s.budget_us = o.budget();
  s.algorithms = o.algorithms;
  return s;
}

/// The folder for the results, made before the work so that nobody waits for what cannot be kept; gone again where the
/// work fails and nothing was written.
class Folder {
 public:
  explicit Folder(const std::string& out) : path_(out) {
    std::error_code error;
    made_ = fs::create_directories(path_, error);
    if (error || !fs::is_directory(path_))
      throw UsageError("--out " + out + ": cannot be made (" + (error ? error.message() : "a file has that name") +
                       ")");
  }
  ~Folder() {
    std::error_code ignored;
    if (made_ && !kept_) fs::remove(path_, ignored);
  }
  Folder(const Folder&) = delete;
  Folder& operator=(const Folder&) = delete;

  [[nodiscard]] const fs::path& keep() {
    kept_ = true;
    return path_;
  }

 private:
  fs::path path_;
  bool made_ = false;
  bool kept_ = false;
};

void write(const fs::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

/// The picture's name, empty where gnuplot is missing or fails.
std::string draw(const std::string& folder) {
#if defined(_WIN32)
  const std::string quiet = " >NUL 2>&1";
#else
  const std::string quiet = " >/dev/null 2>&1";
#endif
  if (std::system(("gnuplot --version" + quiet).c_str()) != 0) return {};
  // In the folder itself, so that no name needs quoting.
  const fs::path here = fs::current_path();
  fs::current_path(folder);
  const int status = std::system((std::string("gnuplot ") + kPlot + ".gp" + quiet).c_str());
  const bool png = fs::exists(std::string(kPlot) + ".png");
  fs::current_path(here);
  return status == 0 ? std::string(kPlot) + (png ? ".png" : ".svg") : std::string();
}

/// `code` becomes 1 once nothing but the disk can go wrong.
int perform(const Options& options, const drill::Bone& bone, Grid& milled, int& code) {
  const StudyOptions wanted = study_options(options);
  Subject subject{.bone = bone.name,
                  .notes = bone.notes,
                  .scene = {.burr = bone.burr,
                            .stiffness = options.stiffness,
                            .isovalue = bone.isovalue,
                            .max_force = options.max_force,
                            .max_torque = options.max_torque},
                  .spacing = bone.grid.spacing(),
                  .size = bone.grid.size(),
                  .options = wanted};
  Folder out(options.out);
  Study study;
  {
    ProgressLine line;
    study = carry_out(bone.grid, milled, subject.scene, wanted,
                      [&](const std::string& part, double share) { line(part, share); });
  }
  code = 1;
  const fs::path& folder = out.keep();
  write(folder / "settings.csv", as_csv(study));
  write(folder / (std::string(kPlot) + ".gp"), as_gnuplot(subject, study, kPlot));
  const std::string picture = draw(options.out);
  const std::string report = options.json ? as_json(subject, study) : as_text(subject, study);
  std::fputs(report.c_str(), stdout);
  std::fprintf(options.json ? stderr : stdout, "\nleft in %s: settings.csv, %s\n", options.out.c_str(),
               picture.empty() ? (std::string(kPlot) + ".gp (no picture: gnuplot is missing or failed)").c_str()
                               : picture.c_str());
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
    pick::Grid milled = drill::fresh_copy(bone.grid);
    return pick::perform(options, bone, milled, code);
  } catch (const std::exception& e) {
    std::fflush(stdout);
    std::fprintf(stderr, "pick_counts: %s\n", e.what());
    return code;
  }
}
