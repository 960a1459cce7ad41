// SPDX-License-Identifier: MIT
#include "bone.hpp"
#include "pick_options.hpp"
#include "pick_report.hpp"
#include "writable.hpp"

#include <trephine/device/presets.hpp>

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
  options.largest_piece = o.largest_piece;
  options.tool = o.tool;
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

Scene scene_of(const Options& o, const drill::Bone& bone) {
  Scene s{.burr = bone.burr, .isovalue = bone.isovalue, .density = bone.density(bone.isovalue), .tool_name = o.tool};
  s.stiffness = o.stiffness.value_or(s.stiffness);
  s.max_force = o.max_force.value_or(s.max_force);
  s.max_torque = o.max_torque.value_or(s.max_torque);
  if (o.device.empty()) return s;
  const trephine::DevicePreset device = trephine::device_preset(o.device);
  s.device = o.device;
  s.stiffness = device.stiffness;
  s.max_force = device.limits.force;
  s.max_torque = device.limits.torque;
  return s;
}

void write(const fs::path& path, const std::string& content) {
  std::ofstream file(path, std::ios::binary);
  file << content;
  file.close();
  if (!file) throw std::runtime_error("cannot write " + path.string());
}

/// A line on standard error where a part begins, every few seconds, and where it ends.
class ProgressLines {
 public:
  void operator()(const std::string& part, double share) {
    const auto now = std::chrono::steady_clock::now();
    const bool ends = share >= 1;
    if (part == part_ && (ended_ || (!ends && now - written_ < std::chrono::seconds(5)))) return;
    part_ = part;
    ended_ = ends;
    written_ = now;
    std::fprintf(stderr, "%-34s %3.0f %%\n", part.c_str(), 100 * share);
  }

 private:
  std::string part_{};
  bool ended_ = false;
  std::chrono::steady_clock::time_point written_{};
};

/// `code` becomes 1 once nothing but the disk can go wrong.
int perform(const Options& options, const drill::Bone& bone, int& code) {
  const StudyOptions wanted = study_options(options);
  const Subject subject{.bone = bone.name,
                        .unit = bone.unit,
                        .notes = bone.notes,
                        .scene = scene_of(options, bone),
                        .spacing = bone.grid.spacing(),
                        .size = bone.grid.size(),
                        .options = wanted};
  const fs::path folder = options.out;
  drill::require_writable_folder("--out", folder);
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
