// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tick.hpp>
#include <trephine/stage/carver.hpp>
#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/rims_in_voxels.hpp>
#include <trephine/voxel/carving.hpp>

#include <algorithm>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <type_traits>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// Longest path of a tick that is swept [voxels of the finest spacing]; of a longer path only the end is cut. It bounds
/// a tick's work. At 0.3 mm and 1 kHz it is a burr at 10 m/s.
inline constexpr double kLongestSweep = 32;

/// Smallest motion since the last geometric cut that causes the next one [voxels of the finest spacing]. A smaller
/// motion would displace the surface by no more than itself.
inline constexpr double kMinAdvance = 1.0 / 256;

/// Options that do not depend on the cut policy.
struct MillingOptions {
  double slope = 0;           ///< of the cut [densities per voxel]; 0: auto_slope
  bool follow_probe = false;  ///< cut along the device's pose instead of the renderer's cutting pose
};

/// The tool's own head cuts: a burr's ball, not its shaft.
struct TipCuts {
  void validate() const {}
};

/// Removes bone while the spindle turns; the part of a scene to list for drilling.
/// \code
/// Milling{}                                            // geometric: at once what the tip covers
/// Milling{{.rate = 2e5}}                               // densities/s: hard bone takes time
/// Milling{RateLimitedCut<>{.rate = 2e5, .reference_force = 3}, {.slope = 10}}
/// Milling{GeometricCut{}, {}, DrillBit{.radius = 1_mm, .length = 8_mm}}  // <trephine/tool/shapes/drill_bit.hpp>
/// \endcode
/// The head is that of the renderer's tool; a DrillBit has its own measures and the tool's pose. Poses farther apart
/// than `kLongestSweep` are not joined. A geometric cut that continues its path begins at its last cut and waits until
/// it is `kMinAdvance` away, so a still head costs nothing. The removed volume is the isosurface's loss.
/// Haptic thread; no allocation.
template <CutPolicy Policy = GeometricCut, class Shape = TipCuts>
class Milling {
 public:
  using Options = CutOptionsOf<Policy>;  ///< what a `Remote<Milling>` receives
  static constexpr bool kCutsAtOnce =
      LimitAtOnce<decltype(std::declval<const Policy&>().template limit<std::uint8_t>(CutAllowance{}))>;
  static constexpr bool kCutsUnderPressure =
      LimitByFraction<decltype(std::declval<const Policy&>().template limit<std::uint8_t>(CutAllowance{}))>;

  Milling() requires std::default_initializable<Policy> : Milling(Policy{}) {}
  explicit Milling(const Policy& policy, const MillingOptions& options = {}, const Shape& shape = {})
      : policy_(policy), options_(options), shape_(shape), head_(head_of(shape)) {
    validate();
  }

  /// Throws std::invalid_argument.
  void validate() const {
    policy_.validate();
    shape_.validate();
    if (!(options_.slope >= 0) || !is_finite(options_.slope))
      refuse("Milling", "slope must be >= 0 densities per voxel", options_.slope);
  }

  /// Throws std::invalid_argument for a policy that is not for this bone and isovalue, and for densities that cannot
  /// hold a cut's surface (`check_slope`), as those of a mask of 0 and 1.
  template <class Grid>
  void validate_for(const Grid& bone, double isovalue) const {
    check_slope(bone, isovalue, options_.slope);
    if constexpr (requires { policy_.validate_for(bone, isovalue); }) policy_.validate_for(bone, isovalue);
  }

  [[nodiscard]] const Policy& policy() const noexcept { return policy_; }
  /// Replaces the policy's options between ticks (haptic thread) by valid ones.
  void adopt(const Options& options) noexcept { adopt_cut_options(policy_, options); }
  /// Replaces the whole policy, its floor or tissues too, by a valid one for the same bone.
  void set_policy(const Policy& policy) noexcept { policy_ = policy; }
  [[nodiscard]] bool follow_probe() const noexcept { return options_.follow_probe; }

  /// Restarts the dithering.
  void reset() noexcept {
    tick_ = 0;
    last_ = {};
  }

