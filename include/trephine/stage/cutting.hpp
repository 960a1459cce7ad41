// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/stage/context.hpp>
#include <trephine/stage/cutting_options.hpp>
#include <trephine/stage/cutting_part.hpp>
#include <trephine/stage/cutting_path.hpp>
#include <trephine/stage/cutting_pose.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/tool/shape.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/cut_turn.hpp>
#include <trephine/voxel/pressure_cut.hpp>
#include <trephine/voxel/protected_cut.hpp>

#include <concepts>
#include <cstddef>
#include <limits>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// No forces of cutting.
struct NoLaw {};

namespace detail {
/// Options of a policy that may change between ticks: the policy itself, or what it names so.
template <class Policy>
struct CutOptions {
  using type = Policy;
};
template <class Policy>
  requires requires { typename Policy::Options; }
struct CutOptions<Policy> {
  using type = typename Policy::Options;
};
}  // namespace detail

/// Removes bone while the spindle turns; the part of a scene to list for drilling. Three ways to remove bone:
/// instantly, at a rate of density, or by a receding surface; and by pressure, as a law of cutting says.
/// \code
/// Cutting{}                                              // instantly what the head covers
/// Cutting{{.rate = 2e5}}                                 // densities/s: hard bone takes time
/// Cutting{AdvancingCut{.speed = 5e-3}}                   // the surface recedes
/// Cutting{PressureCut{}, CuttingForce({.edges = {.flutes = 8}})}  // <trephine/stage/cutting_force.hpp>
/// Cutting{GeometricCut{}, {}, DrillBit{.radius = 1_mm, .length = 8_mm}}  // <trephine/tool/shapes/drill_bit.hpp>
/// \endcode
/// Everything about cutting is decided here: the policy, the pose at which the head cuts, how often a head bites, and
/// the law. A scene has one Cutting. A `Veto` or `Protection` in the scene keeps it out of structures.
///
/// *Pose.* The renderer's `pressure_cutting_pose(advance)` for a cut by pressure; its `cutting_pose(dt)` for a cut at
/// once, which then bites at most every `kShortestBite`; its `cutting_pose()` else, and where it has no other.
///
/// *Head.* That of the renderer's tool; a DrillBit has its own measures and the tool's pose. Poses farther apart than
/// `kLongestSweep` are not joined. A cut at once that continues its path begins at its last cut and waits until it is
/// `kMinAdvance` away, so a still head costs nothing. The removed volume is the isosurface's loss.
///
/// *Turns.* A head that crosses more than `CuttingOptions::blocks` cuts in turns, which bounds a tick's work: each tick
/// cuts the parts of one turn (`CutTurn`), from where the head was a round ago. So what is cut lags by a round, 16
/// ticks at most, and a coupled tool's drag grows by its stiffness times the way of a round. Volumes add up. A turn
/// whose way is longer than `kLongestSweep` makes all turns cut at once; a way out and back within a round may stay
/// uncut. A cut in time takes a round's time in one step: sharp edges of an image recede
/// faster, by a sixth where it is 8 ms at 5 mm/s in voxels of 0.3 mm. Small heads are cut whole, always.
///
/// Haptic thread; no allocation.
template <class Policy = GeometricCut, class Law = NoLaw, class Head = ToolHead>
class Cutting {
  static constexpr bool kHasLaw = FeedLaw<Law>;
  /// Whether the policy is chosen at run time (`AnyCut`).
  static constexpr bool kIsAny = !CutPolicy<Policy>;
  static constexpr bool may_be(CutKind kind) {
    if constexpr (kIsAny)
      return true;
    else
      return Policy::kKind == kind;
  }
  static_assert(kHasLaw || kIsAny || !may_be(CutKind::kByPressure),
                "trephine::Cutting: a PressureCut needs a law, which says how much the thrust cuts: write "
                "Cutting{PressureCut{}, CuttingForce{...}}, or take another cut");
  static_assert(kHasLaw || std::same_as<Law, NoLaw>, "trephine::Cutting: the law must be a FeedLaw, as CuttingForce");

