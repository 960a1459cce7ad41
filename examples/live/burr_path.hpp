// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace live {

/// A straight piece of the turning burr's way: the ball cleared all within `radius` of it. W, metres.
struct BurrPiece {
  trephine::Vec3d from = trephine::Vec3d::Zero(), to = trephine::Vec3d::Zero();
  double radius = 0;
};

/// The turning burr's way, written by the haptic thread and read by the window; neither waits. A reader that falls
/// behind gets longer pieces.
class BurrPath {
 public:
  static constexpr std::size_t kSize = 4096;
  static constexpr double kStep = 0.02e-3;  ///< shortest piece [m]

  /// Haptic thread, each tick: the ball's centre and radius.
  void follow(bool turning, const trephine::Vec3d& p_W, double radius) noexcept {
    if (!turning || radius != radius_) {
      turning_ = false;
      if (!turning) return;
    }
    if (!turning_) last_ = p_W;
    const bool starts = !turning_;
    turning_ = true;
    radius_ = radius;
    if (!starts && (p_W - last_).norm() < kStep) return;
    const std::uint64_t at = written_.load(std::memory_order_relaxed);
    if (at - read_.load(std::memory_order_acquire) >= kSize) return;
    pieces_[at % kSize] = {last_, p_W, radius};
    last_ = p_W;
    written_.store(at + 1, std::memory_order_release);
  }

  /// Window thread: calls `visit` with each new piece.
  template <class Visit>
  void take(const Visit& visit) {
    const std::uint64_t end = written_.load(std::memory_order_acquire);
    std::uint64_t at = read_.load(std::memory_order_relaxed);
    for (; at < end; ++at) visit(pieces_[at % kSize]);
    read_.store(at, std::memory_order_release);
  }

 private:
  std::array<BurrPiece, kSize> pieces_{};
  std::atomic<std::uint64_t> written_{0}, read_{0};
  // The writer's.
  trephine::Vec3d last_ = trephine::Vec3d::Zero();
  double radius_ = 0;
  bool turning_ = false;
};

}  // namespace live
