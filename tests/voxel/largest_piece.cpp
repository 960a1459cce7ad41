// SPDX-License-Identifier: MIT
// What hangs apart from the bone, against a flood fill from voxel to voxel.
#include "support/random.hpp"

#include <trephine/voxel/density_field.hpp>
#include <trephine/voxel/largest_piece.hpp>
#include <trephine/voxel/resample.hpp>

#include <doctest/doctest.h>

#include <limits>
#include <stdexcept>

namespace {

using namespace trephine;
using namespace trephine::test;

using Voxel = std::array<int, 3>;
using Size = std::array<int, 3>;
constexpr double kIsovalue = 50;

std::size_t place(const Size& n, const Voxel& v) {
  return (static_cast<std::size_t>(v[2]) * static_cast<std::size_t>(n[1]) + static_cast<std::size_t>(v[1])) *
             static_cast<std::size_t>(n[0]) +
         static_cast<std::size_t>(v[0]);
}

bool is_in(const Size& n, const Voxel& v) {
  for (std::size_t a = 0; a < 3; ++a)
    if (v[a] < 0 || v[a] >= n[a]) return false;
  return true;
}

/// Pieces of voxels that are neighbours over a face, an edge or a corner, in the order of their first voxels.
template <class Density>
std::vector<std::vector<Voxel>> flooded(const Size& n, const std::vector<Density>& voxels) {
  std::vector<bool> seen(voxels.size());
  std::vector<std::vector<Voxel>> pieces;
  const auto take = [&](const Voxel& v) {
    if (!is_in(n, v)) return false;
    if (seen[place(n, v)] || static_cast<double>(voxels[place(n, v)]) < kIsovalue) return false;
    seen[place(n, v)] = true;
    return true;
  };
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        if (!take({i, j, k})) continue;
        std::vector<Voxel> piece{{i, j, k}};
        for (std::size_t next = 0; next < piece.size(); ++next) {
          const Voxel at = piece[next];
          for (int d = 0; d < 27; ++d) {
            const Voxel beside{at[0] + d % 3 - 1, at[1] + d / 3 % 3 - 1, at[2] + d / 9 - 1};
            if (take(beside)) piece.push_back(beside);
          }
        }
        pieces.push_back(std::move(piece));
      }
  return pieces;
}

template <class Density>
std::vector<Density> copied(const VoxelGrid<Density>& grid) {
  const Size& n = grid.size();
  std::vector<Density> voxels(place(n, {0, 0, n[2]}));
  grid.copy_voxels(voxels);
  return voxels;
}

}  // namespace

TEST_CASE_TEMPLATE("largest piece: what a flood fill from voxel to voxel keeps, and nothing else changes", Density,
                   std::uint8_t, std::int8_t, std::uint16_t, std::int16_t, float) {
  Random random(4401);
  for (int round = 0; round < 60; ++round) {
    CAPTURE(round);
    const Size n{1 + random.below(20), 1 + random.below(12), 1 + random.below(9)};
    const double share = random.uniform(0.02, 0.5);
    std::vector<Density> voxels(place(n, {0, 0, n[2]}));
    for (Density& v : voxels)
      v = static_cast<Density>(random.uniform() < share ? random.uniform(51, 100) : random.uniform(1, 49));
    voxels.front() = 0;  // outside is the smallest
    const auto pieces = flooded(n, voxels);
    std::size_t kept = 0, count = 0;
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      count += pieces[p].size();
      if (pieces[p].size() > pieces[kept].size()) kept = p;
    }
    // Voxels beside removed bone are air, unless they lie beside the kept bone too.
    std::vector<Density> expected = voxels;
    const auto beside = [&](bool of_kept, const auto& visit) {
      for (std::size_t p = 0; p < pieces.size(); ++p)
        for (const Voxel& v : pieces[p])
          for (int d = 0; d < 27 && (p == kept) == of_kept; ++d) {
            const Voxel at{v[0] + d % 3 - 1, v[1] + d / 3 % 3 - 1, v[2] + d / 9 - 1};
            if (is_in(n, at)) visit(place(n, at));
          }
    };
    beside(false, [&](std::size_t at) { expected[at] = 0; });
    beside(true, [&](std::size_t at) { expected[at] = voxels[at]; });

    VoxelGrid<Density> grid({.size = n, .spacing = Vec3d(1e-3, 2e-3, 3e-3)}, voxels);
    const RemovedPieces removed = keep_largest_piece(grid, kIsovalue);
    CHECK(removed.pieces == (pieces.empty() ? 0 : pieces.size() - 1));
    CHECK(removed.voxels == (pieces.empty() ? 0 : count - pieces[kept].size()));
    CHECK(copied(grid) == expected);
    CHECK(keep_largest_piece(grid, kIsovalue).pieces == 0);
  }
}

