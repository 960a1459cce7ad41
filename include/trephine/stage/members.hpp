// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/stage/context.hpp>

#include <concepts>
#include <cstdint>

/// Every member that a renderer or a part of a scene may have or leave out. A scene asks for them by these concepts and
/// calls them by the functions of the same meaning in `member`, which do nothing where T lacks the member. All are
/// called on the haptic thread, and none may throw, allocate, wait or lock unless said otherwise.
namespace trephine::inline TREPHINE_ALIGNED {

class ReleaseBound;  // contact/release_bound.hpp

/// How a scene whose state is taken knows its bone, and how the taking scene knows its own, which has the same
/// densities (`HapticScene::take`).
struct TakenBone {
  std::uint64_t stamp = 0, own_stamp = 0;             ///< `VoxelGrid::increase_stamp`
  const void *floor = nullptr, *own_floor = nullptr;  ///< `cut_floor()`
};

// --- Of renderers ----------------------------------------------------------------------------------------------------

/// `attach(bone, isovalue)` makes what the renderer reads of the bone and prepares for it, once, at the scene's
/// construction; it may allocate and throw. It returns a pointer to something with `view()`, which gives the field of a
/// tick. Without it the scene passes a DensityField.
template <class R, class Grid>
concept AttachesToBone = requires(R renderer, Grid& bone, double isovalue) { renderer.attach(bone, isovalue)->view(); };
/// `render(field, X_GT, dt)` is called instead of `render(field, X_GT)`, with the tick's duration [s]: a law in time.
template <class R, class Field>
concept RendersInTime = requires(R renderer, const Field& field, const Pose<typename R::Scalar>& X_GT, double dt) {
  renderer.render(field, X_GT, dt);
};
/// `render(field, X_GT, dt, load)` carries a ToolLoad beside the bone.
template <class R, class Field, class Load>
concept CarriesLoad = requires(R renderer, const Field& field, const Pose<typename R::Scalar>& X_GT, double dt,
                               Load& load) { renderer.render(field, X_GT, dt, load); };
/// `take_tool_change()` returns true once after the tool was replaced; the scene then starts anew with its head.
template <class R>
concept ChangesTool = requires(R renderer) {
  { renderer.take_tool_change() } noexcept -> std::same_as<bool>;
};
/// `release_bound()` gives the bound that the scene puts on the wrench's change from tick to tick.
template <class R>
concept BoundsWrench = requires(const R& renderer) {
  { renderer.release_bound() } noexcept -> std::same_as<ReleaseBound>;
};
/// `stiffness()` is the largest stiffness of contact as felt [N/m]: a servo loop compares it with the device's.
template <class R>
concept HasStiffness = requires(const R& renderer) { static_cast<double>(renderer.stiffness()); };
/// `tangent_stiffness(force)` is the tangent at a contact force [N], of a law that is not linear [N/m].
template <class R>
concept HasTangentStiffness =
    requires(const R& renderer, double force) { static_cast<double>(renderer.tangent_stiffness(force)); };
/// `cutting_head()` is the head that cuts, a Burr, a CuttingHead or an AnyHead; without it `shape()` cuts, a Burr.
template <class R>
concept HasCuttingHead = requires(const R& renderer) { renderer.cutting_head(); };
/// `cutting_pose(dt)` is the pose of a cut at once that stands for dt [s]: the head goes ahead at a speed.
template <class R>
concept CutsAtSpeed = requires(const R& renderer, double dt) { renderer.cutting_pose(dt); };
/// `pressure_cutting_pose(advance)` is the pose of a cut by pressure that may go ahead by `advance` [m], and
/// `foundation_law()` has the contact's `stiffness` [N/m³] and `ramp` [m], from which the pressed bone follows.
template <class R>
concept CutsByPressure = requires(const R& renderer, double advance) {
  renderer.pressure_cutting_pose(advance);
  renderer.foundation_law();
};
/// `take(other, field, own_field)` takes the state of a renderer in another field with the same densities; may
/// allocate. Without it the renderer is assigned.
template <class R, class Field>
concept TakesContact = requires(R renderer, const R& other, const Field& field) { renderer.take(other, field, field); };
/// `unlisted_force()` is the force of contacts that had no room in `contacts()`, in G [N].
template <class R>
concept HasUnlistedForce = requires(const R& renderer) { renderer.unlisted_force(); };

// --- Of parts --------------------------------------------------------------------------------------------------------

/// `validate()` throws std::invalid_argument for options out of range; called by the scene's constructor.
template <class P>
concept Validates = requires(const P& part) { part.validate(); };
/// `validate_for(bone, isovalue)` likewise, for what is not for this bone.
template <class P, class Grid>
concept ValidatesForBone =
    requires(const P& part, const Grid& bone, double isovalue) { part.validate_for(bone, isovalue); };
/// `prepare(head)` tells the head that cuts: at construction, and after a change of tool.
template <class P, class Head>
concept PreparesForHead = requires(P part, const Head& head) { part.prepare(head); };
/// `begin_tick()` is called first in every tick, even for bad input (`Remote`); a renderer's before the parts'.
template <class P>
concept BeginsTick = requires(P part) { part.begin_tick(); };
/// `reset()` clears state, but not what keeps the wrench from stepping. Called after a non-finite wrench and by the
/// scene's own `reset`.
template <class P>
concept Resets = requires(P part) { part.reset(); };
/// `forget_wrench()` clears the latter: no wrench acts on the hand. Called where a tick sends zero.
template <class P>
concept ForgetsWrench = requires(P part) { part.forget_wrench(); };
/// `bounds_wrench()` returns whether the part keeps the wrench from stepping.
template <class P>
concept SaysBoundsWrench = requires(const P& part) {
  { part.bounds_wrench() } -> std::convertible_to<bool>;
};
/// `vibrate(context, wrench)` adds what is meant to change fast, in the part's place among the stages.
template <class P>
concept Vibrates = requires(P part, const TickContext& context, Wrenchd& wrench) { part.vibrate(context, wrench); };
/// `add_forces(context, wrench)` adds the forces of what the part cut in this tick, before the bound on the wrench.
template <class P>
concept AddsCuttingForces =
    requires(P part, const TickContext& context, Wrenchd& wrench) { part.add_forces(context, wrench); };
/// `sent(wrench)` receives the wrench that leaves the scene, last in a tick, unless the tick ends with kBadInput or
/// kNonFinite.
template <class P>
concept HearsSent = requires(P part, const Wrenchd& wrench) { part.sent(wrench); };
/// `take(other, bones)` takes the state of the same part of another scene, in other bone with the same densities; may
/// allocate. Without it the part is assigned.
template <class P>
concept TakesState = requires(P part, const P& other, const TakenBone& bones) { part.take(other, bones); };
/// `add_to(summary)` adds the part's structures, or its cutting, to the result after the last stage.
template <class P>
concept StructureReporter = requires(const P& part, StructureSummary& summary) {
  { part.add_to(summary) } noexcept -> std::same_as<void>;
};
template <class P>
concept CuttingReporter = requires(const P& part, CuttingSummary& summary) {
  { part.add_to(summary) } noexcept -> std::same_as<void>;
};
/// `tool_load()` gives a ToolLoad, which the scene's renderer carries beside the bone (`SoftStructures`).
template <class P>
concept LoadsTool = requires(P& part) { part.tool_load(); };
/// `cut_floor()` is a pointer to the CutFloor below which no cut of the scene lowers bone, or null (`Veto`).
template <class P>
concept KeepsCutsOut = requires(const P& part) { part.cut_floor(); };

namespace member {

template <class T>
void validate(const T& part) {
  if constexpr (Validates<T>) part.validate();
}
template <class T, class Grid>
void validate_for(const T& part, const Grid& bone, double isovalue) {
  if constexpr (ValidatesForBone<T, Grid>) part.validate_for(bone, isovalue);
}
template <class T, class Head>
void prepare(T& part, const Head& head) noexcept {
  if constexpr (PreparesForHead<T, Head>) part.prepare(head);
}
template <class T>
void begin_tick(T& part) noexcept {
  if constexpr (BeginsTick<T>) part.begin_tick();
}
template <class T>
[[nodiscard]] bool take_tool_change(T& renderer) noexcept {
  if constexpr (ChangesTool<T>)
    return renderer.take_tool_change();
  else
    return false;
}
template <class T>
void reset(T& part) noexcept {
  if constexpr (Resets<T>) part.reset();
}
template <class T>
void forget_wrench(T& part) noexcept {
  if constexpr (ForgetsWrench<T>) part.forget_wrench();
}
template <class T>
[[nodiscard]] bool bounds_wrench(const T& part) noexcept {
  if constexpr (SaysBoundsWrench<T>)
    return static_cast<bool>(part.bounds_wrench());
  else
    return false;
}
template <class T>
void vibrate(T& part, const TickContext& context, Wrenchd& wrench) noexcept {
  if constexpr (Vibrates<T>) part.vibrate(context, wrench);
}
template <class T>
void add_forces(T& part, const TickContext& context, Wrenchd& wrench) noexcept {
  if constexpr (AddsCuttingForces<T>) part.add_forces(context, wrench);
}
template <class T>
void sent(T& part, const Wrenchd& wrench) noexcept {
  if constexpr (HearsSent<T>) part.sent(wrench);
}
template <class T>
void take(T& part, const T& other, const TakenBone& bones) {
  if constexpr (TakesState<T>)
    part.take(other, bones);
  else
    part = other;
}
template <class T, class Summary>
void add_to(const T& part, Summary& summary) noexcept {
  if constexpr (requires { part.add_to(summary); }) part.add_to(summary);
}
/// Returns the head that cuts: a Burr, a CuttingHead or an AnyHead.
template <class R>
[[nodiscard]] const auto& cutting_head(const R& renderer) noexcept {
  if constexpr (HasCuttingHead<R>)
    return renderer.cutting_head();
  else
    return renderer.shape();
}

/// Calls `body` with a head whose kind is known: an AnyHead's own, or the head itself.
template <class Head, class Body>
decltype(auto) visit_head(const Head& head, Body&& body) {
  if constexpr (requires { head.visit(body); })
    return head.visit(body);
  else
    return body(head);
}

}  // namespace member

}  // namespace trephine