  /// `head`: the head of the renderer's tool, a Burr or a CuttingHead.
  template <class Grid, class Head = Burr>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_previous, const Posed& X_GT, const Head& head,
               const CarveContext& context) noexcept {
    if constexpr (CountingPolicy<Policy>) {
      // Other parts may cut with the same floor.
      const FloorCounts before = policy_.counts();
      const double removed_mm3 = cut_path(grid, isovalue, X_GT_previous, X_GT, head, context);
      const FloorCounts after = policy_.counts();
      counts_ = {after.refused - before.refused, after.taken - before.taken};
      return removed_mm3;
    } else {
      return cut_path(grid, isovalue, X_GT_previous, X_GT, head, context);
    }
  }

  /// Adds the volumes that the policy's floor refused and watched in the last tick.
  void add_to(StructureSummary& summary) const noexcept requires CountingPolicy<Policy> {
    summary.refused_mm3 += policy_.voxel_mm3() * static_cast<double>(counts_.refused);
    summary.taken_mm3 += policy_.voxel_mm3() * static_cast<double>(counts_.taken);
  }

 private:
  template <class Grid, class Head>
  double cut_path(Grid& grid, double isovalue, const Posed& X_GT_previous, const Posed& X_GT, const Head& head,
                  const CarveContext& context) noexcept {
    if (!context.spindle_on) return 0;
    if constexpr (kCutsUnderPressure)
      if (!(context.fraction > 0)) return 0;
    const CutAllowance allowance{context.dt, context.force_N, tick_++, context.fraction};
    const double h = grid.spacing().minCoeff();
    const auto& cuts = head_to_cut(head);
    const bool is_close = way(cuts, X_GT_previous, X_GT) <= kLongestSweep * h;
    Posed from = is_close ? X_GT_previous : X_GT;
    bool start_is_cut = false;
    if constexpr (kCutsAtOnce) {
      // Bone that was cut last need not be cut again, unless it was restored.
      LastCut cut{grid.increase_stamp(), X_GT, X_GT, size_of(cuts), isovalue};
      start_is_cut = is_close && last_.is_same_but_at(cut, X_GT_previous);
      if (start_is_cut) from = last_.X_GC;
      const bool waits = start_is_cut && way(cuts, from, X_GT) < kMinAdvance * h;
      if (waits) cut.X_GC = from;
      last_ = cut;
      if (waits) return 0;
    }
    return trephine::carve(grid, isovalue, cutter_of(cuts, from, X_GT, start_is_cut, grid.spacing()), policy_,
                           allowance, options_.slope);
  }

  /// Motion of a head's points between two poses [m]; for a burr that of its ball's centre.
  [[nodiscard]] static double way(const Burr&, const Posed& a, const Posed& b) noexcept {
    return (b.translation() - a.translation()).norm();
  }
  [[nodiscard]] static double way(const CuttingHead& head, const Posed& a, const Posed& b) noexcept {
    return RevolvedCutter::way(head, a, b);
  }
  [[nodiscard]] static double size_of(const Burr& burr) noexcept { return burr.tip_radius; }
  [[nodiscard]] static double size_of(const CuttingHead& head) noexcept {
    return head.outline.largest_radius() + head.allowance;
  }
  [[nodiscard]] static SphereCutter cutter_of(const Burr& burr, const Posed& from, const Posed& to, bool start_is_cut,
                                              const Vec3d&) noexcept {
    return {from.translation(), to.translation(), burr.tip_radius, start_is_cut};
  }
  [[nodiscard]] static SphereCutter cutter_of(const CuttingBall& ball, const Posed& from, const Posed& to,
                                              bool start_is_cut, const Vec3d& spacing) noexcept {
    double R = ball.tip_radius;
    if constexpr (kCutsUnderPressure) {
      R -= ball.allowance;
      R += pressed_allowance(ball.allowance, R, spacing);
    }
    return {from.translation(), to.translation(), R, start_is_cut};
  }
  /// A cut in time counts each pose of a path once, in the tick that ends there. A cut that makes room where the tool
  /// is needs thicker rims, in which voxels leave bone.
  [[nodiscard]] static RevolvedCutter cutter_of(const CuttingHead& head, const Posed& from, const Posed& to,
                                                bool start_is_cut, const Vec3d& spacing) noexcept {
    const double step = spacing.minCoeff() / 2;
    if constexpr (kCutsUnderPressure)
      return {pressed(head, spacing), from, to, step, 0, true};
    else
      return {head, from, to, step, sag_square(spacing, 1.0 / 24), start_is_cut || !kCutsAtOnce};
  }
  /// The head that cuts by pressure in voxels of this spacing [m]. Such a cut goes ahead until the tool is free, so
  /// rims are sharper and the hole keeps its width. Where a drill's edge makes the wall, flutes finish it: an edge cuts
  /// voxels of the wall as deep as a long side would only with some side behind it.
  [[nodiscard]] static CuttingHead pressed(const CuttingHead& head, const Vec3d& spacing) noexcept {
    const ToolOutline outline = head.with_guide(kGuide * spacing.norm());
    return {with_sharper_rims(outline, std::sqrt(spacing.squaredNorm() / 3)),
            pressed_allowance(head.allowance, outline.largest_radius(), spacing)};
  }
  /// By how much a head of radius R [m] is larger as it cuts by pressure in voxels of this spacing [m].
  ///
  /// The wall that it leaves sags by a 36th of a squared diagonal over R, as it curves one way. The rest of the
  /// allowance is room for contact's offset. The law does not charge it, and in a wide hole a head wanders and cuts yet
  /// more. In a narrow one walls on all sides guide it.
  [[nodiscard]] static double pressed_allowance(double allowance, double R, const Vec3d& spacing) noexcept {
    return std::min(allowance, kMaxRoom * R + sag_square(spacing, 1.0 / 36) / R);
  }
  // [cell's diagonals]. Voxels that make the wall lie within half a diagonal of it. Of a longer guide a side under load
  // reams the hole, of a shorter one bone in it holds the edge.
  static constexpr double kGuide = 0.5;
  static constexpr double kMaxRoom = 0.001;  // of the radius, so a hole's area is too large by a 500th at most

  struct NoHead {};
  static constexpr bool kCutsWithTip = std::is_same_v<Shape, TipCuts>;
  [[nodiscard]] static auto head_of(const Shape& shape) {
    if constexpr (kCutsWithTip)
      return NoHead{};
    else
      return static_cast<CuttingHead>(shape);
  }
  template <class Head>
  [[nodiscard]] const auto& head_to_cut(const Head& of_tool) const noexcept {
    if constexpr (kCutsWithTip)
      return of_tool;
    else
      return head_;
  }

  struct LastCut {
    std::uint64_t stamp = 0;
    Posed X_GT = Posed::Identity();  // at the last tick
    Posed X_GC = Posed::Identity();  // at the last cut
    double size = 0;                 // of the head [m]
    double isovalue = 0;
    [[nodiscard]] bool is_same_but_at(const LastCut& o, const Posed& X) const noexcept {
      return stamp == o.stamp && X_GT.matrix() == X.matrix() && size == o.size && isovalue == o.isovalue;
    }
  };
  struct NoLastCut {};
  struct NoCounts {};

  [[no_unique_address]] Policy policy_;
  [[no_unique_address]] std::conditional_t<kCutsAtOnce, LastCut, NoLastCut> last_;
  [[no_unique_address]] std::conditional_t<CountingPolicy<Policy>, FloorCounts, NoCounts>
      counts_{};  // of the last tick
  MillingOptions options_;
  [[no_unique_address]] Shape shape_;
  [[no_unique_address]] std::conditional_t<kCutsWithTip, NoHead, CuttingHead> head_;
  std::uint32_t tick_ = 0;
};

Milling()->Milling<GeometricCut, TipCuts>;
Milling(RateLimitedCut<>, MillingOptions = {})->Milling<RateLimitedCut<>, TipCuts>;
template <CutPolicy Policy>
Milling(Policy, MillingOptions = {}) -> Milling<Policy, TipCuts>;
template <CutPolicy Policy, class Shape>
Milling(Policy, MillingOptions, Shape) -> Milling<Policy, Shape>;

}  // namespace trephine
