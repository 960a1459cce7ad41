// SPDX-License-Identifier: MIT
#pragma once

namespace trephine {

/// The factor that brings a wrench back gently: 0 at the tick that restarts it, then elapsed / duration, then 1. With
/// duration 0 [s] it is 1 from the next tick on. Starts at 0.
class Ramp {
 public:
  explicit Ramp(double duration) noexcept : duration_(duration) {}

  /// Back to 0; true where this begins a new ramp, false while already at 0.
  bool restart() noexcept {
    const bool was_up = gain_ > 0;
    elapsed_ = 0;
    gain_ = 0;
    return was_up;
  }

  /// `dt` [s] has passed.
  void advance(double dt) noexcept {
    elapsed_ += dt;
    gain_ = elapsed_ < duration_ ? elapsed_ / duration_ : 1.0;
  }

  [[nodiscard]] double gain() const noexcept { return gain_; }

 private:
  double duration_;
  double elapsed_ = 0;
  double gain_ = 0;
};

}  // namespace trephine
