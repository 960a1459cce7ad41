// SPDX-License-Identifier: MIT
// Volumes of every density type become the programs' 16-bit levels, with the surface where it was.
#include "levels.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

using namespace drill;

namespace {

/// A ramp along z from `low` to `high`.
template <class Density>
trephine::VoxelGrid<Density> ramp(double low, double high) {
  std::vector<Density> voxels;
  for (int i = 0; i < 2 * 2 * 17; ++i) voxels.push_back(static_cast<Density>(low + (high - low) * (i / 4) / 16));
  return {{.size = {2, 2, 17}, .spacing = {2e-5, 2e-5, 2e-5}}, voxels};
}

template <class Density>
void check_own(double low, double high) {
  const auto grid = ramp<Density>(low, high);
  const LevelGrid levels = to_levels(grid);
  CHECK(levels.scale == 1);
  CHECK(levels.offset == 0);
  for (int k = 0; k < 17; ++k) CHECK(std::abs(levels.grid.at(1, 1, k) - static_cast<double>(grid.at(1, 1, k))) <= 0.5);
}

template <class Density>
void check_spread(double low, double high) {
  const auto grid = ramp<Density>(low, high);
  const LevelGrid levels = to_levels(grid);
  CHECK(levels.grid.original_range().min == -16000);
  CHECK(levels.grid.original_range().max == 16000);
  for (int k = 0; k < 17; ++k) {
    const double exact = levels.scale * static_cast<double>(grid.at(1, 1, k)) + levels.offset;
    CHECK(std::abs(levels.grid.at(1, 1, k) - exact) <= 0.5 + 1e-9);
  }
}

}  // namespace

TEST_CASE("volumes of every density type become levels of 16 bits") {
  check_own<std::int16_t>(-1024, 3071);
  check_own<std::uint8_t>(0, 255);
  check_own<std::int8_t>(-128, 127);
  check_own<std::uint16_t>(0, 32767);
  check_own<float>(-1024, 3071.5);
  check_spread<std::uint16_t>(0, 65535);
  check_spread<std::uint16_t>(30000, 40000);
  check_spread<float>(0, 0.75);
  check_spread<float>(-1e6, 1e7);
}

TEST_CASE("a volume of one density alone becomes levels, too") {
  CHECK(to_levels(ramp<float>(5, 5)).grid.at(0, 0, 0) == 5);
  CHECK(to_levels(ramp<float>(1e6, 1e6)).grid.at(0, 0, 0) >= -16000);
}
