// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/pose_history.hpp>
#include <trephine/stage/scene_parts.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <sstream>
#include <tuple>
#include <type_traits>
#include <utility>

namespace trephine {

// What makes no scene ends here, in one sentence.
template <class Density, class ContactRenderer, class... Parts>
class HapticScene {
  using Mistake = detail::SceneMistake;
  static constexpr Mistake kMistake = detail::kMistake<Density, ContactRenderer, Parts...>;
  static_assert(kMistake != Mistake::kConstBone,
                "trephine::HapticScene: the bone is const, and a scene drills it: pass a VoxelGrid that is not const");
  static_assert(kMistake != Mistake::kTemporaryBone,
                "trephine::HapticScene: the bone is a temporary, and must outlive the scene: name it first");
  static_assert(kMistake != Mistake::kArguments,
                "trephine::HapticScene: write HapticScene{bone, isovalue, renderer, parts...}: a VoxelGrid, a number, "
                "a renderer, then what else there is");
  static_assert(kMistake != Mistake::kNoRenderer,
                "trephine::HapticScene: the third argument must be a renderer (see trephine/render/renderer.hpp): "
                "write HapticScene{bone, isovalue, renderer, parts...}");
  static_assert(
      kMistake != Mistake::kNoPart,
      "trephine::HapticScene: what follows the renderer must be a Stage (apply), a Carver (carve), EmptySpaceSkipping "
      "or ForceOnly, its functions noexcept; a scene has one renderer");
  static_assert(kMistake != Mistake::kTwoLimits, "trephine::HapticScene: more than one DeviceLimits");
  static_assert(kMistake != Mistake::kLimitsNotLast,
                "trephine::HapticScene: DeviceLimits must be the last stage: write it at the end of the list");
  static_assert(kMistake != Mistake::kTwoForceOnly, "trephine::HapticScene: more than one ForceOnly");

