// SPDX-License-Identifier: MIT
// What the window's program reads of its command line and of a scan. No OpenGL.
#include "live_options.hpp"
#include "workbench.hpp"

#include "support/near.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

live::Parsed parsed(std::vector<const char*> arguments) {
  arguments.insert(arguments.begin(), "live");
  return live::parse_live_options(static_cast<int>(arguments.size()), arguments.data());
}

/// A scan of a ball, and of a rod beside it, as a project's folder; gone at the end.
struct Scan {
  fs::path folder = fs::temp_directory_path() / "trephine_live_scan";

  Scan(int size, double spacing_mm, double radius_mm) {
    fs::remove_all(folder);
    fs::create_directories(folder);
    const std::string n = "<integer>" + std::to_string(size) + "</integer>",
                      mm = "<real>" + std::to_string(spacing_mm) + "</real>";
    std::ofstream(folder / "main.plist") << "<key>shape</key><array>" << n << n << n
                                         << "</array><key>spacing</key><array>" << mm << mm << mm << "</array>";
    std::ofstream matrix(folder / "matrix.dat", std::ios::binary);
    const double middle = 0.5 * (size - 1);
    for (int k = 0; k < size; ++k)
      for (int j = 0; j < size; ++j)
        for (int i = 0; i < size; ++i) {
          const double d = trephine::Vec3d(i - middle, j - middle, k - middle).norm() * spacing_mm - radius_mm;
          const bool rod = i < 2 && j < 2;
          const int v = rod ? 900 : std::clamp(static_cast<int>(300 - 500 * d / spacing_mm), -1000, 1200);
          matrix.put(static_cast<char>(v & 0xff)).put(static_cast<char>((v >> 8) & 0xff));
        }
  }
  ~Scan() { fs::remove_all(folder); }
  Scan(const Scan&) = delete;
  Scan& operator=(const Scan&) = delete;

  [[nodiscard]] std::vector<std::string> notes() const {
    drill::Options options;
    options.skull = folder.string();
    return live::load(options).bone.notes;
  }
};

bool says(const std::vector<std::string>& notes, const std::string& text) {
  return std::any_of(notes.begin(), notes.end(), [&](const auto& n) { return n.find(text) != std::string::npos; });
}

}  // namespace

TEST_CASE("a number after --tool is a burr's diameter, as in a tool's name") {
  CHECK(parsed({"--tool", "4"}).options.bone.tip_radius == trephine::test::near(0.002));
  CHECK(parsed({"--tool", "round-4"}).options.bone.tool == "round-4");
  CHECK(parsed({"--largest-piece"}).options.bone.largest_piece);
  const auto help = parsed({"--help"});
  REQUIRE(help.exit);
  CHECK(help.exit->text.find("radius") == std::string::npos);
}

TEST_CASE("what is left out of a scan, and a bone too large for the window, are told in a sentence") {
  const Scan large(96, 2.2, 98);
  const std::vector<std::string> notes = large.notes();
  CHECK(says(notes, "left out: 1 piece apart from the largest one, 384 voxels"));
  CHECK(says(notes, "cropped to "));
  CHECK(says(notes, " around the start: the whole would be "));
  CHECK(says(notes, "--largest-piece"));
  const Scan small(40, 1.5, 20);
  CHECK_FALSE(says(small.notes(), "cropped"));
}
