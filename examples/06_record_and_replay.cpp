// SPDX-License-Identifier: MIT
// Records a session, replays it bit by bit on another day's bone, and goes on from where it ended.
//   06_record_and_replay [FILE]
// See no tick differ: a recording that a user sends shows you what the hand felt.
#include <trephine/devices.hpp>
#include <trephine/trephine.hpp>

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

using namespace trephine;

int main(int argc, char** argv) {
  std::vector<std::int16_t> hounsfield(64 * 64 * 24, 1200);  // bone below, x fastest
  hounsfield.resize(64 * 64 * 48, -1000);                    // air above
  const auto scan = [&] {
    return VoxelGrid<std::int16_t>({.size = {64, 64, 48}, .spacing = {0.5_mm, 0.5_mm, 0.5_mm}}, hounsfield);
  };
  const auto drill_in = [](VoxelGrid<std::int16_t>& bone) {
    return HapticScene{bone, 300, CoupledToolRenderer{Burr{.tip_radius = 1.5_mm}, CoupledOptions{}}, Cutting{}};
  };
  const auto input = [](int tick) {
    Posed X_WT = Posed::Identity();
    X_WT.translation() = Vec3d(12_mm + 4e-6 * tick, 16_mm, 14_mm - 3e-6 * tick);
    return TickInput{.X_WT = X_WT, .spindle_on = tick > 500};
  };

  VoxelGrid<std::int16_t> bone = scan();
  auto scene = drill_in(bone);
  Recorder recorder(1500);  // takes its memory here, so that the haptic thread takes none; ServoLoop takes it, too
  for (int tick = 0; tick < 1500; ++tick) {
    const TickResult r = scene.tick(input(tick), 1e-3);
    (void)recorder.record(input(tick), 1e-3, r);
  }
  const char* path = argc > 1 ? argv[1] : "session.rec";
  save_recording(path, recorder.ticks());

  VoxelGrid<std::int16_t> again = scan();
  auto replayed = drill_in(again);
  const ReplayReport report = replay(load_recording(path), replayed);
  std::printf("%zu ticks replayed, %zu differ\n", static_cast<std::size_t>(report.ticks),
              static_cast<std::size_t>(report.different));

  bool same = true;  // both go on alike
  for (int tick = 1500; tick < 2000; ++tick)
    same = same && same_bits(scene.tick(input(tick), 1e-3), replayed.tick(input(tick), 1e-3));
  std::printf("500 more ticks are the same: %s\n", same ? "yes" : "no");
}
