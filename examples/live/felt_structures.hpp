// SPDX-License-Identifier: MIT
#pragma once

#include "held_drill.hpp"

#include <trephine/structure/soft_structures.hpp>

#include <limits>
#include <optional>

namespace live {

/// The soft structures of a drill, or none.
class FeltStructures {
 public:
  /// Takes a copy, with its own share of forces for the device.
  FeltStructures(const trephine::SoftStructures* soft, double force_scale, Inboxes& inboxes) : inboxes_(&inboxes) {
    if (soft == nullptr) return;
    soft_ = *soft;
    soft_->set_force_scale(force_scale);
  }
  /// Returns what there is, or nullptr.
  [[nodiscard]] trephine::SoftStructures* soft() noexcept { return soft_ ? &*soft_ : nullptr; }
  [[nodiscard]] const trephine::SoftStructures* soft() const noexcept { return soft_ ? &*soft_ : nullptr; }

  [[nodiscard]] FeltStructures& tool_load() noexcept { return *this; }
  void begin_tick() noexcept {
    const double* const force_scale = inboxes_->felt.take();
    if (!soft_) return;
    if (force_scale != nullptr) soft_->set_force_scale(*force_scale);
    soft_->begin_tick();
  }
  [[nodiscard]] trephine::LoadSum press(const trephine::Posed& X_GT) noexcept {
    return soft_ ? soft_->press(X_GT) : trephine::LoadSum{};
  }
  [[nodiscard]] double clearance(const trephine::Posed& X_GT) noexcept {
    return soft_ ? soft_->clearance(X_GT) : std::numeric_limits<double>::infinity();
  }
  void settle(const trephine::Posed& X_GT, double dt) noexcept {
    if (soft_) soft_->settle(X_GT, dt);
  }
  void add_to(trephine::StructureSummary& summary) const noexcept {
    if (soft_) soft_->add_to(summary);
  }

 private:
  std::optional<trephine::SoftStructures> soft_;
  Inboxes* inboxes_;
};

}  // namespace live
