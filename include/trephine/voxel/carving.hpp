// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/square_roots.hpp>
#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/cut_slope.hpp>
#include <trephine/voxel/cut_turn.hpp>
#include <trephine/voxel/cutter.hpp>
#include <trephine/voxel/lost_cells.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cmath>
#include <cstdint>

/// Removes bone. Haptic thread only; no allocation. The work is bounded by the voxels in the cutter's box.
///
/// A **geometric cut** lowers every voxel to at most ρ_c = iso + slope · d/h. Here d is the signed distance from the
/// cutter, −`ramp_depth` at least, and h the grid's longest spacing. ρ_c is rounded to the nearest density and clamped
/// to the type's range. It is linear in space near the cutter, so the trilinear interpolant reproduces it, and the new
/// isosurface lies on the cutter for bone of any density. A second equal cut changes nothing. Lower densities stay, so
/// no cut adds bone.
///
/// *Slope* [densities per voxel]: see `auto_slope` (`cut_slope.hpp`). *Reach*: see `cut_reach`.
namespace trephine::inline TREPHINE_ALIGNED {

/// Returns the largest distance from the cutter at which a voxel is cut [m]: 1.5 voxels if the spacing is isotropic.
/// Beyond a voxel's diagonal a voxel shares no cell with the new surface. Voxels in the diagonal's last seventh have so
/// little weight that their cut changes no digit of the measured surface error.
[[nodiscard]] inline double cut_reach(const Vec3d& spacing) noexcept {
  return std::max(1.5 / std::sqrt(3.0) * spacing.norm(), spacing.maxCoeff());
}

/// Returns the depth in the cutter down to which densities fall [m]: two diagonals of a voxel. Deeper ones are all the
/// same, so what is cut stays as it is while the cutter goes on. Gradients at the new surface read no voxel as deep.
[[nodiscard]] inline double ramp_depth(const Vec3d& spacing) noexcept { return 2 * spacing.norm(); }

namespace detail {

/// Rounds to the nearest density, halves up, and clamps to the type's range. The bounds are members, not constants:
/// compilers turn clamps with constant bounds into jumps, which keep loops from being vectorised.
template <VoxelDensity Density>
struct NearestDensity {
  static constexpr int kLowest = static_cast<int>(std::numeric_limits<Density>::lowest());
  float zero = 0;
  float most = static_cast<float>(static_cast<int>(std::numeric_limits<Density>::max()) - kLowest);

  [[nodiscard]] int operator()(float v) const noexcept {
    float up = v - static_cast<float>(kLowest) + 0.5F;
    up = up > zero ? up : zero;
    up = up < most ? up : most;
    return static_cast<int>(up) + kLowest;
  }
};
template <>
struct NearestDensity<float> {
  [[nodiscard]] float operator()(float v) const noexcept { return v; }
};

/// Return the first voxel of an axis after a place [voxels] and the last voxel before it, within the grid. Without such
/// a voxel the result lies one beyond the grid.
[[nodiscard]] inline int voxel_after(double place, int size) noexcept {
  const double most = size;
  const double at = place < 0 ? -1 : place;
  return static_cast<int>(at < most ? at : most) + 1;
}
[[nodiscard]] inline int voxel_before(double place, int size) noexcept {
  const double most = size - 1;
  const double at = place < 0 ? -1 : place;
  return static_cast<int>(at < most ? at : most);
}

/// One cut. It lowers rows plane by plane, in slabs of `kCutRows` rows and in tiles along x, or in a turn's parts. It
/// adds up the volume that the voxels' cells lose. Two tiles share cells, but the sum over the tiles is the same in any
/// order. A limit by steepness reads neighbours that earlier blocks have lowered, so its result depends on the blocks'
/// order. A tool narrower than a tile has a single tile.
template <VoxelDensity Density, Cutter C, class Limit, CutKind kKind>
class Cut {
 public:
  Cut(VoxelGrid<Density>& grid, double isovalue, double slope, const C& cutter, const Limit& limit) noexcept
      : grid_(grid),
        cutter_(cutter),
        limit_(limit),
        lost_(grid, isovalue),
        origin_(cutter.origin()),
        reach_(cut_reach(grid.spacing())),
        per_x_(1 / grid.spacing().x()),
        isovalue_(static_cast<float>(isovalue)),
        per_metre_(static_cast<float>(slope / grid.spacing().maxCoeff())),
        has_deep_air_(isovalue - static_cast<double>(grid.original_range().min) >= double{kDeepAir} * slope) {}

