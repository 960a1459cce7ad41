// SPDX-License-Identifier: MIT
#include "voxel/sampled_fields.hpp"

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <thread>

using namespace trephine;
using namespace trephine::test;

namespace {

constexpr unsigned kSeed = 31337;

/// A mesh side: its own copy of every brick with its halo, kept up to date from another thread.
template <VoxelDensity Density>
class Mirror {
 public:
  static constexpr std::size_t kVoxels = 1000;

  explicit Mirror(const VoxelGrid<Density>& grid) : reader_(grid), bricks_(grid.brick_count() * kVoxels) {}

  std::size_t update() {
    return reader_.poll([this](std::size_t b) {
      (void)reader_.copy_brick(b, std::span<Density, kVoxels>(bricks_.data() + b * kVoxels, kVoxels));
      const auto range = reader_.brick_range(b);
      impossible_ = impossible_ || range.min > range.max;
    });
  }

  /// Whether every voxel of every copy is the grid's; on a still grid.
  [[nodiscard]] bool equals(const VoxelGrid<Density>& grid) const {
    for (std::size_t b = 0; b < grid.brick_count(); ++b) {
      const auto at = grid.brick_coordinates(b);
      std::size_t n = b * kVoxels;
      for (int k = -1; k <= 8; ++k)
        for (int j = -1; j <= 8; ++j)
          for (int i = -1; i <= 8; ++i, ++n)
            if (static_cast<double>(bricks_[n]) != density_at(grid, at[0] * 8 + i, at[1] * 8 + j, at[2] * 8 + k))
              return false;
    }
    return true;
  }
  [[nodiscard]] bool impossible() const { return impossible_; }

 private:
  GridReader<Density> reader_;
  std::vector<Density> bricks_;
  bool impossible_ = false;
};

}  // namespace

TEST_CASE_TEMPLATE("Views of other threads miss nothing while the haptic thread carves and restores", Density,
                   std::uint8_t, std::int16_t, float) {
  CAPTURE(kSeed);
  const double h = 3e-4;
  const double iso = 50;
  const std::array size{45, 38, 41};
  auto grid = make_grid<Density>({.size = size, .spacing = Vec3d::Constant(h), .outside = 0},
                                 [](int i, int j, int k) { return 100 + (i * 7 + j * 5 + k * 3) % 27; });
  std::atomic<bool> done{false};
  std::vector<Mirror<Density>> mirrors;
  for (int n = 0; n < 4; ++n) mirrors.emplace_back(grid);
  std::vector<std::size_t> visits(mirrors.size(), 0);
  std::vector<std::thread> threads;
  for (std::size_t m = 0; m < mirrors.size(); ++m)
    threads.emplace_back([&, m] {
      while (!done.load(std::memory_order_acquire)) {
        visits[m] += mirrors[m].update();
        if (m == 0) std::this_thread::sleep_for(std::chrono::milliseconds(60));  // this one stalls
        if (m == 1) std::this_thread::yield();
      }
      visits[m] += mirrors[m].update();  // the first look after the last edit
    });
  // The haptic thread: the present one, at full speed for a while.
  std::mt19937 rng(kSeed);
  const Vec3d far_corner = Vec3d(size[0], size[1], size[2]) * h;
  double removed = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(400);
  Vec3d from = far_corner / 2;
  for (int cut = 0; cut < 400 || std::chrono::steady_clock::now() < end; ++cut) {
    const Vec3d to = random_point(rng, -2 * Vec3d::Constant(h), far_corner);
    removed += carve(grid, iso, SphereCutter(from, from + 0.2 * (to - from), 3 * h));
    from += 0.2 * (to - from);
    if (cut % 7 == 0) grid.restore(1);
    if (cut % 100 == 99) grid.restore();
  }
  for (int n = 0; n < 20; ++n)
    removed += carve(grid, iso, SphereCutter(from, random_point(rng, Vec3d::Zero(), far_corner), 2 * h));
  done.store(true, std::memory_order_release);
  for (auto& t : threads) t.join();
  CHECK(removed > 0);
  for (std::size_t m = 0; m < mirrors.size(); ++m) {
    CAPTURE(m);
    CHECK(visits[m] >= grid.brick_count());
    CHECK_FALSE(mirrors[m].impossible());
    CHECK(mirrors[m].equals(grid));
  }
}
