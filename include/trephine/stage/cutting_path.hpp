// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/stage/members.hpp>
#include <trephine/tool/head_sweep.hpp>
#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/cut_turn.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <numbers>
#include <span>
#include <type_traits>
#include <utility>

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

/// Sweeps a head from pose to pose and cuts with a policy: which body is cut, from where, and which parts of it now.
/// State: for each turn the head's pose at its last cut and what it may cut since then, and the number of cuts, which
/// seeds dithering.
template <class Head>
class CuttingPath {
 public:
  explicit CuttingPath(const Head& head = {}) : own_(head), head_(head_of(head)) {}

  void validate() const { own_.validate(); }
  void reset() noexcept {
    tick_ = 0;
    last_ = {};
    turn_ = {};
  }

  /// Goes on from another path, in bone of its own with the same densities.
  void take(const CuttingPath& other, const TakenBone& bones) noexcept {
    *this = other;
    last_.stamp = other.last_.stamp == bones.stamp ? bones.own_stamp : 0;
    if (last_.rule == bones.floor) last_.rule = bones.own_floor;
  }

  /// Starts a tick: the next turn of those in which this head cuts so many blocks of 16 voxels a tick, about.
  template <class OfTool>
  void begin_turn(const OfTool& of_tool, const Vec3d& spacing, int blocks) noexcept {
    const auto& head = head_to_cut(of_tool);
    using Sweep = HeadSweep<std::remove_cvref_t<decltype(head)>>;
    // Rows that cross the head from the side, and blocks of a row's half in it, as the other half is cut already.
    const double R = Sweep::size(head), length = std::max(2 * R, Sweep::length(head));
    const double rows = std::numbers::pi / 2 * R * length / (spacing.y() * spacing.z());
    const double all = rows * (1 + R / (kCutLanes * spacing.x()));
    turn_.turns = static_cast<int>(std::clamp(std::ceil(all / blocks), 1.0, double{CutTurn::kMost}));
    turn_.turn = turn_.turn + 1 < turn_.turns ? turn_.turn + 1 : 0;
  }
  /// The tick's turn. A path without `begin_turn` has one.
  [[nodiscard]] const CutTurn& turn() const noexcept { return turn_; }

  /// `rule`: identity of what else decides the cut, as a floor; where it changes, nothing counts as cut already. Cuts
  /// the parts of `turn`.
  template <class Grid, class OfTool, CutPolicy Policy>
  double carve(Grid& grid, double isovalue, const Posed& X_GT_before, const Posed& X_GT, const OfTool& of_tool,
               const Policy& policy, const CutAllowance& allowance, double slope, const void* rule,
               const CutTurn& turn) noexcept {
    const double h = grid.spacing().minCoeff();
    const auto& head = head_to_cut(of_tool);
    using Sweep = HeadSweep<std::remove_cvref_t<decltype(head)>>;
    const bool is_close = Sweep::travel(head, X_GT_before, X_GT) <= kLongestSweep * h;
    const LastCut cut{grid.increase_stamp(), X_GT, Sweep::size(head), isovalue, turn.turns, rule};
    // Bone that was cut last need not be cut again, unless it was restored.
    const std::span pending(pending_.data(), static_cast<std::size_t>(turn.turns));
    if (!is_close || !last_.is_same_but_at(cut, X_GT_before))
      std::fill(pending.begin(), pending.end(), Pending{is_close ? X_GT_before : X_GT});
    last_ = cut;
    for (Pending& of : pending) of.add(allowance);
    // No turn may wait until a fast head's way is too long: this one, which waited longest, tells.
    const Pending& oldest = pending[static_cast<std::size_t>(turn.turn)];
    if (Sweep::travel(head, oldest.X_GT, X_GT) > kLongestSweep * h) {
      double removed_mm3 = 0;
      for (int i = 0; i < turn.turns; ++i)
        removed_mm3 += carve_turn(grid, isovalue, X_GT, head, policy, slope, {i, turn.turns});
      return removed_mm3;
    }
    return carve_turn(grid, isovalue, X_GT, head, policy, slope, turn);
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

  /// Cuts the parts of a turn, from the pose of its last cut.
  template <class Grid, class H, class Policy>
  double carve_turn(Grid& grid, double isovalue, const Posed& X_GT, const H& head, const Policy& policy, double slope,
                    const CutTurn& turn) noexcept {
    constexpr CutKind kKind = Policy::kKind;
    using Sweep = HeadSweep<H>;
    Pending& pending = pending_[static_cast<std::size_t>(turn.turn)];
    const bool start_is_cut = kKind == CutKind::kAtOnce && pending.is_cut;
    if (start_is_cut && Sweep::travel(head, pending.X_GT, X_GT) < kMinAdvance * grid.spacing().minCoeff()) return 0;
    const Posed from = std::exchange(pending.X_GT, X_GT);
    pending.is_cut = true;
    CutAllowance allowance = std::exchange(pending.allowance, Pending{}.allowance);
    if constexpr (kKind == CutKind::kByPressure)
      if (!(allowance.fraction > 0)) return 0;
    allowance.tick = tick_++;
    const auto cutter = Sweep::template cutter<kKind>(head, from, X_GT, start_is_cut, grid.spacing());
    return trephine::carve(grid, isovalue, cutter, policy, allowance, slope, turn);
  }

  /// The head at the last tick, and in what it cut.
  struct LastCut {
    std::uint64_t stamp = 0;
    Posed X_GT = Posed::Identity();
    double size = 0;  // of the head [m]
    double isovalue = 0;
    int turns = 1;
    const void* rule = nullptr;
    [[nodiscard]] bool is_same_but_at(const LastCut& o, const Posed& X) const noexcept {
      return stamp == o.stamp && X_GT.matrix() == X.matrix() && size == o.size && isovalue == o.isovalue &&
             turns == o.turns && rule == o.rule;
    }
  };
  /// What a turn has not cut yet.
  struct Pending {
    Posed X_GT = Posed::Identity();  // at its last cut
    bool is_cut = false;             // there
    CutAllowance allowance{.fraction = 0};

    void add(const CutAllowance& tick) noexcept {
      allowance.dt += tick.dt;
      allowance.force_N = tick.force_N;
      allowance.fraction += tick.fraction - allowance.fraction * tick.fraction;  // of what is left
    }
  };

  LastCut last_;
  CutTurn turn_;
  std::array<Pending, CutTurn::kMost> pending_{};
  [[no_unique_address]] Head own_;
  [[no_unique_address]] decltype(head_of(std::declval<const Head&>())) head_;
  std::uint32_t tick_ = 0;
};

}  // namespace detail

}  // namespace trephine
