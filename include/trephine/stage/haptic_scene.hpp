// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/core/spatial.hpp>
#include <trephine/stage/far_away.hpp>
#include <trephine/stage/pose_history.hpp>
#include <trephine/stage/scene_state.hpp>

#include <cstdint>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// The simulation loop of one tool in one bone: each tick takes a pose, returns wrench and status, and removes bone.
/// \code
/// auto scene = HapticScene{bone, 300, SurfaceApproxRenderer{...}, Cutting{}, DeviceLimits{.force = 3.3}};
/// TickResult r = scene.tick({.X_WT = pose, .spindle_on = true}, dt);
/// \endcode
/// Parts are stages, a `Cutting`, a `Veto`, a `SoftStructures` and tags; an unlisted part is not compiled into the loop
/// and takes no bytes.
/// `members.hpp` lists what renderers and parts may have besides. Steps of a tick:
/// 1. every part's `begin_tick`; the renderer's first, and a `reset` of the scene if its tool changed;
/// 2. check of the input;
/// 3. contact (renderer), in the grid's frame;
/// 4. the cut: after contact, so the wrench belongs to the bone before it;
/// 5. rotation of the wrench into W axes, and forces of cutting;
/// 6. the bound on the wrench's change, if the renderer has one (`ReleaseBound`);
/// 7. the stages, in listed order, and then what parts report;
/// 8. check of the result;
/// 9. `sent` of every part that has it.
///
/// Statuses of `tick`, besides the renderer's own:
/// - `kBadInput`: the pose is not finite, farther than kFarthestPosition, or no rotation within kRotationTolerance.
///   The wrench is zero, nothing is cut, and all state stays; the next good tick continues from it.
/// - `kNonFinite`: a law overflowed. The wrench is zero; renderer and stages are reset.
/// - `kStartedInside`: the wrench is not zero, and the bone there may be new to the scene. This is the first tick, a
///   tick after `reset`, or a tick after densities rose anywhere (`VoxelGrid::restore`). A scene that does not bound
///   its wrench (`bounds_wrench`) returns all of it, and the caller must ramp it, as a ServoLoop does.
/// - `kJump`: tool or bone moved farther in the tick than a hand moves them (`is_jump`). Nothing is cut. Only a scene
///   that cuts, bounds its wrench or uses velocities compares poses; others have the renderer's status.
/// - `kFarAway`: all else is well, and the tool has been over `kFarthestHand` from the grid for `kFarTime`. Poses are
///   likely in millimetres.
///
/// With a coupled tool or a `ReleaseLimit` the wrench never steps: from tick to tick it changes, as a vector, by at
/// most the stiffness times the tool's motion relative to the bone, and `release` times dt. A jump counts as no motion,
/// but lets the wrench fall where the device yields to it. Stages after the bound add their own change.
///
/// A bad `dt` is no error: it is clamped to [kShortestDt, kLongestDt] (NaN to the shortest), and the tick has zero
/// twist. Ticks after a gap (see PoseHistory) also have zero twist, so velocities never spike.
///
/// Threads: construct on any thread; call everything else on the haptic thread, which alone writes `bone`. Other
/// threads change options through a Mailbox (`Remote`). The bone must outlive the scene at a fixed address; its pose
/// may change between ticks. `tick` is noexcept and uses no heap, lock or clock. Its cost is that of renderer and
/// cut. Same input and same binary give the same bits.
template <class Density, class ContactRenderer, class... Parts>
  requires(detail::kMistake<Density, ContactRenderer, Parts...> == detail::SceneMistake::kNone)
class HapticScene<Density, ContactRenderer, Parts...> : public detail::SceneState<Density, ContactRenderer, Parts...> {
  using State = detail::SceneState<Density, ContactRenderer, Parts...>;
  using State::bone_;
  using State::isovalue_;
  using State::parts_;
  using State::renderer_;

 public:
  using State::cutting;
  using State::kCuts;
  using State::kHasTorque;
  using typename State::Grid;
  using typename State::Scalar;

  /// Throws std::invalid_argument if the isovalue is not finite, the burr is larger than the grid, or a part is not
  /// valid for this bone.
  HapticScene(Grid& bone, double isovalue, ContactRenderer renderer, Parts... parts)
      : State(bone, isovalue, std::move(renderer), std::move(parts)...) {
    if constexpr (kBoundsWrench) release_ = renderer_.release_bound();
  }

