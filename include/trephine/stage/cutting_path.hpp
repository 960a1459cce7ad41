// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/revolved_cutter.hpp>
#include <trephine/tool/rims_in_voxels.hpp>
#include <trephine/voxel/carving.hpp>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <type_traits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Longest path of a tick that is swept [voxels of the finest spacing]; of a longer path only the end is cut. It bounds
/// a tick's work. At 0.3 mm and 1 kHz it is a burr at 10 m/s.
inline constexpr double kLongestSweep = 32;

/// Smallest motion since the last geometric cut that causes the next one [voxels of the finest spacing]. A smaller
/// motion would displace the surface by no more than itself.
inline constexpr double kMinAdvance = 1.0 / 256;

/// The tool's own head cuts: a burr's ball, not its shaft.
struct ToolHead {
  void validate() const {}
};

namespace detail {

/// Sweeps a head from pose to pose and cuts with a policy: which body is cut, and from where. State: the last cut and
/// the number of cuts, which seeds dithering.
template <class Head, bool kMayBeAtOnce>
class CuttingPath {
 public:
  explicit CuttingPath(const Head& head = {}) : own_(head), head_(head_of(head)) {}

  void validate() const { own_.validate(); }
  void reset() noexcept {
    tick_ = 0;
    last_ = {};
  }

  /// `rule`: identity of what else decides the cut, as a floor; where it changes, nothing counts as cut already.
  template <class Grid, class OfTool, CutPolicy Policy>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_before, const Posed& X_GT, const OfTool& of_tool,
               const Policy& policy, CutAllowance allowance, double slope, const void* rule) noexcept {
    constexpr CutKind kKind = Policy::kKind;
    if constexpr (kKind == CutKind::kByPressure)
      if (!(allowance.fraction > 0)) return 0;
    allowance.tick = tick_++;
    const double h = grid.spacing().minCoeff();
    const auto& head = head_to_cut(of_tool);
    const bool is_close = way(head, X_GT_before, X_GT) <= kLongestSweep * h;
    Posed from = is_close ? X_GT_before : X_GT;
    bool start_is_cut = false;
    if constexpr (kKind == CutKind::kAtOnce) {
      // Bone that was cut last need not be cut again, unless it was restored.
      LastCut cut{grid.increase_stamp(), X_GT, X_GT, size_of(head), isovalue, rule};
      start_is_cut = is_close && last_.is_same_but_at(cut, X_GT_before);
      if (start_is_cut) from = last_.X_GC;
      const bool waits = start_is_cut && way(head, from, X_GT) < kMinAdvance * h;
      if (waits) cut.X_GC = from;
      last_ = cut;
      if (waits) return 0;
    }
    return trephine::carve(grid, isovalue, cutter_of<kKind>(head, from, X_GT, start_is_cut, grid.spacing()), policy,
                           allowance, slope);
  }

 private:
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
  template <CutKind>
  [[nodiscard]] static SphereCutter cutter_of(const Burr& burr, const Posed& from, const Posed& to, bool start_is_cut,
                                              const Vec3d&) noexcept {
    return {from.translation(), to.translation(), burr.tip_radius, start_is_cut};
  }
  template <CutKind kKind>
  [[nodiscard]] static SphereCutter cutter_of(const CuttingBall& ball, const Posed& from, const Posed& to,
                                              bool start_is_cut, const Vec3d& spacing) noexcept {
    double R = ball.tip_radius;
    if constexpr (kKind == CutKind::kByPressure) {
      R -= ball.allowance;
      R += pressed_allowance(ball.allowance, R, spacing);
    }
    return {from.translation(), to.translation(), R, start_is_cut};
  }
  /// A cut in time counts each pose of a path once, in the tick that ends there. A cut that makes room where the tool
  /// is needs thicker rims, in which voxels leave bone.
  template <CutKind kKind>
  [[nodiscard]] static RevolvedCutter cutter_of(const CuttingHead& head, const Posed& from, const Posed& to,
                                                bool start_is_cut, const Vec3d& spacing) noexcept {
    const double step = spacing.minCoeff() / 2;
    if constexpr (kKind == CutKind::kByPressure)
      return {pressed(head, spacing), from, to, step, 0, true};
    else
      return {head, from, to, step, sag_square(spacing, 1.0 / 24), start_is_cut || kKind != CutKind::kAtOnce};
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
  static constexpr bool kIsToolHead = std::is_same_v<Head, ToolHead>;
  [[nodiscard]] static auto head_of(const Head& head) {
    if constexpr (kIsToolHead)
      return NoHead{};
    else
      return static_cast<CuttingHead>(head);
  }
  template <class OfTool>
  [[nodiscard]] const auto& head_to_cut(const OfTool& of_tool) const noexcept {
    if constexpr (kIsToolHead)
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
    const void* rule = nullptr;
    [[nodiscard]] bool is_same_but_at(const LastCut& o, const Posed& X) const noexcept {
      return stamp == o.stamp && X_GT.matrix() == X.matrix() && size == o.size && isovalue == o.isovalue &&
             rule == o.rule;
    }
  };
  struct NoLastCut {};

  [[no_unique_address]] std::conditional_t<kMayBeAtOnce, LastCut, NoLastCut> last_;
  [[no_unique_address]] Head own_;
  [[no_unique_address]] std::conditional_t<kIsToolHead, NoHead, CuttingHead> head_;
  std::uint32_t tick_ = 0;
};

}  // namespace detail

}  // namespace trephine
