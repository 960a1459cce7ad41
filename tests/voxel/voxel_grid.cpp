// SPDX-License-Identifier: MIT
#include "support/check_refused.hpp"
#include "support/malloc_hook.hpp"
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <doctest/doctest.h>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 555;
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();

bool holds(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

std::string refusal_of(const GridGeometry& geometry, std::size_t count) {
  return refusal([&] { VoxelGrid<std::uint8_t>(geometry, std::vector<std::uint8_t>(count)); });
}

template <VoxelDensity Density>
void check_bricks(const VoxelGrid<Density>& grid) {
  for (std::size_t b = 0; b < grid.brick_count(); ++b) {
    const auto slow = slow_range(grid, b);
    const auto range = grid.brick_range(b);
    CAPTURE(b);
    CHECK(range.min == slow.min);
    CHECK(range.max == slow.max);
  }
}

/// Bricks whose halo holds a voxel that differs between two states.
template <VoxelDensity Density>
std::vector<bool> bricks_to_mark(const VoxelGrid<Density>& grid, const std::vector<Density>& before) {
  const auto after = copy_of(grid);
  std::vector<bool> mark(grid.brick_count(), false);
  std::size_t n = 0;
  for (int k = 0; k < grid.size()[2]; ++k)
    for (int j = 0; j < grid.size()[1]; ++j)
      for (int i = 0; i < grid.size()[0]; ++i, ++n) {
        if (before[n] == after[n]) continue;
        for (std::size_t b = 0; b < grid.brick_count(); ++b) {
          const auto at = grid.brick_coordinates(b);
          const std::array voxel{i, j, k};
          bool near = true;
          for (std::size_t a = 0; a < 3; ++a) near = near && voxel[a] >= at[a] * 8 - 1 && voxel[a] <= at[a] * 8 + 8;
          if (near) mark[b] = true;
        }
      }
  return mark;
}

}  // namespace

TEST_CASE("Construction refuses what does not fit, and says what") {
  const GridGeometry good{.size = {4, 3, 2}, .spacing = {1e-3, 2e-3, 3e-3}};
  CHECK(refusal_of(good, 24) == "");
  GridGeometry g = good;
  for (const int n : {0, -1, std::numeric_limits<int>::min()}) {
    g.size = {4, n, 2};
    CHECK(refusal_of(g, 24) == "trephine::VoxelGrid: each size must be >= 1 voxel, got " + std::to_string(n));
  }
  g.size = {(1 << 20) + 1, 1, 1};
  CHECK(holds(refusal_of(g, 24), "at most 2^20 voxels"));
  g.size = {1 << 11, 1 << 11, 1 << 9};
  CHECK(holds(refusal_of(g, 24), "at most 2^31 voxels fit"));
  g.size = {1 << 20, 1 << 20, 1 << 20};
  CHECK(holds(refusal_of(g, 24), "at most 2^31 voxels fit"));
  g = good;
  for (const double h : {0.0, -0.5, kNan, -kInf}) {
    g.spacing = {1e-3, h, 1e-3};
    CHECK(holds(refusal_of(g, 24), "trephine::VoxelGrid: spacing must be > 0 m, got "));
  }
  for (const double h : {1e-10, 1e-320}) {
    g.spacing = {1e-3, 1e-3, h};
    CHECK(holds(refusal_of(g, 24), "spacing must be at least 1 nm, got "));
  }
  for (const double h : {kInf, 0.021, 1e4}) {
    g.spacing = {1e-3, 1e-3, h};
    CHECK(holds(refusal_of(g, 24), "spacing must be at most 0.02 m (did you mean "));
  }
  g.spacing = {0.5, 0.5, 0.5};
  CHECK(
      holds(refusal_of(g, 24), "trephine::VoxelGrid: spacing must be at most 0.02 m (did you mean 0.5_mm?), got 0.5"));
  g = good;
  g.X_WG.linear() *= 1.01;
  CHECK(holds(refusal_of(g, 24), "X_WG must hold a right-handed rotation"));
  g.X_WG.linear() = Vec3d(1, 1, -1).asDiagonal();
  CHECK(holds(refusal_of(g, 24), "X_WG must hold a right-handed rotation"));
  g.X_WG.linear()(0, 0) = kNan;
  CHECK(holds(refusal_of(g, 24), "X_WG must hold a right-handed rotation"));
  g = good;
  for (const double x : {kNan, kInf, 2e3}) {
    g.X_WG.translation().x() = x;
    CHECK(holds(refusal_of(g, 24), "X_WG must lie within 1 km of the origin"));
  }
  CHECK(refusal_of(good, 23) == "trephine::VoxelGrid: the buffer must hold 24 voxels, got 23");
  CHECK(refusal_of(good, 0) == "trephine::VoxelGrid: the buffer must hold 24 voxels, got 0");
  g = good;
  for (const double outside : {-1.0, 256.0, kNan, kInf}) {
    g.outside = outside;
    CHECK(holds(refusal_of(g, 24), "outside density must be in the density type's range"));
  }
  g.outside = 0.5;
  CHECK(holds(refusal_of(g, 24), "outside density must be a whole number"));
  const auto of_floats = [&](float v, std::optional<double> outside = {}) {
    GridGeometry geometry = good;
    geometry.outside = outside;
    std::vector<float> voxels(24, 1.0F);
    voxels[17] = v;
    return refusal([&] { VoxelGrid<float>(geometry, voxels); });
  };
  for (const float v : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), -2e30F})
    CHECK(holds(of_floats(v), "trephine::VoxelGrid: densities must be finite and below 1e30, got "));
  CHECK(holds(of_floats(0, 1e35), "densities must be finite and below 1e30"));
  CHECK(of_floats(0, 0.1) == "");
}