  /// Runs one step of the loop and returns the wrench on the tool, about T's origin, in W axes, with contact, removed
  /// volume and status. `dt` is the measured time since the last tick [s].
  [[nodiscard]] TickResult tick(const TickInput& input, double dt) noexcept {
    TickResult result;
    begin_tick();
    if (!is_usable_pose(input.X_WT)) return refuse_input(result);
    Now now{relative_pose(bone_->X_WG(), input.X_WT), dt, {input, bone_->X_WG()}};
    if (!touch(now, result)) return fail_non_finite(result);
    if (!cut(now, result)) return fail_non_finite(result);
    add_cutting_forces(now, result.wrench);
    bound_change(now, result.wrench);
    apply_stages(now, result);
    if (!is_finite(result.wrench)) return fail_non_finite(result);
    send(now, result);
    return result;
  }

  /// Takes it that no wrench acts on the hand, as before the first tick: the next one rises from zero. A tick that
  /// sends zero does so itself; a host does if it set the device's force to zero, a `replay` before its first tick.
  void forget_wrench() noexcept {
    if constexpr (kBoundsWrench) release_.reset();
    parts_.forget_wrench();
  }
  /// Clears contact, stage state and velocity; the bone, all options and the wrench that acts stay.
  void reset() noexcept {
    renderer_.reset();
    history_.invalidate();
    far_away_ = {};
    last_increase_stamp_ = 0;
    parts_.reset();
  }

  /// Takes contact, velocities, stages with their options, and the wrench that acts from a scene of the same renderer
  /// options. Its bone must have the same densities (`VoxelGrid::take`): then both go on with the same bits. For
  /// programs that try or undo: between ticks, and it may allocate. Mailboxes stay apart.
  void take(const HapticScene& other) {
    const TakenBone bones{.stamp = other.bone_->increase_stamp(), .own_stamp = bone_->increase_stamp()};
    State::take_contact(other);
    parts_.take(other.parts_, bones);
    history_ = other.history_;
    release_ = other.release_;
    far_away_ = other.far_away_;
    last_increase_stamp_ = other.last_increase_stamp_ == bones.stamp ? bones.own_stamp : 0;
  }

  /// Returns true if the scene keeps its wrench from stepping (`CoupledOptions::release`, `ReleaseLimit`). A servo loop
  /// then need not ramp it after a jump or a start in bone.
  [[nodiscard]] bool bounds_wrench() const noexcept {
    if constexpr (kBoundsWrench)
      if (release_.is_bounded()) return true;
    return parts_.bounds_wrench();
  }

 private:
  static constexpr bool kUsesTwist = (kStageUsesTwist<Parts> || ...);
  static constexpr bool kBoundsWrench = BoundsWrench<ContactRenderer>;
  static constexpr bool kUsesHistory = kUsesTwist || kCuts || kBoundsWrench;
  struct NoBound {};
  using Bound = std::conditional_t<kBoundsWrench, ReleaseBound, NoBound>;

  /// What the steps of a tick pass on.
  struct Now {
    Posed X_GT;
    double dt;  // as measured
    TickContext context;
    Vec6d motion = Vec6d::Zero();  // of the tool relative to the bone since the last tick, in W
    Wrenchd wrench_G{};            // of contact
    bool evaluated = true, restarts = false;
  };

  void begin_tick() noexcept {
    member::begin_tick(renderer_);
    if (member::take_tool_change(renderer_)) {
      reset();
      State::prepare_parts();
    }
    parts_.begin_tick();
  }

  [[nodiscard]] TickResult refuse_input(TickResult result) noexcept {
    history_.invalidate();
    forget_wrench();
    result.status = Status::kBadInput;
    return result;
  }

  /// Contact, its status and whether it starts anew; false where the law overflowed.
  [[nodiscard]] bool touch(Now& now, TickResult& result) noexcept {
    TickContext& context = now.context;
    context.dt = clamped_dt(now.dt);
    const Rendered<Scalar> found = State::render(now.X_GT, context.dt);
    now.wrench_G = found.wrench.template cast<double>();
    if constexpr (!kHasTorque) now.wrench_G.torque.setZero();
    if (found.status >= Status::kBadInput || !is_finite(now.wrench_G) || !is_finite(found.contact.depth)) return false;
    now.evaluated = found.evaluated;
    result.contact = context.contact = found.contact;
    result.status = found.status;
    const bool may_be_new_bone =
        std::exchange(last_increase_stamp_, bone_->increase_stamp()) != bone_->increase_stamp();
    if (may_be_new_bone && !(now.wrench_G == Wrenchd::zero()))
      result.status = worse(result.status, Status::kStartedInside);
    if (history_.is_jump(now.X_GT, context.dt)) result.status = worse(result.status, Status::kJump);
    now.restarts = result.status >= Status::kJump;
    context.status = result.status;
    return true;
  }

