// SPDX-License-Identifier: MIT
// The bone in a session's log: what the file says of it is what became of it, bit for bit, whatever its densities.
#include "logged.hpp"

#include <doctest/doctest.h>

#include <trephine/core/rotation.hpp>
#include <trephine/core/units.hpp>
#include <trephine/render/coupled/coupled_tool_renderer.hpp>
#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>

#include "support/malloc_hook.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <random>
#include <span>
#include <stdexcept>
#include <string>
#include <thread>
#include <type_traits>
#include <utility>
#include <vector>

namespace {

using namespace trephine;
using test::SessionFile;

constexpr std::array<int, 3> kSize{37, 24, 19};  // with bricks that reach beyond the grid

Posed some_pose() {
  return make_pose<double>(rotation_from_vector<double>(Vec3d(0.4, -0.7, 1.1)), Vec3d(0.3, -0.2, 1));
}

/// Bone below, air above, with densities of all kinds in it.
template <class Density>
std::vector<Density> densities() {
  std::mt19937 random(3);
  std::vector<Density> voxels;
  for (int v = 0; v < kSize[0] * kSize[1] * kSize[2]; ++v) {
    const bool is_bone = v < kSize[0] * kSize[1] * 12;
    const auto noise = static_cast<int>(random() % 40);
    voxels.push_back(static_cast<Density>(is_bone ? 80 + noise : 3 + noise / 4));
    if constexpr (std::is_floating_point_v<Density>) voxels.back() /= 3;
  }
  return voxels;
}
template <class Density>
VoxelGrid<Density> block() {
  const std::vector<Density> voxels = densities<Density>();
  return VoxelGrid<Density>({.size = kSize, .spacing = {0.4_mm, 0.5_mm, 0.6_mm}, .X_WG = some_pose(), .outside = 1},
                            voxels);
}
template <class Density>
std::vector<Density> voxels_of(const VoxelGrid<Density>& bone) {
  std::vector<Density> voxels(static_cast<std::size_t>(kSize[0] * kSize[1] * kSize[2]));
  bone.copy_voxels(std::span<Density>(voxels));
  return voxels;
}
template <class Density>
void dig(VoxelGrid<Density>& bone, const Vec3d& at, double radius) {
  for (int k = 0; k < kSize[2]; ++k)
    for (int j = 0; j < kSize[1]; ++j)
      bone.lower_row(j, k, 0, kSize[0] - 1, [&](int i, Density old) {
        const double depth = radius - (Vec3d(i, j, k) - at).norm();
        return depth > 0 ? static_cast<Density>(40 - 10 * std::min(depth, 4.0)) : old;
      });
  bone.commit();
}

/// The densities that a session ended with, from those with which it began.
template <class Density>
std::vector<Density> applied(const Session& session, std::vector<Density> voxels) {
  REQUIRE(session.bone);
  for (const Session::Change& change : session.changes)
    apply_change(*session.bone, change.brick, std::span<Density>(voxels));
  return voxels;
}

template <class Density>
void check_bits_of_a_drilled_bone(double isovalue) {
  VoxelGrid<Density> bone = block<Density>();
  const std::vector<Density> start = voxels_of(bone);
  HapticScene scene{bone, isovalue, CoupledToolRenderer{Burr{.tip_radius = 1.5_mm, .shaft_radius = 0.8_mm}}, Cutting{}};
  std::string bytes;
  SessionLog log(test::MemorySink{bytes}, {.flush = 0.01});
  log.follow(bone, isovalue);
  double removed = 0;
  for (int tick = 0; tick < 1500; ++tick) {
    TickInput input{.spindle_on = true};
    const Vec3d p_GT(7_mm + 3_mm * std::sin(5e-3 * tick), 6_mm, 8.2_mm - 3e-6 * tick);
    input.X_WT = some_pose() * make_pose<double>(Mat3d::Identity(), p_GT);
    const TickResult result = scene.tick(input, 1e-3);
    removed += result.removed_mm3;
    log.record(input, 1e-3, result);
    if (tick % 100 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(15));
  }
  REQUIRE(removed > 20);
  log.close();

  const SessionFile file("trephine_session_bone.bin");
  const Session session = file.load_of(bytes);
  CHECK(session.report.complete);
  REQUIRE(session.bone);
  const FollowedBone& b = *session.bone;
  CHECK(b.geometry.size == kSize);
  CHECK(b.geometry.spacing == bone.spacing());
  CHECK(b.geometry.X_WG.matrix() == bone.X_WG().matrix());
  CHECK(b.geometry.outside == 1);
  CHECK(b.isovalue == isovalue);
  CHECK(b.density == kDensityType<Density>);
  CHECK(b.began_with(std::span<const Density>(start)));
  const std::vector<Density> end = voxels_of(bone);
  CHECK_FALSE(b.began_with(std::span<const Density>(end)));
  REQUIRE(start != end);
  CHECK(applied(session, start) == end);
  // While it ran, and never more than the bone had lost by then.
  REQUIRE(session.changes.size() > 10);
  CHECK(session.changes.front().position < 1000);
  CHECK(session.changes.front().position > 0);
  std::size_t voxels = 0;
  for (const Session::Change& change : session.changes) voxels += change.brick.voxels.size();
  std::size_t changed = 0;
  for (std::size_t v = 0; v < start.size(); ++v) changed += start[v] != end[v];
  CHECK(voxels >= changed);
}

TEST_CASE("session log: the bricks of a log, applied to the bone that it began with, are the bone that was left") {
  check_bits_of_a_drilled_bone<std::int16_t>(60);
  check_bits_of_a_drilled_bone<std::uint8_t>(60);
  check_bits_of_a_drilled_bone<float>(20);
}

template <class Density>
void check_edits() {
  VoxelGrid<Density> bone = block<Density>();
  const std::vector<Density> start = voxels_of(bone);
  std::string bytes;
  SessionLog log(test::MemorySink{bytes}, {.flush = 0.01});
  log.follow(bone);
  CHECK_THROWS_AS(log.follow(bone), std::invalid_argument);
  const auto wait_for_a_flush = [] { std::this_thread::sleep_for(std::chrono::milliseconds(60)); };
  log(test::numbered(0));
  dig(bone, {8, 8, 8}, 5);
  wait_for_a_flush();
  log(test::numbered(1));
  dig(bone, {36, 23, 18}, 6);
  wait_for_a_flush();
  bone.restore(3);  // densities that rise
  wait_for_a_flush();
  dig(bone, {20, 0, 9}, 4);
  log.close();
  const SessionFile file("trephine_session_edits.bin");
  const Session session = file.load_of(bytes);
  CHECK_FALSE(session.bone->isovalue);
  REQUIRE(session.bone->began_with(std::span<const Density>(start)));
  CHECK(applied(session, start) == voxels_of(bone));
  std::vector<Density> short_by_one(start.size() - 1);
  const auto apply = [&](auto voxels) { apply_change(*session.bone, session.changes[0].brick, voxels); };
  CHECK_THROWS_AS(apply(std::span<Density>(short_by_one)), std::invalid_argument);
  using Other = std::conditional_t<std::is_same_v<Density, float>, std::int16_t, float>;
  std::vector<Other> other(start.size());
  CHECK_THROWS_AS(apply(std::span<Other>(other)), std::invalid_argument);
  CHECK_FALSE(session.bone->began_with(std::span<const Other>(other)));
}

TEST_CASE("session log: edits at the grid's corners and restored bone are followed, for each type of density") {
  check_edits<std::uint8_t>();
  check_edits<std::int8_t>();
  check_edits<std::uint16_t>();
  check_edits<std::int16_t>();
  check_edits<float>();
}

TEST_CASE("session log: a bone that is followed costs the haptic thread nothing") {
  VoxelGrid<std::int16_t> bone = block<std::int16_t>();
  std::string bytes;
  SessionLog log(test::MemorySink{bytes}, {.flush = 0.01});
  log.follow(bone, 60);
  std::int64_t calls = 0;
  for (int i = 0; i < 30; ++i) {
    calls += test::heap_calls([&] {
      dig(bone, {5.0 + i, 10, 9}, 3);
      log(test::numbered(i));
    });
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  if (test::AllocationGuard::available()) CHECK(calls == 0);
  log.close();
  CHECK(log.dropped() == 0);
}

TEST_CASE("session log: a file that ends anywhere holds a bone on its way, and damage is found") {
  VoxelGrid<std::int16_t> bone = block<std::int16_t>();
  const std::vector<std::int16_t> start = voxels_of(bone);
  std::string bytes;
  {
    SessionLog log(test::MemorySink{bytes}, {.flush = 0.01});
    log.follow(bone, 60);
    for (int i = 0; i < 20; ++i) {
      log(test::numbered(i));
      dig(bone, {5.0 + i, 10, 9}, 4);
      std::this_thread::sleep_for(std::chrono::milliseconds(6));
    }
  }
  const SessionFile file("trephine_session_bone_cut.bin");
  std::size_t before = 0;
  for (std::size_t keep = session_detail::kLogHeadBytes; keep < bytes.size(); keep += 1 + bytes.size() / 61) {
    const Session session = file.load_of(bytes.substr(0, keep));
    CHECK(session.changes.size() >= before);
    before = session.changes.size();
    if (before == 0) continue;
    // No voxel is lower than the bone was at its end.
    const std::vector<std::int16_t> now = applied(session, start), end = voxels_of(bone);
    int wrong = 0;
    for (std::size_t v = 0; v < now.size(); ++v) wrong += now[v] < end[v] || now[v] > start[v];
    CHECK(wrong == 0);
  }
  CHECK(before > 4);
  std::mt19937 random(23);
  for (int trial = 0; trial < 200; ++trial) {
    std::string damaged = bytes;
    const std::size_t at = session_detail::kLogHeadBytes + random() % (bytes.size() - session_detail::kLogHeadBytes);
    damaged[at] = static_cast<char>(damaged[at] ^ (1 << random() % 8));
    CHECK_FALSE(file.load_of(damaged).report.complete);
  }
}

/// The records of a bone, and of a brick with these numbers of voxels.
std::string bone_record(const FollowedBone& bone) {
  std::string record = "\x06";
  session_detail::put_bone(record, bone);
  return record;
}
std::string brick_record(std::size_t brick, const std::vector<int>& numbers) {
  std::string record = "\x07";
  std::vector<std::pair<int, std::int16_t>> changed;
  for (const int n : numbers) changed.emplace_back(n, static_cast<std::int16_t>(-5 * n));
  session_detail::put_brick<std::int16_t>(record, brick, changed);
  return record;
}

TEST_CASE("session log: bones and bricks that cannot be are refused, whatever their hashes say") {
  const SessionFile file("trephine_session_bone_hostile.bin");
  FollowedBone bone{.geometry = {.size = {9, 8, 8}, .spacing = {1e-3, 1e-3, 1e-3}, .outside = 0},
                    .density = DensityType::kInt16,
                    .hash = 7};
  const auto load = [&](const std::string& records) {
    std::string bytes = session_detail::log_head(), body(session_detail::kChunkMark);
    append_number(body, static_cast<std::uint32_t>(records.size()));
    append_number(body, std::uint64_t{0});
    body += records;
    append_number(body, recording_detail::fnv1a(body));
    return file.complaint(bytes + body);
  };
  const auto is_refused = [&](const std::string& records) {
    return load(records).find("records that are none") != std::string::npos;
  };
  const std::string good = bone_record(bone);
  CHECK(load(good) == "none");
  CHECK(load(good + brick_record(0, {0, 7, 511}) + brick_record(1, {0, 8, 504})) == "none");
  CHECK(is_refused(brick_record(0, {1})));           // of no bone
  CHECK(is_refused(good + good));                    // a second bone
  CHECK(is_refused(good + brick_record(2, {0})));    // no such brick
  CHECK(is_refused(good + brick_record(1, {1})));    // beyond the grid's edge
  CHECK(is_refused(good + brick_record(0, {512})));  // beyond the brick
  CHECK(is_refused(good + brick_record(4294967295U, {})));
  const std::string brick = brick_record(0, {0, 100, 200, 300});
  for (std::size_t keep = 1; keep < brick.size(); ++keep) CHECK(is_refused(good + brick.substr(0, keep)));
  for (std::size_t keep = 1; keep < good.size(); ++keep) CHECK(is_refused(good.substr(0, keep)));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const auto refuses = [&](auto change) {
    FollowedBone other = bone;
    change(other);
    CHECK(is_refused(bone_record(other)));
  };
  refuses([](FollowedBone& b) { b.geometry.size[1] = 0; });
  refuses([](FollowedBone& b) { b.geometry.size[2] = -4; });
  refuses([](FollowedBone& b) { b.geometry.size = {1 << 20, 1 << 20, 1 << 20}; });
  refuses([](FollowedBone& b) { b.geometry.size[0] = std::numeric_limits<int>::max(); });
  refuses([](FollowedBone& b) { b.geometry.spacing[0] = 0; });
  refuses([&](FollowedBone& b) { b.geometry.spacing[1] = nan; });
  refuses([&](FollowedBone& b) { b.geometry.X_WG.translation()[1] = nan; });
  refuses([](FollowedBone& b) { b.geometry.X_WG.linear() *= 2; });
  refuses([&](FollowedBone& b) { b.geometry.outside = nan; });
  refuses([](FollowedBone& b) { b.density = static_cast<DensityType>(5); });
  // Bytes that are none, after a good beginning: they end in a sentence or are a session.
  std::mt19937 random(29);
  int refused = 0;
  for (int trial = 0; trial < 500; ++trial) {
    std::string records = good + (trial % 2 == 0 ? std::string("\x07") + std::string(4, '\x00') : brick);
    for (int i = 0; i < 40; ++i) records.push_back(static_cast<char>(random()));
    if (trial % 2 != 0) records[good.size() + 5 + random() % 8] = static_cast<char>(random());
    refused += is_refused(records);
  }
  CHECK(refused > 300);
}

}  // namespace