TEST_CASE("Other calls refuse too, and leave the grid as it was") {
  std::mt19937 rng(kSeed);
  auto grid =
      random_grid<std::int16_t>({.size = {5, 4, 3}, .spacing = Vec3d::Constant(1e-3)}, rng, {.keep_original = false});
  Posed bad = Posed::Identity();
  bad.linear()(0, 0) = 2;
  CHECK(holds(refusal([&] { grid.set_X_WG(bad); }), "X_WG must hold a right-handed rotation"));
  CHECK(grid.X_WG().matrix() == Posed::Identity().matrix());
  const Posed good = make_pose<double>(random_rotation(rng), {0.1, 0.2, 0.3});
  grid.set_X_WG(good);
  CHECK(grid.X_WG().matrix() == good.matrix());
  std::vector<std::int16_t> small(59);
  CHECK(refusal([&] { grid.copy_voxels(small); }) ==
        "trephine::VoxelGrid: copy_voxels needs room for 60 voxels, got 59");
  CHECK(holds(refusal([&] { grid.restore(); }), "restore() needs GridOptions::keep_original"));
  CHECK(holds(refusal([&] { grid.take(grid); }), "take() needs GridOptions::keep_original"));
  CHECK(holds(refusal([&] { (void)grid.cropped(0, -1); }), "crop margin must be >= 0 voxels, got -1"));
  CHECK(holds(refusal([&] { (void)grid.cropped(1e6); }), "no voxel reaches the isovalue (densities "));
  CHECK(holds(refusal([&] { (void)grid.cropped(kNan); }), "no voxel reaches the isovalue"));
  CHECK(holds(refusal([&] {
                (void)grid.cropped(VoxelBox{{-5, 0, 0}, {-1, 1, 1}});
              }),
              "a box to crop to must have voxels of the grid along every axis, got -5 to -1"));
}