  /// Returns the removed volume [mm³].
  [[nodiscard]] double run(const CutTurn& turn) noexcept {
    const Vec3d& h = grid_.spacing();
    const auto& size = grid_.size();
    const Eigen::AlignedBox3d box = cutter_.bounds();
    const Vec3d lo = (box.min().array() - reach_).matrix().cwiseQuotient(h);
    const Vec3d hi = (box.max().array() + reach_).matrix().cwiseQuotient(h);
    if (!is_finite(lo) || !is_finite(hi)) return 0;
    // No point is deeper in the body than half its box's shortest side.
    const double deepest = std::min(box.sizes().minCoeff() / 2, ramp_depth(h));
    lowest_target_ = nearest_(isovalue_ - per_metre_ * static_cast<float>(deepest));
    if constexpr (kBySteepness) lowest_target_ = kLowest;
    // A voxel more at either end: rounding may let the cutter reach it.
    const VoxelBox voxels{
        {std::max(voxel_after(lo.x(), size[0]) - 1, 0), voxel_after(lo.y(), size[1]), voxel_after(lo.z(), size[2])},
        {std::min(voxel_before(hi.x(), size[0]) + 1, size[0] - 1), voxel_before(hi.y(), size[1]),
         voxel_before(hi.z(), size[2])}};
    if (!(turn.turns > 1 ? lower_parts(voxels, turn) : lower_tiles(voxels))) return 0;
    grid_.commit();
    const double cells = lost_.cells();
    // A cell whose lines run along another axis after the cut may have a slightly larger share than before.
    return cells > 0 ? cells * h.prod() * 1e9 : 0.0;
  }

 private:
  using Wide = WideDensity<Density>;
  /// If true, the cut's ramp stays where it makes the surface. A receding front is steeper and would stop at the ramp.
  static constexpr bool kBySteepness = kKind == CutKind::kReceding;
  static constexpr bool kHasFloor = requires(const Limit& limit) { limit.floor(); };
  static constexpr Wide kLowest = std::numeric_limits<Density>::lowest();

  static constexpr int kNoVoxel = std::numeric_limits<int>::max();

  /// Ranges of voxels that a plane's rows of a slab may cut; a range with hi < lo is empty.
  struct Spans {
    bool any = false;
    int least, most;  // of all rows
    std::array<int, kCutRows> lo, hi;
    Spans() noexcept { clear(); }
    void clear() noexcept {
      any = false;
      least = kNoVoxel;
      most = -2;
      lo.fill(kNoVoxel);
      hi.fill(-2);
    }
  };

  /// Start voxels of a tile's blocks of lanes; the blocks' ends may lie beyond `next`.
  struct Tile {
    int first = 0, next = 0;
    bool is_first = true, is_last = true;
  };
  static constexpr int kTile = LostCells<Density>::kVoxels - VoxelGrid<Density>::kLowerLanes + 1;
  static_assert(kCutRows == LostCells<Density>::kRows);

  bool lower_tiles(const VoxelBox& voxels) noexcept {
    const auto& [lo, hi] = voxels;
    bool any = false;
    for (int i = lo[0]; i <= hi[0]; i = tile_.next) {
      const bool is_last = hi[0] - i < LostCells<Density>::kVoxels;
      tile_ = {i, is_last ? hi[0] + 1 : i + kTile, i == lo[0], is_last};
      for (int j = lo[1]; j <= hi[1]; j += kCutRows)
        any |= lower_slab(j, std::min(hi[1] - j + 1, kCutRows), lo[2], hi[2]);
    }
    return any;
  }

  /// Lowers exactly the voxels of a turn.
  bool lower_parts(const VoxelBox& voxels, const CutTurn& turn) noexcept {
    static_assert(CutTurn::kVoxels[0] <= LostCells<Density>::kVoxels && CutTurn::kVoxels[1] <= kCutRows);
    const auto& lo = voxels.lo;
    const auto& hi = voxels.hi;
    const auto end = [&](int at, std::size_t axis) { return std::min(hi[axis] + 1, CutTurn::next(at, axis)); };
    is_part_ = true;
    bool any = false;
    for (int i = lo[0]; i <= hi[0]; i = tile_.next) {
      tile_ = {i, end(i, 0)};
      for (int j = lo[1]; j <= hi[1]; j = end(j, 1))
        for (int k = lo[2]; k <= hi[2]; k = end(k, 2))
          if (turn.has(i, j, k)) any |= lower_slab(j, end(j, 1) - j, k, end(k, 2) - 1);
    }
    return any;
  }