 public:
  template <class... Arguments>
  explicit HapticScene(Arguments&&...) noexcept {}
  TickResult tick(const TickInput&, double) noexcept;  // what uses the scene is no further mistake
  void reset() noexcept;
};

/// The whole loop of one tool in one bone: pose in, wrench and status out, bone removed on the way.
/// \code
/// auto scene = HapticScene{bone, 300, SurfaceApproxRenderer{...}, Milling{...}, DeviceLimits{.force = 3.3}};
/// TickResult r = scene.tick({.X_WT = pose, .spindle_on = true}, dt);
/// \endcode
/// Parts are stages, carvers and tags; what is not listed is not compiled into the loop and takes no bytes. A tick goes
/// 1. every part's `begin_tick`; 2. input checked; 3. contact (renderer), in the grid's frame; 4. carvers, in listed
/// order, so that a wrench belongs to the bone as the hand met it; 5. wrench turned into W; 6. stages, in listed order;
/// 7. result checked; 8. every part's `sent`, those that have it.
///
/// Statuses of `tick`, beside the renderer's own:
/// - `kBadInput`: a non-finite pose, one farther than kFarthestPosition, or no rotation within kRotationTolerance. Zero
///   wrench, nothing carved, renderer and stages left as they were; the next good tick goes on from there.
/// - `kNonFinite`: a law overflowed. Zero wrench; renderer and stages start anew.
/// - `kStartedInside`: there is a wrench, and the tick before it knew nothing of the bone there: the first tick, one
///   after `reset`, or one after densities rose (`VoxelGrid::restore`), here or elsewhere. The wrench is what the
///   contact gives; whoever sends it brings it in by a ramp, as a ServoLoop does.
/// A bad `dt` is no error: it is clamped to [kShortestDt, kLongestDt] (NaN to the shortest), and such a tick has zero
/// twist. So has any tick after a gap (see PoseHistory): velocities never spike.
///
/// Threads: construction anywhere, everything else on the haptic thread, which alone writes `bone`. Other threads
/// change options through a Mailbox (`Remote`). The bone must outlive the scene and stay where it is in memory; its
/// pose may change between ticks. `tick` is noexcept and takes no memory, lock or clock; its time is the renderer's and
/// the carvers'. Same input, same binary: same bits.
template <class Density, class ContactRenderer, class... Parts>
requires(detail::kMistake<Density, ContactRenderer, Parts...> ==
         detail::SceneMistake::kNone) class HapticScene<Density, ContactRenderer, Parts...> {
 public:
  using Grid = VoxelGrid<Density>;
  using Scalar = typename ContactRenderer::Scalar;
  using Gradient = typename ContactRenderer::Gradient;
  using Field = typename FieldOf<ContactRenderer, Density>::Type;

  static constexpr bool kHasTorque = kPartCount<ForceOnly, Parts...> == 0;
  static constexpr bool kCarves = (Carver<Parts, Grid> || ...);
  static constexpr bool kSkips = (Skipping<Parts> || ...);

  /// Throws std::invalid_argument where the isovalue is not finite, the burr is larger than the grid, a part's
  /// `validate` refuses, or the renderer reads stored gradients and the grid keeps none.
  HapticScene(VoxelGrid<Density>& bone, double isovalue, ContactRenderer renderer, Parts... parts)
      : bone_(&bone), isovalue_(isovalue), renderer_(std::move(renderer)), parts_(std::move(parts)...) {
    if (!std::isfinite(isovalue)) refuse("HapticScene", "isovalue must be finite", isovalue);
    if constexpr (requires { requires Gradient::kNeedsStored; })
      if (!bone.has_stored_gradients())
        refuse("HapticScene", "StoredGradient needs a grid made with GridOptions{.stored_gradients = true}", "none");
    // A burr that covers the whole bone has other units than the grid.
    const double diagonal = bone.spacing().cwiseProduct(Vec3d(bone.size()[0], bone.size()[1], bone.size()[2])).norm(),
                 tip_radius = renderer_.shape().tip_radius;
    if (!(2 * tip_radius <= diagonal)) {
      std::ostringstream rule;
      rule << "the grid's diagonal of " << diagonal << " m must exceed the burr's diameter (are both in metres?)";
      refuse("HapticScene", rule.str(), 2 * tip_radius);
    }
    if constexpr (!kHasTorque && requires { renderer_.disable_torque(); }) renderer_.disable_torque();
    for_each_part([&](const auto& part) {
      if constexpr (requires { part.validate(); }) part.validate();
      if constexpr (requires { part.validate_for(bone, isovalue); }) part.validate_for(bone, isovalue);
    });
    if constexpr (kUsesSurface) {
      surface_ = shared_bone_surface(bone, isovalue);
      renderer_.prepare(surface_->view());
    }
  }

  /// One step of the loop. `dt` is the measured time since the last tick [s].
  [[nodiscard]] TickResult tick(const TickInput& input, double dt) noexcept {
    begin_tick();
    TickResult result;
    if (!is_usable_pose(input.X_WT)) {
      history_.invalidate();
      result.status = Status::kBadInput;
      return result;
    }
    const Posed& X_WG = bone_->X_WG();
    const Posed X_GT = relative_pose(X_WG, input.X_WT);
    const Field field = bone_field();
    const Rendered<Scalar> found = render(field, X_GT.template cast<Scalar>());
    Wrenchd wrench_G = found.wrench.template cast<double>();
    if constexpr (!kHasTorque) wrench_G.torque.setZero();
    if (found.status >= Status::kBadInput || !is_finite(wrench_G) || !std::isfinite(found.contact.depth))
      return start_anew(result);
    result.contact = found.contact;
    result.status = found.status;
    const bool is_new_bone = std::exchange(known_increase_, bone_->increase_stamp()) != bone_->increase_stamp();
    if (is_new_bone && !(wrench_G == Wrenchd::zero())) result.status = worse(result.status, Status::kStartedInside);

    TickContext context{input};
    context.dt = clamped_dt(dt);
    context.contact = found.contact;
    context.status = result.status;
    if constexpr (kLooksBack) {
      if constexpr (kBitesInTime) dt_ = context.dt;
      const Posed X_GC = kCarves ? Posed(cutting_pose().template cast<double>()) : X_GT;
      if (!X_GC.matrix().allFinite()) return start_anew(result);
      const PoseStep step = history_.advance(input.X_WT, X_GT, X_GC, X_WG.linear(), dt, found.status >= Status::kJump);
      context.twist = step.twist;
      context.twist_to_bone = step.twist_to_bone;
      if constexpr (kCarves) {
        result.removed_mm3 = carve(step, X_GT, X_GC, {input.spindle_on, context.dt, magnitude(wrench_G.force)});
        if (!(result.removed_mm3 >= 0) || !std::isfinite(result.removed_mm3)) {
          result.removed_mm3 = 0;
          return start_anew(result);
        }
        context.removed_mm3 = result.removed_mm3;
      }
    }

    result.wrench = wrench_G.rotated(X_WG.linear());
    for_each_part([&](auto& part) {
      if constexpr (Stage<std::remove_cvref_t<decltype(part)>>) part.apply(context, result.wrench);
    });
    if constexpr (!kHasTorque) result.wrench.torque.setZero();
    if (!is_finite(result.wrench)) return start_anew(result);
    for_each_part([&](auto& part) {
      if constexpr (requires { part.sent(result.wrench); }) part.sent(result.wrench);
    });
    return result;
  }

  /// Forgets all contact, stage state and velocity; the bone and all options stay.
  void reset() noexcept {
    renderer_.reset();
    history_.invalidate();
    known_increase_ = 0;
    for_each_part([](auto& part) {
      if constexpr (requires { part.reset(); }) part.reset();
    });
  }

  [[nodiscard]] ContactRenderer& renderer() noexcept { return renderer_; }
  [[nodiscard]] const ContactRenderer& renderer() const noexcept { return renderer_; }
  /// The listed part that is, or derives from, T (so `part<Damping>()` finds a Remote<Damping>); it must be unique.
  template <class T>
  [[nodiscard]] T& part() noexcept {
    return std::get<index_of<T>()>(parts_);
  }
  template <class T>
  [[nodiscard]] const T& part() const noexcept {
    return std::get<index_of<T>()>(parts_);
  }
  [[nodiscard]] const Grid& bone() const noexcept { return *bone_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  /// The renderer's largest contact stiffness [N/m], where it states one: a servo loop compares it with the device's.
  [[nodiscard]] double stiffness() const noexcept requires requires(const ContactRenderer& r) { r.stiffness(); }
  { return static_cast<double>(renderer_.stiffness()); }

  /// The same as a tangent where the contact presses with `force` [N], of a renderer that is no plain spring.
  [[nodiscard]] double tangent_stiffness(double force) const requires requires(const ContactRenderer& r) {
    r.tangent_stiffness(force);
  }
  { return static_cast<double>(renderer_.tangent_stiffness(force)); }

  /// Poses as the last good tick left them, carried along should the grid have moved since.
  [[nodiscard]] Posed proxy_pose_W() const noexcept { return in_world(renderer_.proxy_pose()); }
  [[nodiscard]] Posed visual_pose_W() const noexcept { return in_world(renderer_.visual_pose()); }
  [[nodiscard]] Posed cutting_pose_W() const noexcept { return in_world(cutting_pose()); }

  /// Writes the last good tick's contact points, in W, as far as `out` has room; returns how many were written.
  std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept {
    const std::span<const ContactPoint<Scalar>> found = renderer_.contacts();
    const std::size_t count = std::min(found.size(), out.size());
    const Posed& X_WG = bone_->X_WG();
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d p_G = found[i].position.template cast<double>();
      out[i].position = X_WG.linear() * p_G + X_WG.translation();
      out[i].normal = X_WG.linear() * found[i].normal.template cast<double>();
      out[i].force = X_WG.linear() * found[i].force.template cast<double>();
    }
    return count;
  }

 private:
  static constexpr bool kUsesTwist = (kStageUsesTwist<Parts> || ...);
  static constexpr bool kLooksBack = kUsesTwist || kCarves;
  using History = PoseHistory<kUsesTwist, kCarves>;
  /// The renderer's cutting pose goes ahead by a speed.
  static constexpr bool kBitesInTime = (kCutsAtOnce<Parts> || ...) && requires(const ContactRenderer& r, double dt) {
    r.cutting_pose(dt);
  };
  struct NoTime {};
  static constexpr bool kUsesSurface = UsesBoneSurface<ContactRenderer>;
  struct NoSurface {};
  using Surface = std::conditional_t<kUsesSurface, std::shared_ptr<BoneSurface<Density>>, NoSurface>;

  template <class T>
  static consteval std::size_t index_of() {
    static_assert(kPartCount<T, Parts...> == 1, "trephine::HapticScene::part<T>: T must name exactly one listed part");
    constexpr std::array<bool, sizeof...(Parts)> is{std::derived_from<Parts, T>...};
    return static_cast<std::size_t>(std::find(is.begin(), is.end(), true) - is.begin());
  }

  template <class Function>
  void for_each_part(Function&& function) {
    std::apply([&](auto&... part) { (function(part), ...); }, parts_);
  }

  [[nodiscard]] Field bone_field() noexcept {
    if constexpr (kUsesSurface)
      return surface_->view();
    else
      return contact_field(renderer_, *bone_, isovalue_);
  }

  [[nodiscard]] Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT) noexcept {
    if constexpr (kSkips) {
      constexpr std::array<bool, sizeof...(Parts)> is{Skipping<Parts>...};
      constexpr auto at = static_cast<std::size_t>(std::find(is.begin(), is.end(), true) - is.begin());
      return renderer_.render(std::get<at>(parts_).field_for(field), X_GT);
    } else {
      return renderer_.render(field, X_GT);
    }
  }