TEST_CASE_TEMPLATE("A grid holds its buffer, its border and its range", Density, std::uint8_t, std::int8_t,
                   std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 1);
  // 254 + 2 and 62 + 2 voxels: pitches that the layout steps off.
  for (const std::array<int, 3>& size :
       {std::array{1, 1, 1}, std::array{7, 9, 17}, std::array{254, 3, 2}, std::array{62, 30, 2}}) {
    std::vector<Density> voxels(static_cast<std::size_t>(size[0] * size[1] * size[2]));
    for (auto& v : voxels) v = random_density<Density>(rng);
    const VoxelGrid<Density> grid({.size = size, .spacing = Vec3d::Constant(1e-3), .outside = 1}, voxels);
    CHECK(copy_of(grid) == voxels);
    const auto range = std::minmax_element(voxels.begin(), voxels.end());
    CHECK(grid.original_range().min == *range.first);
    CHECK(grid.original_range().max == *range.second);
    bool border = true;
    for (int k = -1; k <= size[2]; ++k)
      for (int j = -1; j <= size[1]; ++j)
        for (int i = -1; i <= size[0]; ++i)
          if (!grid.contains(i, j, k)) border = border && grid.at(i, j, k) == Density(1);
    CHECK(border);
    check_bricks(grid);
    for (std::size_t b = 0; b < grid.brick_count(); ++b) {
      const auto at = grid.brick_coordinates(b);
      CHECK(grid.brick_index(at[0], at[1], at[2]) == b);
    }
  }
}

TEST_CASE("Beyond the grid it is its own smallest density unless told otherwise") {
  const std::vector<std::int16_t> voxels{-900, 5, 3, 1200};
  const VoxelGrid<std::int16_t> grid({.size = {2, 2, 1}, .spacing = Vec3d::Constant(1e-3)}, voxels);
  CHECK(grid.outside() == -900);
  CHECK(grid.at(-1, 0, 0) == -900);
}

TEST_CASE("The occupied box holds exactly the voxels at or above the isovalue") {
  auto geometry = GridGeometry{.size = {9, 10, 11}, .spacing = Vec3d::Constant(1e-3), .outside = 0};
  const auto grid = make_grid<std::uint8_t>(geometry, [](int i, int j, int k) {
    return (i == 2 && j == 3 && k == 8) || (i == 6 && j == 4 && k == 8) ? 100 : 20;
  });
  const VoxelBox box = grid.occupied_box(100);
  CHECK(box.lo == std::array{2, 3, 8});
  CHECK(box.hi == std::array{6, 4, 8});
  CHECK(grid.occupied_box(100.5).empty());
  CHECK(grid.occupied_box(kNan).empty());
  CHECK(grid.occupied_box(20).lo == std::array{0, 0, 0});
  CHECK(grid.occupied_box(20).hi == std::array{8, 9, 10});
}

TEST_CASE("A cropped grid is the same field at the same place") {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 2);
  const Vec3d h(3e-4, 4e-4, 9e-4);
  const Posed X_WG = make_pose<double>(random_rotation(rng), {0.3, -0.2, 0.1});
  const auto grid = make_grid<std::int16_t>(
      {.size = {24, 20, 16}, .spacing = h, .X_WG = X_WG, .outside = -1000}, [&](int i, int j, int k) {
        const bool bone = i >= 6 && i <= 14 && j >= 5 && j <= 12 && k >= 4 && k <= 13;
        return bone ? 500 + static_cast<int>(rng() % 300) : static_cast<int>(rng() % 200) - 1000;
      });
  const auto crop = grid.cropped(400, 3);
  CHECK(crop.size() == std::array{9 + 6, 8 + 6, 10 + 5});  // the far z margin meets the grid's end
  CHECK(crop.outside() == grid.outside());
  // Voxel for voxel the same bits ...
  bool same = true;
  for (int k = 0; k < crop.size()[2]; ++k)
    for (int j = 0; j < crop.size()[1]; ++j)
      for (int i = 0; i < crop.size()[0]; ++i) same = same && crop.at(i, j, k) == grid.at(i + 3, j + 2, k + 1);
  CHECK(same);
  // ... and the field at the same place in the world, within the outer voxels.
  const DensityField<std::int16_t, double> field(grid, 400);
  const DensityField<std::int16_t, double> cropped(crop, 400);
  const Vec3d last = h.cwiseProduct(Vec3d(crop.size()[0] - 1, crop.size()[1] - 1, crop.size()[2] - 1));
  for (int n = 0; n < 500; ++n) {
    const Vec3d p_W = crop.X_WG() * random_point(rng, Vec3d::Zero(), last);
    CHECK(std::abs(cropped.value(crop.X_WG().inverse() * p_W) - field.value(X_WG.inverse() * p_W)) < 1.5e-9);
  }
}

