// SPDX-License-Identifier: MIT
#include "voxel/sampled_fields.hpp"

#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/shapes/drill_bit.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <doctest/doctest.h>

#include <cstring>

using namespace trephine;
using namespace trephine::test;

// The cut as its documentation has it, a voxel at a time and over all of them, against the one that is fast: the same
// bits in every voxel, the volume that all of the grid's cells lose, and of bricks, ranges, versions and the edit's box
// what a look at all voxels says.
namespace {

constexpr unsigned kSeed = 20240;
constexpr double kVoxel = 3e-4;

template <VoxelDensity Density>
std::vector<Density> voxels_of(const VoxelGrid<Density>& grid) {
  const auto& n = grid.size();
  std::vector<Density> v(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                         static_cast<std::size_t>(n[2]));
  grid.copy_voxels(v);
  return v;
}

/// ρ ← min(ρ, what the policy allows toward iso + slope d/h), for each voxel nearer than the reach, along x from where
/// its row enters the cutter's span, as the lanes count.
template <VoxelDensity Density, Cutter C, class Limit>
void plain_cut(const VoxelGrid<Density>& grid, std::vector<Density>& voxels, double iso, double slope, const C& cutter,
               const Limit& limit) {
  const Vec3d& h = grid.spacing();
  const auto& n = grid.size();
  const double reach = cut_reach(h);
  const auto reach_f = static_cast<float>(reach);
  const trephine::detail::NearestDensity<Density> nearest;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j) {
      RowLanes y;
      y.fill(j * h.y() - cutter.origin().y());
      const double z = k * h.z() - cutter.origin().z();
      RowSpans span;
      cutter.rows(y, z, reach, span);
      if (!(span.lo[0] <= span.hi[0])) continue;
      const double from = (span.lo[0] + cutter.origin().x()) / h.x();
      const double to = (span.hi[0] + cutter.origin().x()) / h.x();
      const int first = from < 0 ? 0 : static_cast<int>(std::min(from, 1e6)) + 1;
      for (int i = first; i < n[0] && i <= to; ++i) {
        const int lane = (i - first) % kCutLanes;
        CutLanes d;
        cutter.distances(static_cast<float>((i - lane) * h.x() - cutter.origin().x()), static_cast<float>(h.x()),
                         static_cast<float>(y[0]), static_cast<float>(z), d);
        const float at = d[static_cast<std::size_t>(lane)];
        if (!(at < reach_f)) continue;
        Density& voxel = voxels[static_cast<std::size_t>((k * n[1] + j) * n[0] + i)];
        CutLanes share, farthest;
        farthest.fill((static_cast<float>(voxel) - static_cast<float>(iso)) *
                      (1 / static_cast<float>(slope / h.maxCoeff())));
        cutter.shares(static_cast<float>((i - lane) * h.x() - cutter.origin().x()), static_cast<float>(h.x()),
                      static_cast<float>(y[0]), static_cast<float>(z), reach_f, farthest, share);
        const auto index = static_cast<std::uint32_t>(grid.index(i, j, k));
        const float deep = std::max(at, -static_cast<float>(ramp_depth(h)));
        const auto target = nearest(static_cast<float>(iso) + deep * static_cast<float>(slope / h.maxCoeff()));
        const auto value = static_cast<Density>(
            limit(static_cast<WideDensity<Density>>(voxel), target, share[static_cast<std::size_t>(lane)], index));
        if (value < voxel) voxel = value;
      }
    }
}

/// Bone of all cells [mm³].
template <VoxelDensity Density>
double bone_mm3(const VoxelGrid<Density>& grid, double iso) {
  BoneVolume<Density> volume(grid, iso);
  for (int k = -1; k < grid.size()[2]; ++k)
    for (int j = -1; j < grid.size()[1]; ++j) volume.add_row(j, k, -1, grid.size()[0] - 1);
  return volume.cells() * grid.spacing().prod() * 1e9;
}

/// What bricks must say of an edit that made `after` of `before`.
template <VoxelDensity Density>
void check_bricks(const VoxelGrid<Density>& grid, GridReader<Density>& reader, const std::vector<Density>& before,
                  const std::vector<Density>& after) {
  std::vector<char> named(grid.brick_count(), 0);
  reader.poll([&](std::size_t b) { named[b] = 1; });
  VoxelBox box{{1 << 30, 1 << 30, 1 << 30}, {-1, -1, -1}};
  std::vector<char> touched(grid.brick_count(), 0);
  const auto& n = grid.size();
  std::size_t at = 0;
  for (int k = 0; k < n[2]; ++k)
    for (int j = 0; j < n[1]; ++j)
      for (int i = 0; i < n[0]; ++i, ++at) {
        if (std::memcmp(&before[at], &after[at], sizeof(Density)) == 0) continue;
        const std::array p{i, j, k};
        std::array<int, 3> lo, hi;
        for (std::size_t a = 0; a < 3; ++a) {
          box.lo[a] = std::min(box.lo[a], p[a]);
          box.hi[a] = std::max(box.hi[a], p[a]);
          lo[a] = std::max(p[a] - 1, 0) / 8;
          hi[a] = std::min((p[a] + 1) / 8, grid.bricks()[a] - 1);
        }
        for (int z = lo[2]; z <= hi[2]; ++z)
          for (int y = lo[1]; y <= hi[1]; ++y)
            for (int x = lo[0]; x <= hi[0]; ++x) touched[grid.brick_index(x, y, z)] = 1;
      }
  std::size_t wrong = 0;
  for (std::size_t b = 0; b < grid.brick_count(); ++b) {
    const auto c = grid.brick_coordinates(b);
    auto range = DensityRange<Density>{std::numeric_limits<Density>::max(), std::numeric_limits<Density>::lowest()};
    for (int k = c[2] * 8 - 1; k <= std::min(c[2] * 8 + 8, n[2]); ++k)
      for (int j = c[1] * 8 - 1; j <= std::min(c[1] * 8 + 8, n[1]); ++j)
        for (int i = c[0] * 8 - 1; i <= std::min(c[0] * 8 + 8, n[0]); ++i) {
          range.min = std::min(range.min, grid.at(i, j, k));
          range.max = std::max(range.max, grid.at(i, j, k));
        }
    const auto said = grid.brick_range(b);
    wrong += said.min == range.min && said.max == range.max ? 0U : 1U;
    wrong += touched[b] != 0 && named[b] == 0 ? 1U : 0U;  // a row between its ends may name more
  }
  CHECK(wrong == 0);
  if (!box.empty()) {
    CHECK(grid.last_edit().lo == box.lo);
    CHECK(grid.last_edit().hi == box.hi);
  }
}

