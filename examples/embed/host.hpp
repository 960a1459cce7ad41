// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/brick_mesh.hpp>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

/// What a host brings along, whichever it is; yours has its own of each.
namespace embed {

/// The host's own pose: millimetres, y up, quaternion in single precision.
struct HostPose {
  std::array<float, 3> position_mm;
  std::array<float, 4> xyzw;
};

/// Stands for the device's driver: a hand that comes down on the bone, then drills. The shaft points up, along y.
inline HostPose read_device(double t) {
  return {{10, static_cast<float>(14.2 - 3.0 * t), 8}, {-0.70710678F, 0, 0, 0.70710678F}};
}

/// The haptic loop's clock: a millisecond at a time, for a second.
class HapticClock {
 public:
  double t = 0;   ///< since the start [s]
  double dt = 0;  ///< since the tick before [s]

  /// Sleeps until the next tick is due; false: it is over.
  bool next() {
    if (last_ - start_ >= std::chrono::seconds(1)) return false;
    std::this_thread::sleep_until(last_ + std::chrono::milliseconds(1));
    const auto now = std::chrono::steady_clock::now();
    t = std::chrono::duration<double>(now - start_).count();
    dt = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return true;
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now(), last_ = start_;
};

/// Stands for a CT volume of 40 x 32 x 32 voxels, x fastest: bone in the lower three quarters of its z axis.
inline std::vector<std::int16_t> read_volume() {
  std::vector<std::int16_t> hounsfield(std::size_t{40} * 32 * 32, -1000);
  for (std::size_t i = 0; i < hounsfield.size() * 3 / 4; ++i) hounsfield[i] = 1200;
  return hounsfield;
}

/// The drawn mesh, brick by brick. What changed waits under a lock, which the mesh and the drawing thread share and the
/// haptic thread never takes.
class MeshStore {
 public:
  /// From the mesh thread.
  void put(std::size_t brick, trephine::Mesh surface) {
    const std::lock_guard lock(between_);
    changed_[brick] = std::move(surface);
  }

  /// From the drawing thread, at each picture: takes what is new.
  void upload() {
    std::map<std::size_t, trephine::Mesh> fresh;
    {
      const std::lock_guard lock(between_);
      fresh.swap(changed_);
    }
    uploads_ += fresh.size();
    for (auto& [brick, surface] : fresh) drawn_[brick] = std::move(surface);
  }

  /// Of the drawing thread.
  [[nodiscard]] const trephine::Mesh& drawn(std::size_t brick) { return drawn_[brick]; }  // none yet: an empty one
  [[nodiscard]] std::size_t bricks() const { return drawn_.size(); }
  [[nodiscard]] std::size_t uploads() const { return uploads_; }

 private:
  std::mutex between_;
  std::map<std::size_t, trephine::Mesh> changed_, drawn_;
  std::size_t uploads_ = 0;
};

/// Stands for a picture of the drawing thread: takes what is new of the mesh, at times says where it is, and waits for
/// the next one.
inline void draw(MeshStore& mesh, float force_N, int frame) {
  mesh.upload();
  if (frame % 15 == 0) std::printf("%4.2f N, %zu bricks uploaded\n", static_cast<double>(force_N), mesh.uploads());
  std::this_thread::sleep_for(std::chrono::milliseconds(16));
}

/// After the drilling: the last picture, and whether what was followed brick by brick is what is there. False also
/// where nothing changed.
template <class Density>
bool finish(MeshStore& mesh, const trephine::VoxelGrid<Density>& bone, double isovalue, double removed_mm3) {
  mesh.upload();
  trephine::GridReader<Density> reader(bone);
  std::size_t wrong = 0;
  reader.poll([&](std::size_t brick) { wrong += trephine::brick_mesh(reader, brick, isovalue) != mesh.drawn(brick); });
  const std::size_t changed = mesh.uploads() - mesh.bricks();
  std::printf("removed %.1f mm3; uploaded %zu bricks once and %zu that changed; %zu differ from the bone\n",
              removed_mm3, mesh.bricks(), changed, wrong);
  return wrong == 0 && changed > 0;
}

}  // namespace embed
