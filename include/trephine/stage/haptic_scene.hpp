// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/release_bound.hpp>
#include <trephine/stage/cutting_poses.hpp>
#include <trephine/stage/far_away.hpp>
#include <trephine/stage/pose_history.hpp>
#include <trephine/stage/scene_parts.hpp>
#include <trephine/voxel/isovalue_warning.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

// Primary template: a wrong list of arguments ends the compilation here, with one message.
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
                "a renderer, then its parts");
  static_assert(kMistake != Mistake::kNoRenderer,
                "trephine::HapticScene: the third argument must be a renderer (see trephine/render/renderer.hpp): "
                "write HapticScene{bone, isovalue, renderer, parts...}");
  static_assert(kMistake != Mistake::kNotAPart,
                "trephine::HapticScene: each part after the renderer must be a Stage (apply), a Carver (carve), "
                "EmptySpaceSkipping or ForceOnly, its functions noexcept; a scene has one renderer");
  static_assert(kMistake != Mistake::kOtherHead,
                "trephine::HapticScene: a carver takes a Burr, and the renderer's tool has another head: take any head "
                "(const auto&) in carve");
  static_assert(kMistake != Mistake::kTwoLimits, "trephine::HapticScene: more than one DeviceLimits");
  static_assert(kMistake != Mistake::kLimitsNotLast,
                "trephine::HapticScene: DeviceLimits must be the last stage: write it at the end of the list");
  static_assert(kMistake != Mistake::kTwoForceOnly, "trephine::HapticScene: more than one ForceOnly");
  static_assert(kMistake != Mistake::kNoPressure,
                "trephine::HapticScene: a PressureCut needs a CuttingForce, which says how much the thrust cuts: list "
                "one, or take another cut");

 public:
  template <class... Arguments>
  explicit HapticScene(Arguments&&...) noexcept {}
  TickResult tick(const TickInput&, double) noexcept;  // declared so that uses of the scene add no further errors
  void reset() noexcept;
};