  /// Follows the tool and cuts where it went; false where the cut's pose or volume is not finite.
  [[nodiscard]] bool cut(Now& now, TickResult& result) noexcept {
    TickContext& context = now.context;
    if constexpr (kUsesHistory) {
      const Mat3d R_WG = context.X_WG.linear();
      const PoseStep step = history_.advance(context.input.X_WT, now.X_GT, R_WG, now.dt, now.restarts);
      context.twist = step.twist;
      context.twist_to_bone = step.twist_to_bone;
      if constexpr (kBoundsWrench)
        if (release_.acts() || !(now.wrench_G == Wrenchd::zero()))
          now.motion = rotated(R_WG, motion_to(step.X_GT_before, now.X_GT));
      if constexpr (kCuts) {
        // Where the tool was set elsewhere, it did not cut its way. And cuts wait for contact, never the other way:
        // else each cut could put off the next evaluation.
        const bool spindle_on = context.input.spindle_on;
        const CutTick tick{step.X_GT_before, now.X_GT,
                           step.continues,   now.restarts,
                           spindle_on,       spindle_on && !now.restarts && now.evaluated,
                           context.dt,       bounded_norm(now.wrench_G.force)};
        const double removed_mm3 = cutting().cut(*bone_, isovalue_, renderer_, tick, parts_.cut_floor());
        if (!(removed_mm3 >= 0) || !is_finite(removed_mm3)) return false;
        result.removed_mm3 = context.removed_mm3 = removed_mm3;
      }
    }
    return true;
  }

  void add_cutting_forces(const Now& now, Wrenchd& wrench) noexcept {
    wrench = now.wrench_G.rotated(now.context.X_WG.linear());
    if constexpr (kCuts) member::add_forces(cutting(), now.context, wrench);
  }

  void bound_change(const Now& now, Wrenchd& wrench) noexcept {
    if constexpr (kBoundsWrench)
      if (release_.acts() || !(wrench == Wrenchd::zero())) {
        release_.follow(now.context.input.X_WT, now.restarts);
        release_.apply(wrench, now.motion, now.context.dt);
      }
  }

  void apply_stages(const Now& now, TickResult& result) noexcept {
    parts_.apply(now.context, result.wrench);
    if constexpr (!kHasTorque) result.wrench.torque.setZero();
    parts_.add_to(result);
    if constexpr (!kHasTorque) result.structures.push.torque.setZero();
  }

  void send(const Now& now, TickResult& result) noexcept {
    parts_.sent(result.wrench);
    const bool stays_away = far_away_.is_far(*bone_, now.X_GT.translation(), now.context.dt);
    if (stays_away && result.status == Status::kOk) result.status = Status::kFarAway;
  }

  /// Resets the scene and returns a zero wrench with `kNonFinite`; contact, volumes and distance stay in the result.
  [[nodiscard]] TickResult fail_non_finite(TickResult result) noexcept {
    reset();
    forget_wrench();
    result.wrench = result.structures.push = Wrenchd::zero();
    result.cutting = {};
    result.status = Status::kNonFinite;
    return result;
  }

  [[no_unique_address]] PoseHistory<kUsesTwist, kCuts, kUsesHistory> history_;
  [[no_unique_address]] Bound release_;
  FarAway far_away_;
  std::uint64_t last_increase_stamp_ = 0;  // the bone's increase_stamp at the last tick; none has 0
};

template <class Density, class ContactRenderer, class... Parts>
HapticScene(VoxelGrid<Density>&, double, ContactRenderer, Parts...) -> HapticScene<Density, ContactRenderer, Parts...>;
template <class... Arguments>
  requires(!detail::kAreSceneArguments<Arguments...>)
HapticScene(Arguments&&...) -> HapticScene<detail::Misused<Arguments...>, void>;

}  // namespace trephine
