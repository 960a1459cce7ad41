// SPDX-License-Identifier: MIT
// A log follows a bone while another thread cuts it.
#include "logged.hpp"

#include <doctest/doctest.h>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace {

using namespace trephine;

TEST_CASE("session log: bricks that are read while they are cut end as the bone does") {
  constexpr int kSide = 24;
  const std::vector<std::int16_t> start(std::size_t{kSide} * kSide * kSide, 1000);
  VoxelGrid<std::int16_t> bone({.size = {kSide, kSide, kSide}, .spacing = Vec3d::Constant(1e-3)}, start);
  std::string bytes;
  SessionLog log(test::MemorySink{bytes}, {.flush = 0.01});
  log.follow(bone);
  std::thread haptic([&] {
    for (int i = 0; i < 400; ++i) {
      for (int k = 0; k < kSide; ++k)
        for (int j = i % 2; j < kSide; j += 2)
          bone.lower_row(j, k, i % 8, kSide - 1,
                         [i](int, std::int16_t old) { return static_cast<std::int16_t>(old - 1 - i % 2); });
      bone.commit();
      log(test::numbered(i));
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  });
  haptic.join();
  log.close();
  const test::SessionFile file("trephine_session_bone_threads.bin");
  const Session session = file.load_of(bytes);
  CHECK(session.report.complete);
  CHECK(session.ticks.size() == 400);
  REQUIRE(session.bone);
  std::vector<std::int16_t> voxels = start, end = start;
  for (const Session::Change& change : session.changes)
    apply_change(*session.bone, change.brick, std::span<std::int16_t>(voxels));
  bone.copy_voxels(std::span<std::int16_t>(end));
  CHECK(voxels == end);
  CHECK(session.changes.size() > 50);
  CHECK(session.changes.front().position < 400);
}

}  // namespace
