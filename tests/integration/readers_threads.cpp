// SPDX-License-Identifier: MIT
#include <doctest/doctest.h>

#include "integration/scenes.hpp"

#include <atomic>
#include <chrono>
#include <thread>

using namespace trephine;
using namespace trephine::test;

namespace {

/// A host's copy of the bone, kept up to date from changed bricks alone.
class Copy {
 public:
  explicit Copy(const VoxelGrid<std::uint8_t>& bone) : reader_(bone), voxels_(kVoxels, 0) {}

  void update() {
    reader_.poll([this](std::size_t b) {
      constexpr int n = GridReader<std::uint8_t>::kHaloed;
      static_cast<void>(reader_.copy_brick(b, brick_));
      const auto at = reader_.brick_coordinates(b);
      for (int k = 0; k < 8; ++k)
        for (int j = 0; j < 8; ++j)
          for (int i = 0; i < 8; ++i)
            voxels_[static_cast<std::size_t>(((8 * at[2] + k) * kBlockSize + 8 * at[1] + j) * kBlockSize + 8 * at[0] +
                                             i)] = brick_[static_cast<std::size_t>(((k + 1) * n + j + 1) * n + i + 1)];
    });
  }
  [[nodiscard]] const std::vector<std::uint8_t>& voxels() const { return voxels_; }

  static constexpr std::size_t kVoxels = std::size_t{kBlockSize} * kBlockSize * kBlockSize;

 private:
  GridReader<std::uint8_t> reader_;
  std::array<std::uint8_t, 1000> brick_{};
  std::vector<std::uint8_t> voxels_;
};

}  // namespace

TEST_CASE("hosts that follow changed bricks while a scene drills lose nothing, one that stalls included") {
  auto bone = make_block<std::uint8_t>();
  HapticScene scene{bone, kIsovalue, make_surface<float>(), Cutting{}, DeviceLimits{kForceLimit, kTorqueLimit}};
  Copy fast(bone);
  Copy slow(bone);
  std::atomic<bool> done{false};
  const auto follow = [&done](Copy& copy, std::chrono::milliseconds rest) {
    return std::thread([&copy, &done, rest] {
      while (!done.load()) {
        copy.update();
        std::this_thread::sleep_for(rest);
      }
      copy.update();
    });
  };
  auto first = follow(fast, std::chrono::milliseconds(0));
  auto second = follow(slow, std::chrono::milliseconds(150));
  double removed = 0;
  for (int i = 0; i < 1000; ++i)
    removed += scene.tick({.X_WT = drilling_pose(1e-3 * i), .spindle_on = true}, 1e-3).removed_mm3;
  done.store(true);
  first.join();
  second.join();
  CHECK(removed > 10.0);
  std::vector<std::uint8_t> truth(Copy::kVoxels);
  bone.copy_voxels(truth);
  CHECK(fast.voxels() == truth);
  CHECK(slow.voxels() == truth);
}
