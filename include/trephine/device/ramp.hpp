// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/host.hpp>

namespace trephine::inline TREPHINE_ALIGNED {

/// A linear gain that raises a wrench from zero: 0 at the tick of a restart, then elapsed / duration, then 1. With a
/// duration of 0 [s] it is 1 from the next tick on. Starts at 0.
class Ramp {
 public:
  explicit Ramp(double duration) noexcept : duration_(duration) {}

  /// Sets the gain to 0. Returns true if a new ramp starts, false if the gain already was 0.
  bool restart() noexcept {
    const bool was_raised = gain_ > 0;
    elapsed_ = 0;
    gain_ = 0;
    return was_raised;
  }

  /// Advances the ramp by `dt` [s].
  void advance(double dt) noexcept {
    elapsed_ += dt;
    gain_ = elapsed_ < duration_ ? elapsed_ / duration_ : 1.0;
  }

  /// Returns the present gain, in [0, 1].
  [[nodiscard]] double gain() const noexcept { return gain_; }

 private:
  double duration_;
  double elapsed_ = 0;
  double gain_ = 0;
};

}  // namespace trephine