  /// Lowers rows j to j + count − 1 of the tile in planes first_k to last_k.
  bool lower_slab(int j, int count, int first_k, int last_k) noexcept {
    last_k_ = last_k;
    // Voxels of planes k − 1, k, k + 1.
    std::array<Spans, 3> spans;
    Spans *below = &spans[0], *here = &spans[1], *above = &spans[2];
    bool any = false;
    lost_.start(tile_.first, j);
    find_spans(j, count, first_k, *above);
    for (int k = first_k - 1; k <= last_k + 1; ++k) {
      lost_.enter(k, std::min({below->least, here->least, above->least}),
                  std::max({below->most, here->most, above->most}));
      if (here->any) any |= lower_plane(j, count, k, *here);
      lost_.add();
      std::swap(below, here);
      std::swap(here, above);
      find_spans(j, count, k + 2, *above);
    }
    return any;
  }

  void find_spans(int first, int count, int k, Spans& out) const noexcept {
    out.clear();
    if (k > last_k_) return;
    const Vec3d& h = grid_.spacing();
    RowLanes y;
    for (std::size_t l = 0; l < kCutRows; ++l) y[l] = (first + static_cast<int>(l)) * h.y() - origin_.y();
    RowSpans span;
    cutter_.rows(y, k * h.z() - origin_.z(), reach_, span);
    const double x0 = origin_.x(), per_x = per_x_;
    const int size = grid_.size()[0];
    std::array<int, kCutRows> lo, hi;
    for (std::size_t l = 0; l < kCutRows; ++l) lo[l] = voxel_after((span.lo[l] + x0) * per_x, size);
    for (std::size_t l = 0; l < kCutRows; ++l) hi[l] = voxel_before((span.hi[l] + x0) * per_x, size);
    if (is_part_) {
      for (std::size_t l = 0; l < kCutRows; ++l) lo[l] = std::max(lo[l], tile_.first);
      for (std::size_t l = 0; l < kCutRows; ++l) hi[l] = std::min(hi[l], tile_.next - 1);
    } else if (!tile_.is_first || !tile_.is_last) {
      clip(lo, hi);
    }
    // An empty span has lo > hi.
    int least = kNoVoxel, most = -2;
    for (std::size_t l = 0; l < kCutRows; ++l) {
      const bool any = (static_cast<int>(l) < count) & (lo[l] <= hi[l]);
      out.lo[l] = any ? lo[l] : kNoVoxel;
      out.hi[l] = any ? hi[l] : -2;
    }
    for (std::size_t l = 0; l < kCutRows; ++l) least = out.lo[l] < least ? out.lo[l] : least;
    for (std::size_t l = 0; l < kCutRows; ++l) most = out.hi[l] > most ? out.hi[l] : most;
    out.any = least <= most;
    out.least = least;
    out.most = most;
  }

  /// Visits a tile's blocks, counted from the start of the row's span. A voxel's distance therefore has the same bits
  /// in every tile.
  void clip(std::array<int, kCutRows>& lo, std::array<int, kCutRows>& hi) const noexcept {
    for (std::size_t l = 0; l < kCutRows; ++l) {
      if (lo[l] < tile_.first) {
        const int blocks = (tile_.first - lo[l] + (tile_.is_first ? 0 : kCutLanes - 1)) / kCutLanes;
        lo[l] += blocks * kCutLanes;
      }
      const int blocks = (tile_.next - 1 - lo[l] + kCutLanes) / kCutLanes;
      hi[l] = lo[l] < tile_.next ? std::min(hi[l], lo[l] + blocks * kCutLanes - 1) : -2;
    }
  }

  bool lower_plane(int first, int count, int k, const Spans& spans) noexcept {
    const auto z = static_cast<float>(k * grid_.spacing().z() - origin_.z());
    bool any = false;
    for (int l = 0; l < count; ++l) {
      const int j = first + l;
      const int lo = spans.lo[static_cast<std::size_t>(l)], hi = spans.hi[static_cast<std::size_t>(l)];
      if (lo <= hi) any |= lower(j, k, lo, hi, static_cast<float>(j * grid_.spacing().y() - origin_.y()), z);
    }
    return any;
  }