TEST_CASE_TEMPLATE("Rows are lowered, never raised; ranges, gradients and marks follow exactly", Density, std::uint8_t,
                   std::int8_t, std::uint16_t, std::int16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 3);
  const std::array size{37, 21, 18};
  auto grid = random_grid<Density>({.size = size, .spacing = Vec3d::Constant(1e-3)}, rng);
  GridReader<Density> reader(grid, false);
  for (int edit = 0; edit < 60; ++edit) {
    const auto before = copy_of(grid);
    auto expected = before;
    const int rows = 1 + static_cast<int>(rng() % 4);
    for (int r = 0; r < rows; ++r) {
      const int j = static_cast<int>(rng() % 21);
      const int k = static_cast<int>(rng() % 18);
      int x0 = static_cast<int>(rng() % 37);
      int x1 = static_cast<int>(rng() % 37);
      if (x1 < x0) std::swap(x0, x1);
      std::vector<Density> wish(37);
      for (auto& w : wish) w = random_density<Density>(rng);
      int lowered = 0;
      for (int i = x0; i <= x1; ++i) {
        auto& v = expected[static_cast<std::size_t>((k * 21 + j) * 37 + i)];
        if (wish[static_cast<std::size_t>(i)] < v) {
          v = wish[static_cast<std::size_t>(i)];
          ++lowered;
        }
      }
      CHECK(grid.lower_row(j, k, x0, x1, [&](int i, Density) { return wish[static_cast<std::size_t>(i)]; }) == lowered);
    }
    grid.commit();
    CHECK(copy_of(grid) == expected);
    std::vector<bool> marked(grid.brick_count(), false);
    reader.poll([&](std::size_t b) { marked[b] = true; });
    CHECK(marked == bricks_to_mark(grid, before));
  }
  check_bricks(grid);
}

TEST_CASE("A row across bricks gives each its own part's range") {
  auto grid = make_grid<std::int16_t>({.size = {37, 9, 9}, .spacing = Vec3d::Constant(1e-3), .outside = 900},
                                      [](int, int, int) { return 500; });
  // Lowest in the middle brick, higher to both sides.
  grid.lower_row(4, 8, 0, 36, [](int i, std::int16_t) { return static_cast<std::int16_t>(10 * std::abs(i - 19)); });
  grid.commit();
  check_bricks(grid);
  CHECK(grid.brick_range(grid.brick_index(0, 0, 0)).min == 110);  // x = 8 and z = 8 are in its halo
  CHECK(grid.brick_range(grid.brick_index(2, 0, 1)).min == 0);
  CHECK(grid.brick_range(grid.brick_index(4, 0, 1)).min == 120);
  CHECK(grid.brick_range(grid.brick_index(4, 1, 1)).min == 500);
}

TEST_CASE("NaN lowers nothing") {
  auto grid =
      make_grid<float>({.size = {20, 1, 1}, .spacing = Vec3d::Constant(1e-3)}, [](int i, int, int) { return i; });
  const auto before = copy_of(grid);
  CHECK(grid.lower_row(0, 0, 0, 19, [](int, float) { return std::numeric_limits<float>::quiet_NaN(); }) == 0);
  grid.commit();
  CHECK(copy_of(grid) == before);
}