/// The simulation loop of one tool in one bone: each tick takes a pose, returns wrench and status, and removes bone.
/// \code
/// auto scene = HapticScene{bone, 300, SurfaceApproxRenderer{...}, Milling{...}, DeviceLimits{.force = 3.3}};
/// TickResult r = scene.tick({.X_WT = pose, .spindle_on = true}, dt);
/// \endcode
/// Parts are stages, carvers and tags; an unlisted part is not compiled into the loop and takes no bytes. Steps of a
/// tick:
/// 1. every part's `begin_tick`; the renderer's first, and a `reset` of the scene if its tool changed;
/// 2. check of the input;
/// 3. contact (renderer), in the grid's frame;
/// 4. carvers, in listed order: after contact, so the wrench belongs to the bone before the cut;
/// 5. rotation of the wrench into W axes, and cutting forces (`CuttingForce`);
/// 6. the bound on the wrench's change, if the renderer has one (`ReleaseBound`); then the other stages, in listed
/// order;
/// 7. `add_to` of every part that reports structures or cutting;
/// 8. check of the result;
/// 9. `sent` of every part that has it.
///
/// Statuses of `tick`, besides the renderer's own:
/// - `kBadInput`: the pose is not finite, farther than kFarthestPosition, or no rotation within kRotationTolerance.
///   The wrench is zero, nothing is carved, and renderer and stages keep their state; the next good tick continues
///   from it.
/// - `kNonFinite`: a law overflowed. The wrench is zero; renderer and stages are reset.
/// - `kStartedInside`: the wrench is not zero, and the bone there may be new to the scene. This is the first tick, a
///   tick after `reset`, or a tick after densities rose anywhere (`VoxelGrid::restore`). Where the scene does not
///   bound its wrench (`bounds_wrench`) it is the full contact wrench, and the caller must ramp it, as a ServoLoop
///   does.
/// - `kJump`: tool or bone moved farther in the tick than a hand moves them (`is_jump`). Nothing is cut. Only a scene
///   that cuts, bounds its wrench or uses velocities compares poses; others have the renderer's status.
/// - `kFarAway`: all else is well, and the tool has been over `kFarthestHand` from the grid for `kFarTime`. Poses are
///   likely in millimetres.
///
/// With a coupled tool or a `ReleaseLimit` the wrench never steps: from tick to tick it changes, as a vector, by at
/// most the stiffness times the tool's motion relative to the bone, and `release` times dt. A jump counts as no motion,
/// but lets the wrench fall where the device yields to it.
/// Only `kBadInput` and `kNonFinite` send zero at once. Stages after the bound add their own change.
///
/// A bad `dt` is no error: it is clamped to [kShortestDt, kLongestDt] (NaN to the shortest), and the tick has zero
/// twist. Ticks after a gap (see PoseHistory) also have zero twist, so velocities never spike.
///
/// A renderer that gives cuts at once a speed bites at most every `kShortestBite`: a bite makes bone's surface anew,
/// which at 40 kHz takes longer than a tick.
///
/// Threads: construct on any thread; call everything else on the haptic thread, which alone writes `bone`. Other
/// threads change options through a Mailbox (`Remote`). The bone must outlive the scene at a fixed address; its pose
/// may change between ticks. `tick` is noexcept and uses no heap, lock or clock. Its cost is that of renderer and
/// carvers. Same input and same binary give the same bits.
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
  static constexpr bool kSkipsEmptySpace = (EmptySpaceSkipper<Parts> || ...);
  static constexpr bool kReportsStructures = (StructureReporter<Parts> || ...);
  static constexpr bool kReportsCutting = (CuttingReporter<Parts> || ...);

  /// Throws std::invalid_argument if the isovalue is not finite, the burr is larger than the grid, a part's `validate`
  /// throws, or the renderer reads stored gradients and the grid has none.
  HapticScene(VoxelGrid<Density>& bone, double isovalue, ContactRenderer renderer, Parts... parts)
      : bone_(&bone), isovalue_(isovalue), renderer_(std::move(renderer)), parts_(std::move(parts)...) {
    if (!is_finite(isovalue)) refuse("HapticScene", "isovalue must be finite", isovalue);
    if constexpr (requires { requires Gradient::kNeedsStored; })
      if (!bone.has_stored_gradients())
        refuse("HapticScene", "StoredGradient needs a grid made with GridOptions{.stored_gradients = true}", "none");
    check_size(bone, renderer_.shape());
    if constexpr (!kHasTorque && requires { renderer_.disable_torque(); }) renderer_.disable_torque();
    for_each_part([&](const auto& part) {
      if constexpr (requires { part.validate(); }) part.validate();
      if constexpr (requires { part.validate_for(bone, isovalue); }) part.validate_for(bone, isovalue);
    });
    if constexpr (kUsesSurface) {
      surface_ = shared_bone_surface(bone, isovalue);
      renderer_.prepare(surface_->view());
    }
    if constexpr (kBoundsWrench) release_ = renderer_.release_bound();
    prepare_parts();
  }

  /// Throws std::invalid_argument for a burr larger than the bone: burr and grid then differ in units.
  static void check_size(const Grid& bone, const Burr& burr) {
    const double diagonal = bone.spacing().cwiseProduct(Vec3d(bone.size()[0], bone.size()[1], bone.size()[2])).norm();
    if (2 * burr.tip_radius <= diagonal) return;
    std::ostringstream rule;
    rule << "the grid's diagonal of " << diagonal << " m must exceed the burr's diameter (are both in metres?)";
    refuse("HapticScene", rule.str(), 2 * burr.tip_radius);
  }

  /// Runs one step of the loop and returns the wrench on the tool, about T's origin, in W axes, with contact, removed
  /// volume and status. `dt` is the measured time since the last tick [s].
  [[nodiscard]] TickResult tick(const TickInput& input, double dt) noexcept {
    begin_tick();
    TickResult result;
    if (!is_usable_pose(input.X_WT)) {
      history_.invalidate();
      forget_wrench();
      result.status = Status::kBadInput;
      return result;
    }
    const Posed& X_WG = bone_->X_WG();
    const Posed X_GT = relative_pose(X_WG, input.X_WT);
    const Field field = bone_field();
    const Rendered<Scalar> found = render(field, X_GT.template cast<Scalar>(), clamped_dt(dt));
    Wrenchd wrench_G = found.wrench.template cast<double>();
    if constexpr (!kHasTorque) wrench_G.torque.setZero();
    if (found.status >= Status::kBadInput || !is_finite(wrench_G) || !is_finite(found.contact.depth))
      return fail_non_finite(result);
    result.contact = found.contact;
    result.status = found.status;
    const bool may_be_new_bone =
        std::exchange(last_increase_stamp_, bone_->increase_stamp()) != bone_->increase_stamp();
    if (may_be_new_bone && !(wrench_G == Wrenchd::zero())) result.status = worse(result.status, Status::kStartedInside);
    if (history_.is_jump(X_GT, clamped_dt(dt))) result.status = worse(result.status, Status::kJump);
    const bool restarts = result.status >= Status::kJump;

    TickContext context{input, X_WG};
    context.dt = clamped_dt(dt);
    context.contact = found.contact;
    context.status = result.status;
    Vec6d motion = Vec6d::Zero();  // of the tool relative to the bone, in W
    if constexpr (kUsesHistory) {
      PressedCut pressed;
      for_each_part([&](auto& part) {
        using Part = std::remove_cvref_t<decltype(part)>;
        static_assert(CuttingPart<Part, Grid, ContactRenderer> || !DecidesCuts<Part>,
                      "trephine::HapticScene: the part says that it decides cuts, but is no CuttingPart");
        if constexpr (kCarves && CuttingPart<Part, Grid, ContactRenderer>)
          pressed = part.engage(*bone_, isovalue_, renderer_, context.dt, input.spindle_on);
      });
      Posed X_GC = X_GT;
      if constexpr (kCarves) X_GC = cutting_poses_.next(renderer_, parts_, pressed.way, context.dt, restarts);
      if (!is_finite(X_GC)) return fail_non_finite(result);
      const double cut_dt = std::max(dt, cutting_poses_.bite_time());
      const PoseStep step = history_.advance(input.X_WT, X_GT, X_GC, X_WG.linear(), dt, cut_dt, restarts);
      context.twist = step.twist;
      context.twist_to_bone = step.twist_to_bone;
      if constexpr (kBoundsWrench)
        if (release_.acts() || !(wrench_G == Wrenchd::zero())) motion = motion_in_world(step.X_GT_before, X_GT);
      if constexpr (kCarves) {
        // Where the tool was set elsewhere, it did not cut its way. And cuts wait for contact, never the other way:
        // else each cut could put off the next evaluation.
        const bool cuts = input.spindle_on && !restarts && found.evaluated;
        const CarveContext cut{cuts, context.dt, magnitude(wrench_G.force), pressed.fraction};
        result.removed_mm3 = carve(step, X_GT, X_GC, cut);
        if (!(result.removed_mm3 >= 0) || !is_finite(result.removed_mm3)) {
          result.removed_mm3 = 0;
          return fail_non_finite(result);
        }
        context.removed_mm3 = result.removed_mm3;
      }
    }

    result.wrench = wrench_G.rotated(X_WG.linear());
    for_each_part([&](auto& part) {
      if constexpr (kAddsCuttingForce<std::remove_cvref_t<decltype(part)>>) part.apply(context, result.wrench);
    });
    if constexpr (kBoundsWrench)
      if (release_.acts() || !(result.wrench == Wrenchd::zero())) {
        release_.follow(input.X_WT, restarts);
        release_.apply(result.wrench, motion, context.dt);
      }
    for_each_part([&](auto& part) {
      using Part = std::remove_cvref_t<decltype(part)>;
      if constexpr (Stage<Part> && !kAddsCuttingForce<Part>) part.apply(context, result.wrench);
      if constexpr (requires { part.vibrate(context, result.wrench); }) part.vibrate(context, result.wrench);
    });
    if constexpr (!kHasTorque) result.wrench.torque.setZero();
    if constexpr (kReportsStructures) report_structures(result.structures);
    if constexpr (kReportsCutting) report_cutting(result.cutting);
    if (!is_finite(result.wrench)) return fail_non_finite(result);
    for_each_part([&](auto& part) {
      if constexpr (requires { part.sent(result.wrench); }) part.sent(result.wrench);
    });
    const bool stays_away = far_away_.is_far(*bone_, X_GT.translation(), context.dt);
    if (stays_away && result.status == Status::kOk) result.status = Status::kFarAway;
    return result;
  }

  /// Takes it that no wrench acts on the hand, as before the first tick: the next one rises from zero. A tick that
  /// sends zero does so itself; a host does if it set the device's force to zero, a `replay` before its first tick.
  void forget_wrench() noexcept {
    if constexpr (kBoundsWrench) release_.reset();
    for_each_part([](auto& part) {
      if constexpr (requires { part.forget_wrench(); }) part.forget_wrench();
    });
  }
  /// Clears contact, stage state and velocity; the bone, all options and the wrench that acts stay.
  void reset() noexcept {
    renderer_.reset();
    history_.invalidate();
    cutting_poses_.reset();
    far_away_ = {};
    last_increase_stamp_ = 0;
    for_each_part([](auto& part) {
      if constexpr (requires { part.reset(); }) part.reset();
    });
  }

  [[nodiscard]] ContactRenderer& renderer() noexcept { return renderer_; }
  [[nodiscard]] const ContactRenderer& renderer() const noexcept { return renderer_; }
  /// Returns the listed part that is, or derives from, T; it must be unique. So `part<Damping>()` finds a
  /// Remote<Damping>.
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
  /// Returns the renderer's largest contact stiffness [N/m], if it declares it. A servo loop compares it with the
  /// device's.
  [[nodiscard]] double stiffness() const noexcept requires requires(const ContactRenderer& r) { r.stiffness(); }
  { return static_cast<double>(renderer_.stiffness()); }

  /// Returns the tangent stiffness [N/m] at a contact force of `force` [N], if the renderer declares it, because its
  /// law is not linear.
  [[nodiscard]] double tangent_stiffness(double force) const requires requires(const ContactRenderer& r) {
    r.tangent_stiffness(force);
  }
  { return static_cast<double>(renderer_.tangent_stiffness(force)); }

  /// Returns true if the scene keeps its wrench from stepping (`CoupledOptions::release`, `ReleaseLimit`). A servo loop
  /// then need not ramp it after a jump or a start in bone.
  [[nodiscard]] bool bounds_wrench() const noexcept {
    bool bounds = false;
    if constexpr (kBoundsWrench) bounds = release_.is_bounded();
    const auto look_at = [&](const auto& part) {
      if constexpr (requires { part.bounds_wrench(); }) bounds = bounds || part.bounds_wrench();
    };
    std::apply([&](const auto&... part) { (look_at(part), ...); }, parts_);
    return bounds;
  }
  /// Returns one sentence for each reason why the scene's results may be off: voxels too long for the tool, an isovalue
  /// that finds no surface, a stiffness that is likely in other units.
  [[nodiscard]] std::vector<std::string> warnings() const {
    std::vector<std::string> warnings;
    const double voxel = bone_->spacing().maxCoeff(), radius = renderer_.shape().tip_radius;
    if (kCarves && radius < kFewestVoxels * voxel) {
      std::ostringstream s;
      s << "trephine::HapticScene: the tool's diameter is " << 2 * radius / voxel << " of the longest voxels: below "
        << 2 * kFewestVoxels << " a hole's section is off by 4 to 20 %; `resampled` makes finer voxels";
      warnings.push_back(s.str());
    }
    if (const std::string isovalue = isovalue_warning(*bone_, isovalue_); !isovalue.empty())
      warnings.push_back("trephine::HapticScene: " + isovalue);
    if constexpr (requires { renderer_.stiffness(); })
      if (static_cast<double>(renderer_.stiffness()) < kSoftest) {
        std::ostringstream s;
        s << "trephine::HapticScene: a stiffness of " << static_cast<double>(renderer_.stiffness())
          << " N/m is not felt; is it in N/mm?";
        warnings.push_back(s.str());
      }
    return warnings;
  }

  /// Return the poses of the last good tick in W. They move with the grid if it moved since.
  [[nodiscard]] Posed proxy_pose_W() const noexcept { return in_world(renderer_.proxy_pose()); }
  [[nodiscard]] Posed visual_pose_W() const noexcept { return in_world(renderer_.visual_pose()); }
  [[nodiscard]] Posed cutting_pose_W() const noexcept { return in_world(cutting_poses_.current(renderer_, parts_)); }

  /// Writes the last good tick's contact points [m, N] in W, as many as `out` holds; returns their number.
  std::size_t contacts_W(std::span<ContactPoint<double>> out) const noexcept {
    const std::span<const ContactPoint<Scalar>> found = renderer_.contacts();
    const std::size_t count = std::min(found.size(), out.size());
    const Mat3d R_WG = bone_->X_WG().linear();
    const Vec3d p_WG = bone_->X_WG().translation();
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3d p = found[i].position.template cast<double>(), n = found[i].normal.template cast<double>(),
                  f = found[i].force.template cast<double>();
      out[i] = {.position = product(R_WG, p) + p_WG, .normal = product(R_WG, n), .force = product(R_WG, f)};
    }
    return count;
  }

 private:
  static constexpr bool kUsesTwist = (kStageUsesTwist<Parts> || ...);
  static constexpr bool kBoundsWrench = BoundsWrench<ContactRenderer>;
  static constexpr bool kUsesHistory = kUsesTwist || kCarves || kBoundsWrench;
  using History = PoseHistory<kUsesTwist, kCarves, kUsesHistory>;
  struct NoBound {};
  using Bound = std::conditional_t<kBoundsWrench, ReleaseBound, NoBound>;
  template <class Part>
  static constexpr bool kAddsCuttingForce = Stage<Part>&& DecidesCuts<Part>;
  /// Tip radius that voxels hold [longest spacings]. A deep hole's section is then off by 4.4 % at most. At a radius of
  /// one it is too large by 11 % (coupled tool), or too small by 20 %.
  static constexpr double kFewestVoxels = 2;
  static constexpr double kSoftest = 10;  // [N/m]: a hand that presses this by 3 cm feels 0.3 N
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

  [[nodiscard]] Rendered<Scalar> render(const Field& field, const Pose<Scalar>& X_GT, double dt) noexcept {
    const auto render_in = [&](const auto& in) {
      if constexpr (requires { renderer_.render(in, X_GT, dt); })
        return renderer_.render(in, X_GT, dt);
      else
        return renderer_.render(in, X_GT);
    };
    if constexpr (kSkipsEmptySpace) {
      constexpr std::array<bool, sizeof...(Parts)> is{EmptySpaceSkipper<Parts>...};
      constexpr auto at = static_cast<std::size_t>(std::find(is.begin(), is.end(), true) - is.begin());
      return render_in(std::get<at>(parts_).field_for(field));
    } else {
      return render_in(field);
    }
  }

  /// Tells parts the head that cuts.
  void prepare_parts() noexcept {
    for_each_part([&](auto& part) {
      if constexpr (requires { part.prepare(cutting_head()); }) part.prepare(cutting_head());
    });
  }

  void begin_tick() noexcept {
    if constexpr (requires { renderer_.begin_tick(); }) renderer_.begin_tick();
    if constexpr (requires { renderer_.take_tool_change(); })
      if (renderer_.take_tool_change()) {
        reset();
        prepare_parts();
      }
    for_each_part([](auto& part) {
      if constexpr (requires { part.begin_tick(); }) part.begin_tick();
    });
  }

  void report_structures(StructureSummary& summary) noexcept {
    for_each_part([&](const auto& part) {
      if constexpr (StructureReporter<std::remove_cvref_t<decltype(part)>>) part.add_to(summary);
    });
    if constexpr (!kHasTorque) summary.push.torque.setZero();
  }

  void report_cutting(CuttingSummary& summary) noexcept {
    for_each_part([&](const auto& part) {
      if constexpr (CuttingReporter<std::remove_cvref_t<decltype(part)>>) part.add_to(summary);
    });
  }

  /// Resets the scene and returns a zero wrench with `kNonFinite`; contact, volumes and distance stay in the result.
  [[nodiscard]] TickResult fail_non_finite(TickResult result) noexcept {
    reset();
    forget_wrench();
    result.wrench = Wrenchd::zero();
    if constexpr (kReportsStructures) result.structures.push = Wrenchd::zero();
    if constexpr (kReportsCutting) result.cutting = {};
    result.status = Status::kNonFinite;
    return result;
  }

  [[nodiscard]] const auto& cutting_head() const noexcept {
    if constexpr (requires { renderer_.cutting_head(); })
      return renderer_.cutting_head();
    else
      return renderer_.shape();
  }

  [[nodiscard]] double carve(const PoseStep& step, const Posed& X_GT, const Posed& X_GC,
                             const CarveContext& context) noexcept {
    double removed_mm3 = 0;
    for_each_part([&](auto& part) {
      if constexpr (Carver<std::remove_cvref_t<decltype(part)>, Grid>) {
        const bool probe = follows_probe(part);
        const Posed& before = probe ? step.X_GT_before : step.X_GC_before;
        const Posed& now = probe ? X_GT : X_GC;
        removed_mm3 += part.carve(*bone_, isovalue_, before, now, cutting_head(), context);
      }
    });
    return removed_mm3;
  }

  /// Returns the small motion between two poses in G, in W axes.
  [[nodiscard]] Vec6d motion_in_world(const Posed& before, const Posed& now) const noexcept {
    const Mat3d R_WG = bone_->X_WG().linear();
    const Vec6d motion = motion_to(before, now);
    return spatial(product(R_WG, linear_part(motion)), product(R_WG, angular_part(motion)));
  }

  template <class S>
  [[nodiscard]] Posed in_world(const Pose<S>& X_G) const noexcept {
    return compose(bone_->X_WG(), X_G.template cast<double>());
  }
  /// Returns the length of v without overflow, so a carver never receives an infinite force.
  [[nodiscard]] static double magnitude(const Vec3d& v) noexcept {
    return std::min(std::hypot(v.x(), v.y(), v.z()), std::numeric_limits<double>::max());
  }

  Grid* bone_;
  double isovalue_;
  ContactRenderer renderer_;
  [[no_unique_address]] Surface surface_;
  [[no_unique_address]] std::tuple<Parts...> parts_;
  [[no_unique_address]] History history_;
  [[no_unique_address]] Bound release_;
  [[no_unique_address]] detail::CuttingPoses<ContactRenderer, Parts...> cutting_poses_;
  FarAway far_away_;
  std::uint64_t last_increase_stamp_ = 0;  // the bone's increase_stamp at the last tick; none has 0
};

template <class Density, class ContactRenderer, class... Parts>
HapticScene(VoxelGrid<Density>&, double, ContactRenderer, Parts...) -> HapticScene<Density, ContactRenderer, Parts...>;
template <class... Arguments>
requires(!detail::kAreSceneArguments<Arguments...>) HapticScene(Arguments&&...)
->HapticScene<detail::Misused<Arguments...>, void>;

}  // namespace trephine