  [[nodiscard]] Pose<Scalar> cutting_pose() const noexcept {
    if constexpr (kBitesInTime)
      return renderer_.cutting_pose(dt_);
    else
      return renderer_.cutting_pose();
  }

  void begin_tick() noexcept {
    if constexpr (requires { renderer_.begin_tick(); }) renderer_.begin_tick();
    for_each_part([](auto& part) {
      if constexpr (requires { part.begin_tick(); }) part.begin_tick();
    });
  }

  /// Zero wrench and a clean start; what was found and removed stays in the result.
  [[nodiscard]] TickResult start_anew(TickResult result) noexcept {
    reset();
    result.wrench = Wrenchd::zero();
    result.status = Status::kNonFinite;
    return result;
  }

  [[nodiscard]] double carve(const PoseStep& step, const Posed& X_GT, const Posed& X_GC,
                             const CarveContext& context) noexcept {
    double removed_mm3 = 0;
    for_each_part([&](auto& part) {
      if constexpr (Carver<std::remove_cvref_t<decltype(part)>, Grid>) {
        const bool probe = follows_probe(part);
        const Posed& before = probe ? step.X_GT_before : step.X_GC_before;
        const Posed& now = probe ? X_GT : X_GC;
        removed_mm3 += part.carve(*bone_, isovalue_, before, now, renderer_.shape(), context);
      }
    });
    return removed_mm3;
  }

