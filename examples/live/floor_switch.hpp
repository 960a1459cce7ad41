// SPDX-License-Identifier: MIT
#pragma once

#include "held_drill.hpp"

#include <trephine/voxel/cut_floor.hpp>

#include <cstdint>
#include <memory>
#include <utility>

namespace live {

/// Keeps a scene's cuts above one of two floors of the same bone: one watches structures, the other refuses to cut
/// them. The choice comes from an inbox at the start of a tick. Both floors are of the bone as loaded, and stay
/// allocated, so a switch takes no memory.
class FloorSwitch {
 public:
  using Floor = trephine::CutFloor<std::int16_t>;

  FloorSwitch(std::shared_ptr<Floor> watch, std::shared_ptr<Floor> refuse, bool refuses, Inboxes& inboxes)
      : watch_(std::move(watch)), refuse_(std::move(refuse)), refuses_(refuses), inboxes_(&inboxes) {}

  void begin_tick() noexcept {
    if (const bool* const refuses = inboxes_->refuses.take()) refuses_ = *refuses;
  }
  [[nodiscard]] Floor* cut_floor() const noexcept { return refuses_ ? refuse_.get() : watch_.get(); }

  [[nodiscard]] double taken_mm3() const noexcept { return watch_->taken_mm3(); }
  [[nodiscard]] double refused_mm3() const noexcept { return refuse_->refused_mm3(); }

 private:
  std::shared_ptr<Floor> watch_, refuse_;
  bool refuses_;
  Inboxes* inboxes_;
};

}  // namespace live
