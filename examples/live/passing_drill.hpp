// SPDX-License-Identifier: MIT
#pragma once

#include "held_drill.hpp"
#include "tool_body.hpp"

#include <trephine/core/tolerances.hpp>
#include <trephine/stage/mailbox.hpp>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <utility>

namespace live {

/// Where a hand is carried, and how long that takes at most [s].
struct CarriedHand {
  Posed X_WT = Posed::Identity();
  double seconds = 0;
};

/// A drill that bone never locks in. Where bone comes to be around the drill (an undo, a restore, a larger tool), or
/// the hand is carried elsewhere, the drill passes through bone: no force, no contact and no cut, until all of it is
/// out. Then its scene starts anew at the hand's pose. Haptic thread, unless stated.
class PassingDrill {
 public:
  /// A carried hand arrives within this of its place [m].
  static constexpr double kArrived = 0.5e-3;
  /// A hand presses a drill at most this far into bone [m]: a drill held farther away is not carried over.
  static constexpr double kPressed = 15e-3;

  PassingDrill(const drill::Grid& bone, double isovalue) : bone_(bone), isovalue_(isovalue) {}

  /// Takes the drill's place from now on, and what is torn stays torn. Where it fits at the pose of the last drill, it
  /// goes on from there. Between ticks.
  void take(std::unique_ptr<HeldDrill> drill, const DrillSettings& settings) {
    if (drill_ != nullptr && drill_->soft() != nullptr) torn_ = drill_->soft()->tears();
    drill_ = std::move(drill);
    if (drill_->soft() != nullptr) drill_->soft()->take_tears(torn_);
    const double voxel = bone_.spacing().minCoeff();
    body_ = settings.shape() != nullptr ? ToolBody(*settings.shape(), voxel) : ToolBody(settings.burr, voxel);
    const bool goes_on = !passes_ && (tool_W_.translation() - probe_W_.translation()).norm() <= kPressed;
    if (goes_on && body_.is_free(bone_, isovalue_, tool_W_))
      (void)drill_->tick({.X_WT = tool_W_}, kFirstTick);
    else
      pass(passes_ ? left_ : 0);
  }
  /// Bone was put back: it may be around the drill. Between ticks.
  void bone_rose() noexcept {
    if (!body_.is_free(bone_, isovalue_, tool_W_)) pass(0);
  }
  /// Mends soft structures. Between ticks.
  void heal() noexcept {
    torn_.clear();
    if (drill_->soft() != nullptr) drill_->soft()->heal();
  }
  /// The hand is carried to a pose, and passes bone on the way, for `seconds` at most. Window thread.
  void carry(const Posed& X_WT, double seconds) noexcept { carried_.post({X_WT, seconds}); }

  trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept {
    if (const CarriedHand* carried = carried_.take()) {
      goal_W_ = carried->X_WT;
      pass(carried->seconds);
    }
    if (!trephine::is_usable_pose(input.X_WT)) return drill_->tick(input, dt);
    probe_W_ = input.X_WT;
    if (passes_ && !ends_passing(dt)) {
      tool_W_ = probe_W_;
      trephine::TickResult nothing;
      nothing.status = trephine::Status::kStartedInside;
      return nothing;
    }
    const trephine::TickResult result = drill_->tick(input, dt);
    tool_W_ = drill_->tool_W();
    return result;
  }

  /// True while bone neither holds the drill nor is cut.
  [[nodiscard]] bool passes() const noexcept { return passes_; }
  /// Pose of the tool to draw.
  [[nodiscard]] const Posed& tool_W() const noexcept { return tool_W_; }
  [[nodiscard]] std::size_t contacts_W(std::span<trephine::ContactPoint<double>> out) const noexcept {
    return passes_ ? 0 : drill_->contacts_W(out);
  }
  [[nodiscard]] StructureReport structures() const noexcept {
    return passes_ ? StructureReport{} : drill_->structures();
  }

 private:
  static constexpr double kFirstTick = 1e-3;  // [s]

  void pass(double seconds) noexcept {
    passes_ = true;
    left_ = seconds;
  }
  [[nodiscard]] bool ends_passing(double dt) noexcept {
    left_ -= std::min(dt, 0.1);
    const bool arrived = (probe_W_.translation() - goal_W_.translation()).norm() < kArrived;
    if ((left_ > 0 && !arrived) || !body_.is_free(bone_, isovalue_, probe_W_)) return false;
    drill_->reset();
    passes_ = false;
    return true;
  }

  const drill::Grid& bone_;
  double isovalue_;
  std::unique_ptr<HeldDrill> drill_;
  trephine::MembraneTears torn_;  // by the last drill that felt them
  ToolBody body_{trephine::Burr{}, 1e-3};
  trephine::Mailbox<CarriedHand> carried_;
  Posed probe_W_ = Posed::Identity(), tool_W_ = Posed::Identity(), goal_W_ = Posed::Identity();
  bool passes_ = true;  // so a session starts
  double left_ = 0;     // of a carried hand's way [s]
};

}  // namespace live