TEST_CASE_TEMPLATE("a grid takes the densities of its copies, and tells its readers", Density, std::uint8_t,
                   std::int16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 5);
  auto grid = random_grid<Density>({.size = {33, 17, 25}, .spacing = Vec3d::Constant(1e-3)}, rng);
  const auto original = copy_of(grid);
  const auto drill = [&](VoxelGrid<Density>& g) {
    for (int n = 0; n < 3; ++n) {
      const int x = static_cast<int>(rng() % 25);
      g.lower_row(static_cast<int>(rng() % 17), static_cast<int>(rng() % 25), x, x + 7,
                  [&](int, Density) { return random_density<Density>(rng); });
    }
    g.commit();
  };
  drill(grid);
  std::vector<VoxelGrid<Density>> copies;
  copies.push_back(grid.copy());
  CHECK(copy_of(copies[0]) == copy_of(grid));
  CHECK(copies[0].increase_stamp() != grid.increase_stamp());
  copies.push_back(copies[0].copy());
  GridReader<Density> reader(grid, false);
  for (int n = 0; n < 30; ++n) {
    for (auto& copy : copies) drill(copy);
    drill(grid);
    if (n % 5 == 0) copies[rng() % 2].restore(rng() % 3);
    reader.poll([](std::size_t) {});
    const auto before = copy_of(grid);
    const auto& from = copies[rng() % 2];
    const auto stamp = grid.increase_stamp();
    grid.take(from);
    CHECK(copy_of(grid) == copy_of(from));
    CHECK(grid.increase_stamp() != stamp);
    const auto must = bricks_to_mark(grid, before);
    std::vector<bool> marked(grid.brick_count(), false);
    reader.poll([&](std::size_t b) { marked[b] = true; });
    for (std::size_t b = 0; b < must.size(); ++b) CHECK((marked[b] || !must[b]));
    check_bricks(grid);
  }
  // Each goes back to the same original.
  CHECK(grid.restore() == 0);
  CHECK(copies[1].restore() == 0);
  CHECK(copy_of(grid) == original);
  CHECK(copy_of(copies[1]) == original);
  const Posed moved = make_pose<double>(random_rotation(rng), {0.1, 0.2, 0.3});
  copies[0].set_X_WG(moved);
  grid.take(copies[0]);
  CHECK(grid.X_WG().matrix() == moved.matrix());
  const auto other = random_grid<Density>({.size = {33, 17, 25}, .spacing = Vec3d::Constant(1e-3)}, rng);
  CHECK(holds(refusal([&] { grid.take(other); }), "take() needs a copy of this grid"));
}

TEST_CASE_TEMPLATE("restore() brings back every bit, brick by brick", Density, std::uint8_t, std::int16_t, float) {
  CAPTURE(kSeed);
  std::mt19937 rng(kSeed + 4);
  auto grid = random_grid<Density>({.size = {33, 17, 25}, .spacing = Vec3d::Constant(1e-3)}, rng);
  const auto original = copy_of(grid);
  GridReader<Density> reader(grid, false);
  CHECK(grid.restore() == 0);
  CHECK(reader.poll([](std::size_t) {}) == 0);
  for (int n = 0; n < 40; ++n)
    grid.lower_row(static_cast<int>(rng() % 17), static_cast<int>(rng() % 25), 0, 32,
                   [&](int, Density) { return random_density<Density>(rng); });
  grid.commit();
  REQUIRE(copy_of(grid) != original);
  reader.poll([](std::size_t) {});
  std::size_t left = grid.restore(0);
  CHECK(left > 10);
  CHECK(reader.poll([](std::size_t) {}) == 0);
  int calls = 0;
  std::int64_t heap = 0;
  while (left > 0) {
    const auto before = copy_of(grid);
    std::size_t now = 0;
    heap += heap_calls([&] { now = grid.restore(3); });
    CHECK(now == (left > 3 ? left - 3 : 0));
    left = now;
    ++calls;
    const auto must = bricks_to_mark(grid, before);
    std::vector<bool> marked(grid.brick_count(), false);
    reader.poll([&](std::size_t b) { marked[b] = true; });
    for (std::size_t b = 0; b < must.size(); ++b) CHECK((marked[b] || !must[b]));
    check_bricks(grid);
  }
  CHECK(heap == 0);
  CHECK(calls > 3);
  CHECK(copy_of(grid) == original);
}