  [[nodiscard]] Posed in_world(const Pose<Scalar>& X_G) const noexcept {
    return bone_->X_WG() * X_G.template cast<double>();
  }
  /// Without overflow: a carver never sees an infinite force.
  [[nodiscard]] static double magnitude(const Vec3d& v) noexcept {
    return std::min(std::hypot(v.x(), v.y(), v.z()), std::numeric_limits<double>::max());
  }

  Grid* bone_;
  double isovalue_;
  ContactRenderer renderer_;
  [[no_unique_address]] Surface surface_;
  [[no_unique_address]] std::tuple<Parts...> parts_;
  [[no_unique_address]] History history_;
  [[no_unique_address]] std::conditional_t<kBitesInTime, double, NoTime> dt_{};  // of the last good tick [s]
  std::uint64_t known_increase_ = 0;  // the bone's increase_stamp at the last tick; none has 0
};

template <class Density, class ContactRenderer, class... Parts>
HapticScene(VoxelGrid<Density>&, double, ContactRenderer, Parts...) -> HapticScene<Density, ContactRenderer, Parts...>;
template <class... Arguments>
requires(!detail::kAreScene<Arguments...>) HapticScene(Arguments&&...)
->HapticScene<detail::Misused<Arguments...>, void>;

}  // namespace trephine
