// SPDX-License-Identifier: MIT
// Tools that the example presses into bone, without and with the cutting law.
#include "tool_show.hpp"
#include "cutting.hpp"
#include "parsed.hpp"
#include "plots.hpp"
#include "small_tooth.hpp"
#include "support/near.hpp"

#include <doctest/doctest.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <fstream>
#include <limits>
#include <map>
#include <sstream>
#include <string>
#include <vector>

using trephine::test::near;

using namespace drill;

namespace {

const ToolShow& shown() {
  static const ToolShow show = show_tools(small_tooth(), {}, small_tooth_surgeon());
  return show;
}

}  // namespace

TEST_CASE("each tool is pressed without and with the cutting law, and all checks hold") {
  const ToolShow& show = shown();
  REQUIRE(show.runs.size() == 2 * kShownTools.size());
  for (std::size_t i = 0; i < show.runs.size(); ++i) {
    CAPTURE(i);
    const ToolRun& run = show.runs[i];
    CHECK(run.tool == kShownTools[i / 2]);
    CHECK(run.law == (i % 2 == 1));
    CHECK(run.rows.size() >= 2500);
    const ToolFigures f = figures_of(run);
    CHECK(f.force > 0.05);
    CHECK(f.removed_mm3 > 1);
    // Felt is a share of the thrust, and more where edges pull sideways.
    if (run.law) CHECK(f.force > 0.9 * run.force_scale * f.thrust);
    if (run.law) CHECK(f.torque > 0);
  }
  print_table(show);
  CHECK(check(show) == 0);
}

TEST_CASE("a force beyond the device's, lost work and a fault each fail a check of the tools") {
  ToolShow show = shown();
  ToolRun& run = show.runs[1];
  REQUIRE(run.law);
  const auto failed_after = [&](auto&& spoil) {
    const ToolRun whole = run;
    spoil();
    const int failed = check(show);
    run = whole;
    return failed;
  };
  CHECK(failed_after([&] { run.rows[9].force_W.x() = 9; }) == 1);
  CHECK(failed_after([&] { run.rows[9].force_W.x() = std::numeric_limits<double>::quiet_NaN(); }) == 1);
  CHECK(failed_after([&] { run.rows[9].status = trephine::Status::kJump; }) == 1);
  CHECK(failed_after([&] { run.chip_work *= 1.021; }) == 1);
  CHECK(failed_after([&] { run.strength.densest = 0.9 * run.worked_strength(); }) == 1);
  CHECK(failed_after([&] { run.strength.voxels = 1.1 * run.worked_strength(); }) == 1);
  CHECK(failed_after([&] {
          for (ToolRow& row : run.rows) row.thrust *= 0.01;
        }) == 1);
  CHECK(check(show) == 0);
}

TEST_CASE("the tools' log has a row a tick, and their plot is drawn") {
  namespace fs = std::filesystem;
  const fs::path folder = fs::temp_directory_path() / "trephine_tests_drill_tools";
  fs::remove_all(folder);
  fs::create_directories(folder);
  write_csv(shown(), (folder / "tools.csv").string());
  std::ifstream in(folder / "tools.csv");
  std::string line;
  std::getline(in, line);
  CHECK(line.starts_with("time_s,tool,law,force_N,"));
  std::map<std::string, std::size_t> rows;  // by tool and law
  while (std::getline(in, line)) {
    std::istringstream cells(line);
    std::array<std::string, 3> cell;
    for (std::string& c : cell) std::getline(cells, c, ',');
    ++rows[cell[1] + " " + cell[2]];
  }
  CHECK(rows.size() == shown().runs.size());
  for (const ToolRun& run : shown().runs) CHECK(rows[run.tool + (run.law ? " with" : " without")] == run.rows.size());
  if (have_gnuplot()) CHECK(fs::file_size(folder / plot_tools(folder.string(), shown())) > 10'000);
  fs::remove_all(folder);
}

TEST_CASE("strength goes by Hounsfield units, or by the volume's own range; coarse voxels fit no tool of 3 mm") {
  Bone bone{.name = "block",
            .unit = "levels",
            .grid = block_phantom<std::int16_t>(8, 2, 0.4e-3),
            .isovalue = PhantomDensities::kIsovalue,
            .burr = {},
            .notes = {}};
  const trephine::BoneStrength levels = strength_of(bone);
  CHECK(levels(PhantomDensities::kAir) == 0);
  CHECK(levels(bone.grid.original_range().max) == near(1));
  CHECK(shown_tools_fit(bone));
  bone.unit = "HU";
  CHECK(strength_of(bone)(1700) == near(1));
  CHECK(strength_of(bone)(0) == 0);
  bone.grid = block_phantom<std::int16_t>(8, 2, 0.6e-3);
  CHECK_FALSE(shown_tools_fit(bone));
}

TEST_CASE("--tools stands alone") {
  CHECK(parsed({"--tools", "--phantom", "tooth"}).tools);
  CHECK_FALSE(parsed({"--phantom", "tooth"}).tools);
  for (const auto& wrong :
       {std::vector{"--tools", "--structures"}, {"--tools", "--tool", "round-3"}, {"--tools", "3"}}) {
    CAPTURE(wrong[1]);
    CHECK_THROWS_AS((void)parsed(wrong), UsageError);
  }
}