TEST_CASE("largest piece: the surface that is kept stays as it was, to the bit") {
  Random random(4402);
  const Size n{30, 30, 30};
  std::vector<std::int16_t> voxels(place(n, {0, 0, n[2]}));
  // A ball, and specks in the air round it down to two voxels off.
  const Vec3d middle(14.2, 15.1, 14.7);
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double d = (Vec3d(i, j, k) - middle).norm() - 8;
        const bool speck = d > 2 && random.uniform() < 0.01;
        voxels[place(n, {i, j, k})] =
            static_cast<std::int16_t>(speck ? 900 : std::clamp(300 - 400 * d, -1000.0, 1200.0));
      }
  const VoxelGrid<std::int16_t> before({.size = n, .spacing = Vec3d::Constant(1e-3)}, voxels);
  VoxelGrid<std::int16_t> after({.size = n, .spacing = Vec3d::Constant(1e-3)}, voxels);
  CHECK(keep_largest_piece(after, 300).pieces > 20);
  const DensityField<std::int16_t, double> was(before, 300), is(after, 300);
  int bone = 0, specks = 0;
  for (int t = 0; t < 200000; ++t) {
    const Vec3d u(random.uniform(0, 29), random.uniform(0, 29), random.uniform(0, 29));
    const double d = (u - middle).norm() - 8, value = is.value(Vec3d(1e-3 * u));
    if (d < 0.5) bone += value >= 0 && value == was.value(Vec3d(1e-3 * u)) ? 1 : value >= 0 ? -1000000 : 0;
    if (d > 1) specks += value >= 0 ? 1 : 0;
  }
  CHECK(bone > 10000);
  CHECK(specks == 0);
}

TEST_CASE("largest piece: nothing of a removed rod comes back in finer voxels") {
  const Size n{40, 30, 24};
  std::vector<std::int16_t> voxels(place(n, {0, 0, n[2]}));
  // A ball, and a rod beside it with a skin a voxel thick, just below the isovalue.
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i) {
        const double to_ball = (Vec3d(i, j, k) - Vec3d(12, 14, 12)).norm() - 8;
        const double to_rod = (Vec3d(i, j, 0) - Vec3d(31.3, 14.6, 0)).norm() - 3;
        voxels[place(n, {i, j, k})] = std::min(to_ball, to_rod) < 0 ? std::int16_t{1200}
                                      : to_rod < 1                  ? std::int16_t{295}
                                                                    : std::int16_t{-1000};
      }
  VoxelGrid<std::int16_t> grid({.size = n, .spacing = Vec3d::Constant(1e-3)}, voxels);
  CHECK(keep_largest_piece(grid, 300).pieces == 1);
  const auto fine = resampled(grid, Vec3d::Constant(0.4e-3));
  const VoxelBox box = fine.occupied_box(300);
  CHECK(box.hi[0] < 22 / 0.4);
}

TEST_CASE("largest piece: the grid keeps its place and its memory, and restore brings no piece back") {
  std::vector<float> voxels(6 * 5 * 4, 0);
  voxels[place({6, 5, 4}, {1, 1, 1})] = voxels[place({6, 5, 4}, {2, 2, 2})] = 1;  // over a corner
  voxels[place({6, 5, 4}, {5, 4, 3})] = 1;
  Posed X_WG = Posed::Identity();
  X_WG.translation() = Vec3d(0.1, 0.2, 0.3);
  for (const bool keeps : {false, true}) {
    const double isovalue = keeps ? 1 : 0.5;  // of a mask, just its bone's density too
    VoxelGrid<float> grid({.size = {6, 5, 4}, .spacing = Vec3d::Constant(1e-3), .X_WG = X_WG, .outside = -2}, voxels,
                          {.keep_original = keeps});
    const RemovedPieces removed = keep_largest_piece(grid, isovalue);
    CHECK(removed.pieces == 1);
    CHECK(removed.voxels == 1);
    CHECK(grid.at(5, 4, 3) == -2);
    CHECK(grid.at(2, 2, 2) == 1);
    CHECK(grid.outside() == -2);
    CHECK(grid.keeps_original() == keeps);
    CHECK(grid.X_WG().isApprox(X_WG, 0));
    if (keeps) grid.restore();
    CHECK(grid.at(5, 4, 3) == -2);
  }
}

TEST_CASE("largest piece: of equals the first stays, bone without end is refused") {
  std::vector<std::uint8_t> voxels(9, 0);
  voxels[2] = voxels[6] = 80;
  VoxelGrid<std::uint8_t> grid({.size = {9, 1, 1}, .spacing = Vec3d::Constant(1e-3)}, voxels);
  CHECK(keep_largest_piece(grid, kIsovalue).pieces == 1);
  CHECK(grid.at(2, 0, 0) == 80);
  CHECK(grid.at(6, 0, 0) == 0);
  CHECK_THROWS_AS((void)keep_largest_piece(grid, std::numeric_limits<double>::quiet_NaN()), std::invalid_argument);
  CHECK_THROWS_AS((void)keep_largest_piece(grid, 0), std::invalid_argument);
}