  bool lower(int j, int k, int first, int last, float y, float z) noexcept {
    const float step = static_cast<float>(grid_.spacing().x());
    return grid_.lower_lanes(
        j, k, first, last,
        [&](int i, int count, const auto& old, auto& value) {
          if (is_low(old)) return;
          constexpr std::size_t kLanes = std::tuple_size_v<std::remove_cvref_t<decltype(old)>>;
          std::array<float, kLanes> d;
          const auto x = static_cast<float>(i * grid_.spacing().x() - origin_.x());
          cutter_.distances(x, step, y, z, d);
          std::array<Wide, kLanes> target;
          find_targets(d, count, target);
          if constexpr (kHasFloor)
            if (limit_.floor()) limit_.floor()->raise(i, j, k, count, old, target);
          if constexpr (kKind == CutKind::kAtOnce) {
            // It needs no old density: VoxelGrid::lower_lanes never raises one.
            for (std::size_t l = 0; l < kLanes; ++l) value[l] = static_cast<Density>(target[l]);
          } else {
            std::array<Wide, kLanes> from;
            for (std::size_t l = 0; l < kLanes; ++l) from[l] = static_cast<Wide>(old[l]);
            // Earlier ticks have cut most blocks, and shares cost more than distances.
            if (!any_lane<Wide, kLanes>([&](std::size_t l) { return target[l] < from[l]; })) return;
            std::array<float, kLanes> share;
            if constexpr (kKind == CutKind::kByPressure)
              share.fill(1);
            else
              cutter_.shares(x, step, y, z, static_cast<float>(reach_), farthest_cut(from), share);
            if constexpr (requires { limit_.tissues(); }) limit_.tissues().scale(i, j, k, count, share);
            lower_in_time(grid_.index(i, j, k), share, target, from, value);
          }
          if constexpr (kHasFloor)
            if (limit_.floor()) limit_.floor()->count_taken(i, j, k, count, old, value);
        },
        [&](int i, std::uint32_t changed, const auto& value) { lost_.note(j, i, changed, value); });
  }

  /// In an image whose air is less than this below the isovalue [of the cut's ramp], air counts as that deep. Voxels
  /// would else fall ever more slowly to the isovalue. With 1, fronts in sharp images recede by a quarter too fast.
  static constexpr float kDeepAir = 0.5F;

  /// Returns the slope of the density toward lower neighbours [densities per metre]; 0 without a lower neighbour.
  template <std::size_t kLanes>
  void fall_toward_lower(std::size_t voxel, std::array<float, kLanes>& steepness) const noexcept {
    const Density* const here = grid_.data() + voxel;
    const std::array<std::ptrdiff_t, 3> pitch{1, grid_.row_pitch(), grid_.plane_pitch()};
    steepness.fill(0);
    const float isovalue = isovalue_;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto per_metre = static_cast<float>(1 / grid_.spacing()[static_cast<Eigen::Index>(a)]);
      const float air = isovalue - (has_deep_air_ ? 0.0F : kDeepAir * per_metre_ / per_metre);
      // All lanes: beyond the last row there is one of border, and 64 spare bytes.
      std::array<Density, kLanes> own, before, after;
      std::memcpy(own.data(), here, sizeof(own));
      std::memcpy(before.data(), here - pitch[a], sizeof(before));
      std::memcpy(after.data(), here + pitch[a], sizeof(after));
      for (std::size_t l = 0; l < kLanes; ++l) before[l] = after[l] < before[l] ? after[l] : before[l];
      for (std::size_t l = 0; l < kLanes; ++l) before[l] = before[l] < own[l] ? before[l] : own[l];
      for (std::size_t l = 0; l < kLanes; ++l) {
        const auto low = static_cast<float>(before[l]);
        const float deep = low < air ? low : air, from = low < isovalue ? deep : low;
        const float fall = (static_cast<float>(own[l]) - from) * per_metre;
        steepness[l] += fall * fall;
      }
    }
    square_roots(steepness);
  }

  /// Returns true if no target is lower than the present densities, which is usual in air.
  template <std::size_t kLanes>
  [[nodiscard]] bool is_low(const std::array<Density, kLanes>& old) const noexcept {
    const auto lowest = static_cast<Density>(lowest_target_);
    return !any_lane<Density, kLanes>([&](std::size_t l) { return old[l] > lowest; });
  }

