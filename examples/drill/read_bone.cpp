// SPDX-License-Identifier: MIT
#include "bone.hpp"
#include "read_itk.hpp"
#include "skull_file.hpp"

#include <array>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

namespace drill {
namespace {

constexpr double kBoneHU = 300;  // below the densest soft tissue and contrast-free vessels, above most of the marrow

Bone skull(const Options& options) {
  Grid grid = read_skull(options.skull);
  const double isovalue = options.isovalue.value_or(kBoneHU);
  const std::vector<std::string> notes{
      "the file does not record which side is left; its rows are turned to make a right-handed volume"};
  return {.name = "skull", .unit = "HU", .grid = std::move(grid), .isovalue = isovalue, .burr = {}, .notes = notes};
}

Bone ct(const Options& options) {
#ifdef TREPHINE_EXAMPLE_HAS_ITK
  auto [grid, scale, offset] = read_ct(options.ct, options.series);
  const auto range = grid.original_range();
  // Air at -1000 says that these are Hounsfield units; elsewhere half way is as good a guess as any.
  const bool own_densities = scale == 1 && offset == 0;
  const bool hounsfield = own_densities && range.min <= -500;
  const double half_way = std::floor(0.5 * (range.min + range.max)) + 0.5;
  std::vector<std::string> notes;
  if (!own_densities) {
    std::array<char, 160> text{};
    std::snprintf(text.data(), text.size(),
                  "densities are %g to %g; they are drilled as levels, %g times a density plus %g (--isovalue takes a "
                  "density)",
                  (range.min - offset) / scale, (range.max - offset) / scale, scale, offset);
    notes.emplace_back(text.data());
  }
  if (!hounsfield && !options.isovalue) {
    std::array<char, 128> text{};
    std::snprintf(text.data(), text.size(),
                  "densities are %g to %g, no Hounsfield units; isovalue %g is a guess (--isovalue)",
                  (range.min - offset) / scale, (range.max - offset) / scale, (half_way - offset) / scale);
    notes.emplace_back(text.data());
  }
  std::filesystem::path path(options.ct);
  if (!path.has_filename()) path = path.parent_path();
  return {.name = path.filename().string(),
          .unit = hounsfield ? "HU" : "of the file's densities",
          .grid = std::move(grid),
          .isovalue = options.isovalue ? scale * *options.isovalue + offset
                      : hounsfield     ? kBoneHU
                                       : half_way,
          .burr = {},
          .notes = notes,
          .scale = scale,
          .offset = offset};
#else
  throw std::runtime_error("--ct " + options.ct +
                           ": this build cannot read it, ITK is missing (Debian: libinsighttoolkit5-dev); build again "
                           "with it, or use --skull");
#endif
}

}  // namespace

Bone load_bone(const Options& options) {
  if (!options.skull.empty()) return fitted(skull(options), options);
  if (!options.ct.empty()) return fitted(ct(options), options);
  return made_bone(options);
}

}  // namespace drill