 public:
  using Options = typename detail::CutOptions<Policy>::type;  ///< what a `Remote<Cutting>` receives

  Cutting()
    requires std::default_initializable<Policy> && std::default_initializable<Law>
      : Cutting(Policy{}) {}
  /// Throws std::invalid_argument for options out of range.
  explicit Cutting(const Policy& policy, const CuttingOptions& options = {}, const Head& head = {})
    requires std::same_as<Law, NoLaw>
      : policy_(policy), options_(options), path_(head) {
    validate();
  }
  template <FeedLaw L>
    requires std::same_as<L, Law>
  Cutting(const Policy& policy, L law, const CuttingOptions& options = {})
      : policy_(policy), law_(std::move(law)), options_(options) {
    validate();
  }

  /// Throws std::invalid_argument.
  void validate() const {
    policy_.validate();
    path_.validate();
    options_.validate();
    member::validate(law_);
  }
  /// Throws std::invalid_argument for a policy or law that is not for this bone and isovalue, and for densities that
  /// cannot hold a cut's surface (`check_slope`), as those of a mask of 0 and 1.
  template <class Grid>
  void validate_for(const Grid& bone, double isovalue) const {
    if (!is_off()) check_slope(bone, isovalue, options_.slope);
    member::validate_for(policy_, bone, isovalue);
    member::validate_for(law_, bone, isovalue);
  }

  [[nodiscard]] const Policy& policy() const noexcept { return policy_; }
  [[nodiscard]] const CuttingOptions& options() const noexcept { return options_; }
  [[nodiscard]] Law& law() noexcept
    requires kHasLaw
  {
    return law_;
  }
  [[nodiscard]] const Law& law() const noexcept
    requires kHasLaw
  {
    return law_;
  }
  /// Replaces the policy's options between ticks (haptic thread) by valid ones.
  void adopt(const Options& options) noexcept {
    if constexpr (kIsAny)
      if (!policy_.is_like(options)) path_.reset();
    if constexpr (requires { policy_.adopt(options); })
      policy_.adopt(options);
    else
      policy_ = options;
  }
  /// Replaces options that the policy does not have by valid ones, likewise.
  void adopt(const CuttingOptions& options) noexcept {
    if (!(options_ == options)) path_.reset();
    options_ = options;
  }

  /// Tells the law the head that cuts. The scene calls it at its construction and after a change of tool.
  template <class H>
  void prepare(const H& head) noexcept {
    member::visit_head(head, [&](const auto& one) { member::prepare(law_, one); });
  }
  /// Takes what other threads posted to the law (`Remote`).
  void begin_tick() noexcept { member::begin_tick(law_); }
  void take(const Cutting& other, const TakenBone& bones) {
    policy_ = other.policy_;
    law_ = other.law_;
    options_ = other.options_;
    path_.take(other.path_, bones);
    pose_ = other.pose_;
  }
  /// Takes it that nothing was cut yet, as after a change of what cuts may take.
  void forget_path() noexcept { path_.reset(); }
  /// Restarts the dithering, the bites and the law.
  void reset() noexcept {
    path_.reset();
    pose_ = {};
    if constexpr (kHasLaw) law_.reset();
  }

  /// Cuts where the head went since the last tick; NaN where the renderer's pose is not finite.
  template <VoxelDensity Density, class R, class Floor = std::nullptr_t>
  [[nodiscard]] double cut(VoxelGrid<Density>& bone, double isovalue, const R& renderer, const CutTick& tick,
                           Floor floor = nullptr) noexcept {
    const auto& head = member::cutting_head(renderer);
    member::visit_head(head, [&](const auto& one) { path_.begin_turn(one, bone.spacing(), options_.blocks); });
    PressedCut pressed;
    if constexpr (kHasLaw) pressed = law_.engage(bone, isovalue, renderer, tick.dt, tick.spindle_on);
    const detail::CutStroke stroke =
        pose_.next(renderer, kind(), pressed.advance, tick, options_.follow_probe, path_.turn().turns);
    if (!is_finite(stroke.to)) return std::numeric_limits<double>::quiet_NaN();
    if (!tick.cuts) return 0;
    const CutAllowance allowance{tick.dt, tick.force_N, 0, pressed.fraction};
    const auto cut_with = [&](const auto& one) {
      return carve(bone, isovalue, stroke.from, stroke.to, one, allowance, floor, path_.turn());
    };
    return member::visit_head(head, cut_with);
  }

