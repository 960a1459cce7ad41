// SPDX-License-Identifier: MIT
#include "support/malloc_hook.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/grid_reader.hpp>

#include <doctest/doctest.h>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 99;

VoxelGrid<std::uint8_t> solid() {
  return make_grid<std::uint8_t>({.size = {20, 17, 9}, .spacing = {1e-3, 2e-3, 3e-3}, .outside = 7},
                                 [](int, int, int) { return 200; });
}

void lower_voxel(VoxelGrid<std::uint8_t>& grid, int i, int j, int k, std::uint8_t to) {
  grid.lower_row(j, k, i, i, [&](int, std::uint8_t) { return to; });
}

template <VoxelDensity Density>
std::vector<std::size_t> changed(GridReader<Density>& reader) {
  std::vector<std::size_t> bricks;
  const auto count = reader.poll([&](std::size_t b) { bricks.push_back(b); });
  CHECK(count == bricks.size());
  return bricks;
}

}  // namespace

TEST_CASE("The first poll names all bricks, or none") {
  const auto grid = solid();
  GridReader<std::uint8_t> all(grid);
  GridReader<std::uint8_t> none(grid, false);
  CHECK(all.brick_count() == 3 * 3 * 2);
  CHECK(changed(all).size() == 18);
  CHECK(changed(all).empty());
  CHECK(changed(none).empty());
  CHECK(all.size() == grid.size());
  CHECK(all.spacing() == grid.spacing());
  CHECK(all.brick_coordinates(17) == std::array{2, 2, 1});
}

TEST_CASE("A view names what changed since it last looked, once, at commit") {
  auto grid = solid();
  GridReader<std::uint8_t> often(grid, false);
  GridReader<std::uint8_t> seldom(grid, false);
  lower_voxel(grid, 3, 4, 4, 100);  // inside brick 0, away from its faces
  CHECK(changed(often).empty());    // not yet committed
  grid.commit();
  CHECK(changed(often) == std::vector<std::size_t>{0});
  CHECK(changed(often).empty());
  lower_voxel(grid, 3, 4, 4, 100);  // nothing lower
  grid.commit();
  CHECK(changed(often).empty());
  lower_voxel(grid, 7, 4, 4, 100);  // first brick's last voxel in x: in the second one's halo
  grid.commit();
  CHECK(changed(often) == std::vector<std::size_t>{0, 1});
  lower_voxel(grid, 8, 8, 8, 50);  // in the halo of the seven bricks before its own
  grid.commit();
  CHECK(changed(often) == std::vector<std::size_t>{0, 1, 3, 4, 9, 10, 12, 13});
  lower_voxel(grid, 19, 16, 8, 1);
  grid.commit();
  // Its own brick (2, 2, 1); voxel 16 lies in brick (·, 1)'s halo, voxel 8 in brick (·, ·, 0)'s.
  CHECK(changed(often) == std::vector<std::size_t>{5, 8, 14, 17});
  CHECK(changed(seldom) == std::vector<std::size_t>{0, 1, 3, 4, 5, 8, 9, 10, 12, 13, 14, 17});
  CHECK(changed(seldom).empty());
}

TEST_CASE("An edit made while a brick is visited is named by the next poll") {
  auto grid = solid();
  GridReader<std::uint8_t> reader(grid, false);
  lower_voxel(grid, 3, 3, 3, 150);
  grid.commit();
  int visits = 0;
  const auto visit = [&](std::size_t) {
    if (visits++ > 0) return;
    lower_voxel(grid, 4, 4, 4, 140);
    grid.commit();
  };
  CHECK(reader.poll(visit) == 1);
  CHECK(reader.poll(visit) == 1);
  CHECK(reader.poll(visit) == 0);
}

TEST_CASE("A brick's copy has its halo, and outside beyond the border") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed);
  const auto grid =
      random_grid<std::int16_t>({.size = {21, 8, 15}, .spacing = Vec3d::Constant(1e-3), .outside = -77}, rng);
  const GridReader<std::int16_t> reader(grid);
  constexpr int kHaloed = GridReader<std::int16_t>::kHaloed;
  std::vector<std::int16_t> copy(kHaloed * kHaloed * kHaloed);
  for (std::size_t b = 0; b < grid.brick_count(); ++b) {
    const auto at = grid.brick_coordinates(b);
    DensityRange<std::int16_t> range{};
    const auto heap =
        heap_calls([&] { range = reader.copy_brick(b, std::span<std::int16_t, 1000>(copy.data(), 1000)); });
    CHECK(heap == 0);
    bool same = true;
    for (int k = 0; k < kHaloed; ++k)
      for (int j = 0; j < kHaloed; ++j)
        for (int i = 0; i < kHaloed; ++i) {
          const double is = copy[static_cast<std::size_t>((k * kHaloed + j) * kHaloed + i)];
          same = same && is == density_at(grid, at[0] * 8 + i - 1, at[1] * 8 + j - 1, at[2] * 8 + k - 1);
        }
    CHECK(same);
    const auto exact = std::minmax_element(copy.begin(), copy.end());
    CHECK(range.min == *exact.first);
    CHECK(range.max == *exact.second);
    CHECK(reader.brick_range(b).min == grid.brick_range(b).min);
    CHECK(reader.brick_range(b).max == grid.brick_range(b).max);
  }
  CHECK(reader.voxel(-1, 3, 3) == -77);
  CHECK(reader.voxel(20, 7, 14) == grid.at(20, 7, 14));
}

TEST_CASE("Polling takes no memory") {
  auto grid = solid();
  GridReader<std::uint8_t> reader(grid);
  std::size_t sum = 0;
  const auto heap = heap_calls([&] { reader.poll([&](std::size_t b) { sum += b; }); });
  CHECK(heap == 0);
  CHECK(sum == 17 * 18 / 2);
}
