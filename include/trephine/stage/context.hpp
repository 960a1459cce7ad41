// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>

#include <concepts>

namespace trephine {

/// What a stage may know about the tick it shapes. Made by the scene after contact and carving, read-only.
struct TickContext {
  const TickInput& input;    ///< as given to `tick`; already checked
  Twist twist{};             ///< the tool's velocity in the world: T's origin, W axes [m/s, rad/s]
  Twist twist_to_bone{};     ///< the same as seen from the bone: equal to `twist` while the grid stands still
  double dt = 0;             ///< interval since the last tick [s], within [kShortestDt, kLongestDt]
  ContactSummary contact{};  ///< what the renderer found
  double removed_mm3 = 0;    ///< bone removed in this tick [mm³]
  Status status = Status::kOk;
};

/// One step of wrench -> wrench: damping, vibration, a filter, a limit. `apply` runs once a tick on the haptic thread
/// in the order in which the scene lists its stages; the wrench is on the tool, about T's origin, in W axes, and
/// finite. It must not allocate, lock, wait or read a clock. Optional members:
/// - `reset() noexcept`: forget all state (the scene calls it after a non-finite wrench and from its own `reset`);
/// - `begin_tick() noexcept`: called first in every tick, even for bad input (see `Remote`);
/// - `sent(const Wrenchd&) noexcept`: the wrench as it leaves the scene, after every stage and limit; called last in a
///   tick, in every one that gets so far: one that answers `kBadInput` sends zero without a word;
/// - `validate() const`: throws std::invalid_argument; the scene's constructor calls it;
/// - `static constexpr bool kUsesTwist = false`: the twists need not be computed for this stage.
template <class S>
concept Stage = requires(S s, const TickContext& context, Wrenchd& wrench) {
  { s.apply(context, wrench) }
  noexcept->std::same_as<void>;
};

/// Whether a stage reads the context's twists; yes unless it says otherwise.
template <class S>
inline constexpr bool kStageUsesTwist = Stage<S>;
template <class S>
requires Stage<S> && requires { S::kUsesTwist; }
inline constexpr bool kStageUsesTwist<S> = S::kUsesTwist;

}  // namespace trephine