template <VoxelDensity Density>
VoxelGrid<Density> random_bone(std::mt19937& rng, const std::array<int, 3>& size, const Vec3d& spacing) {
  const double most = sizeof(Density) == 1 ? 120 : 1500;
  const bool noisy = rng() % 2 == 0;
  return make_grid<Density>({.size = size, .spacing = spacing, .outside = 0}, [&](int, int, int) {
    return noisy ? std::floor(most * static_cast<double>(rng() % 1024) / 1023) : most;
  });
}

}  // namespace

TEST_CASE_TEMPLATE("Fast cuts change the bits that plain ones change", Density, std::uint8_t, std::int8_t,
                   std::uint16_t, std::int16_t, float) {
  std::mt19937 rng(kSeed);
  const auto uniform = [&](double lo, double hi) {
    return random_point(rng, Vec3d::Constant(lo), Vec3d::Constant(hi)).x();
  };
  for (int bone = 0; bone < 12; ++bone) {
    CAPTURE(kSeed);
    CAPTURE(bone);
    std::array<int, 3> size;
    for (int& n : size) n = static_cast<int>(uniform(1, 34));
    if (bone == 0) size = {530, 9, 17};  // more bricks in a row than bits in a word
    const Vec3d spacing = bone % 3 == 0 ? random_point(rng, Vec3d::Constant(2e-4), Vec3d::Constant(6e-4))
                                        : Vec3d(Vec3d::Constant(kVoxel));
    auto grid = random_bone<Density>(rng, size, spacing);
    const double iso = sizeof(Density) == 1 ? 60 : 700;
    GridReader<Density> reader(grid, false);
    const Vec3d far = spacing.cwiseProduct(Vec3d(size[0], size[1], size[2]));
    auto voxels = voxels_of(grid);
    Vec3d p = random_point(rng, -0.1 * far, 1.1 * far);
    struct {
      Vec3d from, to;
      double radius;
    } again{};
    for (int tick = 0; tick < 12; ++tick) {
      const Vec3d q = tick % 4 == 3 ? random_point(rng, -0.1 * far, 1.1 * far)
                                    : Vec3d(p + uniform(0, tick % 2 == 0 ? 0.3 : 3) * kVoxel * random_direction(rng));
      const double radius = uniform(0.3, 9) * kVoxel;
      const auto before = voxels;
      double removed = 0;
      const double bone_before = bone_mm3(grid, iso);
      if (tick < 8 && tick % 3 == 0) {
        const RateLimitedCut<> policy{.rate = 2e5};
        const CutAllowance allowance{.dt = 1e-3, .tick = static_cast<std::uint32_t>(tick)};
        const DrillBit bit{.radius = radius, .length = 5 * radius, .end = static_cast<DrillEnd>(tick / 3)};
        const RevolvedCutter cutter(bit, make_pose<double>(Mat3d::Identity(), p),
                                    make_pose<double>(Mat3d::Identity(), q), kVoxel);
        removed = carve(grid, iso, cutter, policy, allowance, 10);
        plain_cut(grid, voxels, iso, 10, cutter, policy.limit<Density>(allowance));
      } else if (tick >= 8) {
        // By a rate, twice at a place, so that some voxels are at their target, over short ways and long ones.
        if (tick % 2 == 0) again = {p, q, radius};
        const RateLimitedCut<> policy{.rate = 1e5};
        const CutAllowance allowance{.dt = 1e-3, .tick = static_cast<std::uint32_t>(tick)};
        const SphereCutter cutter(again.from, again.to, again.radius);
        removed = carve(grid, iso, cutter, policy, allowance, 10);
        plain_cut(grid, voxels, iso, 10, cutter, policy.limit<Density>(allowance));
      } else {
        const SphereCutter cutter(p, q, radius, tick % 3 == 1);
        removed = carve(grid, iso, cutter, GeometricCut{}, {}, 16);
        plain_cut(grid, voxels, iso, 16, cutter, GeometricCut{}.limit<Density>({}));
      }
      // Sums of so many cells in another order; a tick never tells less than none.
      const double rounding = 1e-15 * bone_before;
      CHECK(std::abs(removed - std::max(bone_before - bone_mm3(grid, iso), 0.0)) <= rounding);
      const auto after = voxels_of(grid);
      CHECK(std::memcmp(after.data(), voxels.data(), after.size() * sizeof(Density)) == 0);
      voxels = after;
      check_bricks(grid, reader, before, after);
      p = q;
    }
    grid.restore(1);
    const auto restored = voxels_of(grid);
    GridReader<Density> any(grid, false);
    check_bricks(grid, any, restored, restored);
  }
}
