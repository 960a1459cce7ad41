// SPDX-License-Identifier: MIT
// What pictures and plots show: writing beside the bone, no contact through it, rims as they were, plots of usual size.
#include "gnuplot_script.hpp"
#include "picture.hpp"
#include "plots.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

namespace {

using namespace drill;

constexpr int kSide = 40, kWidth = 320, kHeight = 240;
constexpr double kVoxel = 0.5e-3, kIsovalue = 300;
const Vec3f kMiddle(10e-3F, 10e-3F, 10e-3F);  // on the surface

/// Bone below the plane z = 10 mm, with a round hole along z of a radius [m] in it.
Grid slab(double hole) {
  std::vector<std::int16_t> voxels;
  for (int k = 0; k < kSide; ++k)
    for (int j = 0; j < kSide; ++j)
      for (int i = 0; i < kSide; ++i) {
        const double in_bone = 10e-3 - k * kVoxel;
        const double in_hole = hole - std::hypot(i * kVoxel - 10e-3, j * kVoxel - 10e-3);
        const double depth = hole > 0 ? std::min(in_bone, -in_hole) : in_bone;
        voxels.push_back(static_cast<std::int16_t>(std::clamp(kIsovalue + 1e6 * depth, -1000.0, 2000.0)));
      }
  return Grid({.size = {kSide, kSide, kSide}, .spacing = trephine::Vec3d::Constant(kVoxel)}, voxels);
}

Picture from_above(const PicturedBone& bone) {
  Picture p;
  p.bone = &bone;
  p.camera = look_at(kMiddle, Vec3f::UnitZ(), Vec3f::UnitY(), 10e-3F);
  return p;
}

int red_pixels(Canvas canvas) {
  int count = 0;
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.width(); ++x) {
      const Vec3f& c = canvas.pixel(x, y);
      count += c.x() > 0.1F && c.x() > 1.6F * std::max(c.y(), c.z()) ? 1 : 0;
    }
  return count;
}

TEST_CASE("pictures: title, legend and scale bar stand above and below the scene") {
  const Grid grid = slab(0);
  const PicturedBone bone(grid, kIsovalue);
  Picture plain = from_above(bone);
  plain.tool = trephine::Pose<float>::Identity();
  plain.tool->translation() = kMiddle + Vec3f(0, 0, 20e-3F);
  Picture told = plain;
  told.title = "A long title of this picture of bone";
  told.subtitle = "and all that there is to say about the bone in this picture";
  told.tool_label = "the drill, and where it is held";
  Canvas a = draw(plain, kWidth, kHeight), b = draw(told, kWidth, kHeight);
  int different = 0, covered = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      if (a.pixel(x, y) == b.pixel(x, y)) continue;
      ++different;
      covered += y >= kHeight / 10 && y < 9 * kHeight / 10 ? 1 : 0;
    }
  CHECK(different > 300);
  CHECK(covered == 0);
}

TEST_CASE("pictures: a contact that bone hides is not drawn, and the legend has none") {
  const Grid grid = slab(0);
  const PicturedBone bone(grid, kIsovalue);
  Picture p = from_above(bone);
  p.points_label = "contact";
  p.points = {kMiddle};
  CHECK(red_pixels(draw(p, kWidth, kHeight)) > 10);
  p.points = {kMiddle - Vec3f(0, 0, 3e-3F), kMiddle - Vec3f(1e-3F, 0, 1e-3F)};
  CHECK(red_pixels(draw(p, kWidth, kHeight)) == 0);
}

TEST_CASE("pictures: bone round a hole keeps its colour, and its wall has that of cut bone") {
  constexpr double kHole = 1.5e-3;
  const Grid whole = slab(0), drilled = slab(kHole);
  const PicturedBone before(whole, kIsovalue), after(drilled, kIsovalue);
  Picture p = from_above(after);
  p.uncut = &before;
  p.light = Vec3f::UnitZ();
  Canvas canvas = draw(p, kWidth, kHeight);
  // The scene's middle and scale: the bone is even far from the hole.
  const int first = kHeight / 10, last = static_cast<int>(0.915 * kHeight);
  const double metres = 10e-3 / (last - first);
  const auto warmth = [](const Vec3f& c) { return static_cast<double>(c.x() / c.z()); };
  const double usual = warmth(canvas.pixel(kWidth / 2 + static_cast<int>(5e-3 / metres), (first + last) / 2));
  int seen = 0;
  double warmest = 0;
  for (int y = first; y < last; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double r = metres * std::hypot(x + 0.5 - kWidth / 2.0, y + 0.5 - 0.5 * (first + last));
      if (r < kHole + 0.4 * kVoxel || r > kHole + 3 * kVoxel) continue;
      ++seen;
      warmest = std::max(warmest, warmth(canvas.pixel(x, y)) / usual);
    }
  CHECK(seen > 500);
  CHECK(warmest < 1.2);
  MESSAGE("warmth at the rim ", warmest, " of the usual ", usual);
  p.camera = look_at(kMiddle - Vec3f(0, 0, 0.5e-3F), Vec3f(0, -1, 0.6F), Vec3f::UnitZ(), 4e-3F);
  canvas = draw(p, kWidth, kHeight);
  CHECK(warmth(canvas.pixel(kWidth / 2, (first + last) / 2)) > 1.3 * usual);
}

TEST_CASE("plots: many panels fit on a screen, and what trembles from tick to tick has its mean") {
  if (!have_gnuplot()) {
    MESSAGE("left out: no gnuplot");
    return;
  }
  const std::filesystem::path folder = "plotted";
  std::filesystem::create_directory(folder);
  {
    std::ofstream csv(folder / "shaking.csv");
    csv << "time,force\n";
    for (int i = 0; i < 1000; ++i) csv << 1e-3 * i << ',' << (i % 2 == 0 ? 1.5 : 0.5) << '\n';
  }
  Script many("many", "seven rows", 7, 2, 1.0, nullptr);
  for (int i = 0; i < 14; ++i) many.panel("force [N]", "[*:*]", mean_curve("shaking.csv", "2", "F", 0), "", "a nerve");
  const std::string picture = many.run(folder.string());
  CHECK(std::filesystem::file_size(folder / picture) > 10000);
  std::ifstream in(folder / "many.gp");
  std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::size_t at = text.find("size 1500,");
  REQUIRE(at != std::string::npos);
  CHECK(std::stod(text.substr(at + 10)) < 1600);

  std::ofstream(folder / "mean.gp") << "set datafile separator ','\nset table 'mean.txt'\nplot "
                                    << mean_curve("shaking.csv", "2", "F", 0) << '\n';
  REQUIRE(std::system(("cd " + folder.string() + " && gnuplot mean.gp").c_str()) == 0);
  std::ifstream table(folder / "mean.txt");
  int curve = -1, means = 0;
  double worst = 0;
  for (std::string line; std::getline(table, line);) {
    if (line.find("# Curve title") != 0 && line.find("# Curve") == 0) ++curve;
    std::istringstream words(line);
    double time = 0, force = 0;
    if (curve != 1 || line.empty() || line[0] == '#' || !(words >> time >> force)) continue;
    ++means;
    worst = std::max(worst, std::abs(force - 1));
  }
  CHECK(means == 100);
  CHECK(worst < 0.06);  // a mean over 9 or 11 ticks has one more of either
  std::filesystem::remove_all(folder);
}

}  // namespace