  /// Returns the geometric cut's targets for the first `count` lanes, and a target that cuts nothing in other lanes and
  /// beyond the reach. Densities are as wide as distances, and each step has its own loop: compilers do not vectorise
  /// mixed widths and long bodies.
  template <std::size_t kLanes>
  void find_targets(const std::array<float, kLanes>& d, int count, std::array<Wide, kLanes>& target) const noexcept {
    const float reach = static_cast<float>(reach_);
    const float isovalue = isovalue_, per_metre = per_metre_;
    const NearestDensity<Density> nearest = nearest_;
    const Wide none = none_, lowest = lowest_target_;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Wide exact = nearest(isovalue + d[l] * per_metre);
      const Wide raised = exact > lowest ? exact : lowest;
      const Wide within = d[l] < reach ? raised : none;
      target[l] = static_cast<int>(l) < count ? within : none;
    }
    if constexpr (kBySteepness)
      for (std::size_t l = 0; l < kLanes; ++l) target[l] = d[l] < -reach && target[l] < none ? kLowest : target[l];
  }

  /// Returns the distances from the cutter [m] from which on the ramp is no lower than these densities. A cut in time
  /// takes nothing of a voxel while the cutter is as far away.
  template <std::size_t kLanes>
  [[nodiscard]] std::array<float, kLanes> farthest_cut(const std::array<Wide, kLanes>& density) const noexcept {
    std::array<float, kLanes> farthest;
    const float per_density = 1 / per_metre_, isovalue = isovalue_;
    for (std::size_t l = 0; l < kLanes; ++l) farthest[l] = (static_cast<float>(density[l]) - isovalue) * per_density;
    return farthest;
  }

  /// Lowers lanes above their target by as much as the limit allows.
  template <std::size_t kLanes>
  void lower_in_time(std::size_t index, const std::array<float, kLanes>& share, const std::array<Wide, kLanes>& target,
                     const std::array<Wide, kLanes>& from, std::array<Density, kLanes>& value) const noexcept {
    const Limit limit = limit_;
    const auto voxel = static_cast<std::uint32_t>(index);
    std::array<float, kBySteepness ? kLanes : 1> steepness;
    if constexpr (kBySteepness) fall_toward_lower(index, steepness);
    std::array<Wide, kLanes> to;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const std::uint32_t here = voxel + static_cast<std::uint32_t>(l);
      if constexpr (kBySteepness)
        to[l] = limit(from[l], target[l], share[l], here, steepness[l]);
      else
        to[l] = limit(from[l], target[l], share[l], here);
    }
    for (std::size_t l = 0; l < kLanes; ++l) to[l] = target[l] < from[l] ? to[l] : from[l];
    for (std::size_t l = 0; l < kLanes; ++l) value[l] = static_cast<Density>(to[l]);
  }

  VoxelGrid<Density>& grid_;
  const C& cutter_;
  const Limit& limit_;
  LostCells<Density> lost_;
  [[no_unique_address]] NearestDensity<Density> nearest_;
  Vec3d origin_;
  double reach_;
  double per_x_;
  float isovalue_;
  float per_metre_;
  bool has_deep_air_;
  Wide lowest_target_{};
  Wide none_ = std::numeric_limits<Density>::max();  // a target that cuts nothing
  int last_k_ = -1;                                  // of the slab
  Tile tile_;
  bool is_part_ = false;
};

}  // namespace detail

/// Cuts `cutter` out of the grid and returns the removed bone [mm³]: the volume that the isosurface loses
/// (`BoneVolume`), never negative. `slope` is in densities per voxel; 0 selects `auto_slope`. A cutter with a
/// non-finite place or off the grid, or an isovalue that is not finite, cuts nothing. Of several turns only the parts
/// of `turn` are cut. Cuts of all turns leave the densities of one cut, unless the policy reads neighbours, and their
/// volumes add up to its volume.
template <VoxelDensity Density, Cutter C, CutPolicy Policy = GeometricCut>
double carve(VoxelGrid<Density>& grid, double isovalue, const C& cutter, const Policy& policy = {},
             const CutAllowance& allowance = {}, double slope = 0, const CutTurn& turn = {}) noexcept {
  if (!is_finite(isovalue)) return 0;
  const auto limit = policy.template limit<Density>(allowance);
  if constexpr (requires { limit.floor(); })
    if (limit.floor() && !limit.floor()->fits(grid, isovalue)) return 0;  // rather no cut than one without its floors
  if constexpr (requires { limit.tissues(); })
    if (!limit.tissues().fits(grid)) return 0;
  const double s = slope_or_auto(slope, grid, isovalue);
  using Limit = std::remove_const_t<decltype(limit)>;
  return detail::Cut<Density, C, Limit, Policy::kKind>(grid, isovalue, s, cutter, limit).run(turn);
}

}  // namespace trephine