  /// Lowers densities along the tool's path between two poses in G, which are equal without a path, and returns the
  /// removed volume [mm³]. `head`: a Burr or a CuttingHead. Without a `turn` it cuts at once. For programs without a
  /// scene.
  template <VoxelDensity Density, class H = Burr, class Floor = std::nullptr_t>
  double carve(VoxelGrid<Density>& bone, double isovalue, const Posed& X_GT_before, const Posed& X_GT, const H& head,
               const CutAllowance& allowance, Floor floor = nullptr, const CutTurn& turn = {}) noexcept {
    double removed_mm3 = 0;
    with_policy([&](const auto& policy) {
      const auto cut_with = [&](const auto& sparing, const void* rule) {
        removed_mm3 =
            path_.carve(bone, isovalue, X_GT_before, X_GT, head, sparing, allowance, options_.slope, rule, turn);
      };
      if constexpr (std::is_null_pointer_v<Floor>)
        cut_with(policy, nullptr);
      else
        cut_with(ProtectedCut(policy, floor), floor);
    });
    return removed_mm3;
  }

  /// Adds the edges' forces to the contact's wrench.
  void add_forces(const TickContext& context, Wrenchd& wrench) noexcept {
    if constexpr (kHasLaw) law_.apply(context, wrench);
  }
  /// Adds the law's vibration, where it has one.
  void vibrate(const TickContext& context, Wrenchd& wrench) noexcept
    requires Vibrates<Law>
  {
    law_.vibrate(context, wrench);
  }
  /// Writes the true forces of the last tick.
  void add_to(CuttingSummary& summary) const noexcept
    requires kHasLaw
  {
    law_.add_to(summary);
  }

  /// Returns the parts of the bone that the last tick cut.
  [[nodiscard]] const CutTurn& turn() const noexcept { return path_.turn(); }
  /// Returns the renderer's cutting pose as it is now.
  template <class R>
  [[nodiscard]] Posed pose(const R& renderer) const noexcept {
    return pose_.current(renderer, kind());
  }

 private:
  /// How this tick cuts; kAtRate where nothing does.
  [[nodiscard]] CutKind kind() const noexcept {
    if constexpr (kIsAny)
      return policy_.kind();
    else
      return Policy::kKind;
  }
  [[nodiscard]] bool is_off() const noexcept {
    if constexpr (kIsAny)
      return policy_.is_none();
    else
      return false;
  }
  template <class Body>
  void with_policy(Body&& body) const noexcept {
    if constexpr (kIsAny)
      policy_.visit(body);
    else
      body(policy_);
  }

  [[no_unique_address]] Policy policy_;
  [[no_unique_address]] Law law_;
  CuttingOptions options_;
  [[no_unique_address]] detail::CuttingPath<Head> path_;
  detail::CuttingPose<may_be(CutKind::kAtOnce), may_be(CutKind::kByPressure)> pose_;
};

Cutting() -> Cutting<GeometricCut>;
Cutting(RateLimitedCut<>, CuttingOptions = {}) -> Cutting<RateLimitedCut<>>;
template <class Policy>
Cutting(Policy, CuttingOptions = {}) -> Cutting<Policy>;
template <class Policy, class Head>
  requires(!FeedLaw<Head>)
Cutting(Policy, CuttingOptions, Head) -> Cutting<Policy, NoLaw, Head>;
template <class Policy, FeedLaw Law>
Cutting(Policy, Law, CuttingOptions = {}) -> Cutting<Policy, Law>;

}  // namespace trephine
