// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/members.hpp>
#include <trephine/tool/head_sweep.hpp>
#include <trephine/voxel/carving.hpp>

#include <algorithm>
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

  /// Goes on from another path, in bone of its own with the same densities.
  void take(const CuttingPath& other, const TakenBone& bones) noexcept {
    *this = other;
    if constexpr (kMayBeAtOnce) {
      last_.stamp = other.last_.stamp == bones.stamp ? bones.own_stamp : 0;
      if (last_.rule == bones.floor) last_.rule = bones.own_floor;
    }
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
    using Sweep = HeadSweep<std::remove_cvref_t<decltype(head)>>;
    const bool is_close = Sweep::travel(head, X_GT_before, X_GT) <= kLongestSweep * h;
    Posed from = is_close ? X_GT_before : X_GT;
    bool start_is_cut = false;
    if constexpr (kKind == CutKind::kAtOnce) {
      // Bone that was cut last need not be cut again, unless it was restored.
      LastCut cut{grid.increase_stamp(), X_GT, X_GT, Sweep::size(head), isovalue, rule};
      start_is_cut = is_close && last_.is_same_but_at(cut, X_GT_before);
      if (start_is_cut) from = last_.X_GC;
      const bool waits = start_is_cut && Sweep::travel(head, from, X_GT) < kMinAdvance * h;
      if (waits) cut.X_GC = from;
      last_ = cut;
      if (waits) return 0;
    }
    const auto cutter = Sweep::template cutter<kKind>(head, from, X_GT, start_is_cut, grid.spacing());
    return trephine::carve(grid, isovalue, cutter, policy, allowance, slope);
  }

 private:
  struct NoHead {};
  static constexpr bool kIsToolHead = std::is_same_v<Head, ToolHead>;
  [[nodiscard]] static auto head_of(const Head& head) {
    if constexpr (kIsToolHead)
      return NoHead{};
    else
      return head.cutting_head();
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
  [[no_unique_address]] decltype(head_of(std::declval<const Head&>())) head_;
  std::uint32_t tick_ = 0;
};

}  // namespace detail

}  // namespace trephine
