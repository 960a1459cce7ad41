// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/tick.hpp>

#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

/// Read-only data of one tick for its stages, filled in by the scene after contact and carving.
struct TickContext {
  const TickInput& input;    ///< the argument of `tick`, already checked
  const Posed& X_WG;         ///< the bone's pose in this tick
  Twist twist{};             ///< velocity of the tool in the world: T's origin, W axes [m/s, rad/s]
  Twist twist_to_bone{};     ///< velocity of the tool relative to the bone; equals `twist` for a fixed grid
  double dt = 0;             ///< interval since the last tick [s], within [kShortestDt, kLongestDt]
  ContactSummary contact{};  ///< the renderer's contact
  double removed_mm3 = 0;    ///< bone removed in this tick [mm³]
  Status status = Status::kOk;
};

/// A stage changes the wrench of a tick: damping, vibration, a filter, a limit. The scene calls `apply` once a tick on
/// the haptic thread, in the order of its list. The wrench acts on the tool, about T's origin, in W axes, and is
/// finite. `apply` must not allocate, lock, wait or read a clock. Optional members stand in members.hpp, but for one:
/// - `static constexpr bool kUsesTwist = false` states that the stage does not read the twists.
template <class S>
concept Stage = requires(S s, const TickContext& context, Wrenchd& wrench) {
  { s.apply(context, wrench) } noexcept -> std::same_as<void>;
};

/// True for a stage that reads the context's twists, which is the default.
template <class S>
inline constexpr bool kStageUsesTwist = Stage<S>;
template <class S>
  requires Stage<S> && requires { S::kUsesTwist; }
inline constexpr bool kStageUsesTwist<S> = S::kUsesTwist;

}  // namespace trephine
