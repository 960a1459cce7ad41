// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_policy.hpp>
#include <trephine/voxel/cutter.hpp>
#include <trephine/voxel/lost_cells.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <cmath>
#include <cstdint>

/// Removing bone. Haptic thread only; no allocation; work bounded by the voxels in the cutter's box.
///
/// A **geometric cut** lowers every voxel to at most ρ_c = iso + slope · d/h, d the signed distance from the cutter and
/// h the grid's longest spacing, rounded to the nearest density and clamped to the type's range. ρ_c is linear in
/// space, so the trilinear interpolant reproduces it and the new isosurface lies on the cutter, whatever the bone's
/// density; a cut made twice changes nothing; what is lower already stays, so no cut adds bone.
///
/// *Slope* [densities per voxel]: see `auto_slope`. *Reach*: see `cut_reach`.
namespace trephine {

/// Voxels farther from the cutter than this [m] are left alone: 1.5 voxels where the spacing is the same along all
/// axes. Beyond a voxel's diagonal they share no cell with the new surface, and those in the diagonal's last seventh
/// weigh so little in theirs that leaving them moves no digit of the measured surface error.
[[nodiscard]] inline double cut_reach(const Vec3d& spacing) noexcept {
  return std::max(1.5 / std::sqrt(3.0) * spacing.norm(), spacing.maxCoeff());
}

/// The slope that a cut uses unless told otherwise, in densities per (longest) voxel edge.
///
/// Two errors pull on it. Rounding to whole densities displaces the surface by up to 1/(2 slope) voxel; and where the
/// bone's ρ − iso is below 1.7 slope it cannot hold the whole ramp, and the surface comes out too far. Measured on a
/// ball of 8 voxels radius (rms distance of the new surface; .022 voxel is the trilinear interpolant's own):
/// | slope | 4 | 8 | 16 | 32 | 64 | 120 |
/// |---|---|---|---|---|---|---|
/// | 8 bit, bone 127 above the isovalue | .045 | .030 | .024 | .022 | .022 | .022 |
/// | 8 bit, bone 12 above | .045 | .030 | .022 | .045 | .146 | .254 |
/// | int16, bone 1700 HU above | | .030 | .024 | .022 | .022 | .022 |
/// | int16, bone 50 HU above | | .030 | .024 | .022 | .019 | .045 |
///
/// So 16 levels for integers, more where the range is so wide that soft bone still lies far above (1/64 of what is
/// above the isovalue), and less where there is no room for 16 above the isovalue or below it.
template <VoxelDensity Density>
[[nodiscard]] double auto_slope(const VoxelGrid<Density>& grid, double isovalue) noexcept {
  const double above = static_cast<double>(grid.original_range().max) - isovalue;
  if constexpr (std::is_floating_point_v<Density>) {
    return above > 0 ? above / 64 : 1.0;
  } else {
    const double below = isovalue - static_cast<double>(std::numeric_limits<Density>::lowest());
    return std::max(std::min({above, below, std::max(16.0, above / 64)}), 4.0);
  }
}

/// A slope as it was asked for, or the automatic one where that was not a slope.
template <VoxelDensity Density>
[[nodiscard]] double slope_or_auto(double slope, const VoxelGrid<Density>& grid, double isovalue) noexcept {
  return slope > 0 && std::isfinite(slope) ? slope : auto_slope(grid, isovalue);
}

namespace detail {

/// Nearest density, halves up, clamped to the type's range. The bounds are members, not constants: compilers that know
/// them turn the clamps into jumps, which no loop with them survives as vector code.
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

/// The first voxel of an axis after a place [voxels] and the last one before it, inside the grid; one beyond it where
/// there is none.
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

/// A cut in progress: lowers rows, plane by plane in slabs of `kCutRows` and tiles of them along x, and adds up what
/// the cells lose that their voxels are corners of. What all cells lose is the sum over the tiles, whatever their
/// order, though two tiles share cells. A limit by steepness sees neighbours as the blocks before left them, so its
/// order is part of its densities; tools narrower than a tile have one tile.
template <VoxelDensity Density, Cutter C, class Limit>
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
        per_metre_(static_cast<float>(slope / grid.spacing().maxCoeff())) {}

  /// Removed volume [mm³].
  [[nodiscard]] double run() noexcept {
    const Vec3d& h = grid_.spacing();
    const auto& size = grid_.size();
    const Eigen::AlignedBox3d box = cutter_.bounds();
    const Vec3d lo = (box.min().array() - reach_).matrix().cwiseQuotient(h);
    const Vec3d hi = (box.max().array() + reach_).matrix().cwiseQuotient(h);
    if (!is_finite(lo) || !is_finite(hi)) return 0;
    // No point is deeper in the body than half its box's shortest side.
    lowest_target_ =
        static_cast<Density>(nearest_(isovalue_ - per_metre_ * static_cast<float>(box.sizes().minCoeff() / 2)));
    if constexpr (kBySteepness) lowest_target_ = kLowest;
    const int last_j = voxel_before(hi.y(), size[1]);
    first_k_ = voxel_after(lo.z(), size[2]);
    last_k_ = voxel_before(hi.z(), size[2]);
    // A voxel more at either end: rounding may let the cutter reach it.
    const int first_i = std::max(voxel_after(lo.x(), size[0]) - 1, 0);
    last_i_ = std::min(voxel_before(hi.x(), size[0]) + 1, size[0] - 1);
    bool any = false;
    for (int i = first_i; i <= last_i_; i = tile_.next) {
      tile_ = {i, last_i_ - i < LostCells<Density>::kVoxels ? last_i_ + 1 : i + kTile, i == first_i};
      for (int j = voxel_after(lo.y(), size[1]); j <= last_j; j += kCutRows)
        any |= lower_slab(j, std::min(last_j - j + 1, kCutRows));
    }
    if (!any) return 0;
    grid_.commit();
    const double cells = lost_.cells();
    // A cell that takes its lines along another axis now may say a hair more than it did.
    return cells > 0 ? cells * h.prod() * 1e9 : 0.0;
  }

 private:
  using Wide = WideDensity<Density>;
  /// Then the cut's ramp is kept where it makes the surface: a receding front, being steeper, would be held up by it.
  static constexpr bool kBySteepness = LimitBySteepness<Limit, Wide>;
  static constexpr Wide kLowest = std::numeric_limits<Density>::lowest();

  static constexpr int kNoVoxel = std::numeric_limits<int>::max();

  /// Voxels of the rows of a slab that may be cut, in one plane; none where hi < lo.
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

  /// Blocks of lanes that begin here are cut in a tile; their ends may lie beyond `next`.
  struct Tile {
    int first = 0, next = 0;
    bool is_first = true;
  };
  static constexpr int kTile = LostCells<Density>::kVoxels - VoxelGrid<Density>::kLowerLanes + 1;
  static_assert(kCutRows == LostCells<Density>::kRows);

  bool lower_slab(int j, int count) noexcept {
    // Voxels of planes k − 1, k, k + 1.
    std::array<Spans, 3> spans;
    Spans *below = &spans[0], *here = &spans[1], *above = &spans[2];
    bool any = false;
    lost_.start(tile_.first, j);
    find_spans(j, count, first_k_, *above);
    for (int k = first_k_ - 1; k <= last_k_ + 1; ++k) {
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
    if (!tile_.is_first || tile_.next <= last_i_) clip(lo, hi);
    // Where the span is empty, lo > hi.
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

  /// To the blocks of a tile, from where the row's span begins: so a voxel's distance is the same bits in any tile.
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
          if constexpr (LimitAtOnce<Limit>) {
            // Needs no old density; that it adds no bone, VoxelGrid::lower_lanes sees to.
            for (std::size_t l = 0; l < kLanes; ++l) value[l] = static_cast<Density>(target[l]);
          } else {
            std::array<Wide, kLanes> from;
            for (std::size_t l = 0; l < kLanes; ++l) from[l] = static_cast<Wide>(old[l]);
            // Most blocks are cut already, and shares cost more than distances.
            if (!any_lane<Wide, kLanes>([&](std::size_t l) { return target[l] < from[l]; })) return;
            std::array<float, kLanes> share;
            cutter_.shares(x, step, y, z, static_cast<float>(reach_), share);
            lower_in_time(grid_.index(i, j, k), share, target, from, value);
          }
        },
        [&](int i, std::uint32_t changed, const auto& value) { lost_.note(j, i, changed, value); });
  }

  /// How steeply the density falls toward lower neighbours [densities per metre]; 0 where none is lower.
  template <std::size_t kLanes>
  void fall_toward_lower(std::size_t voxel, std::array<float, kLanes>& steepness) const noexcept {
    const Density* const here = grid_.data() + voxel;
    const std::array<std::ptrdiff_t, 3> pitch{1, grid_.row_pitch(), grid_.plane_pitch()};
    steepness.fill(0);
    for (std::size_t a = 0; a < 3; ++a) {
      const auto per_metre = static_cast<float>(1 / grid_.spacing()[static_cast<Eigen::Index>(a)]);
      // All lanes: beyond the last row there is one of border, and 64 spare bytes.
      std::array<Density, kLanes> own, before, after;
      std::memcpy(own.data(), here, sizeof(own));
      std::memcpy(before.data(), here - pitch[a], sizeof(before));
      std::memcpy(after.data(), here + pitch[a], sizeof(after));
      for (std::size_t l = 0; l < kLanes; ++l) before[l] = after[l] < before[l] ? after[l] : before[l];
      for (std::size_t l = 0; l < kLanes; ++l) before[l] = before[l] < own[l] ? before[l] : own[l];
      for (std::size_t l = 0; l < kLanes; ++l) {
        const float fall = (static_cast<float>(own[l]) - static_cast<float>(before[l])) * per_metre;
        steepness[l] += fall * fall;
      }
    }
    square_roots(steepness);
  }

  /// Whether no target can be lower than what is there: air, mostly.
  template <std::size_t kLanes>
  [[nodiscard]] bool is_low(const std::array<Density, kLanes>& old) const noexcept {
    const Density lowest = lowest_target_;
    return !any_lane<Density, kLanes>([&](std::size_t l) { return old[l] > lowest; });
  }

  /// What the geometric cut makes of the first `count` lanes; in others, and beyond the reach, nothing is as high.
  /// Densities as wide as distances and each step in a loop of its own: mixed widths and long bodies stay scalar.
  template <std::size_t kLanes>
  void find_targets(const std::array<float, kLanes>& d, int count, std::array<Wide, kLanes>& target) const noexcept {
    const float reach = static_cast<float>(reach_);
    const float isovalue = isovalue_, per_metre = per_metre_;
    const NearestDensity<Density> nearest = nearest_;
    const Wide none = none_;
    for (std::size_t l = 0; l < kLanes; ++l) {
      const Wide exact = nearest(isovalue + d[l] * per_metre);
      const Wide within = d[l] < reach ? exact : none;
      target[l] = static_cast<int>(l) < count ? within : none;
    }
    if constexpr (kBySteepness)
      for (std::size_t l = 0; l < kLanes; ++l) target[l] = d[l] < -reach && target[l] < none ? kLowest : target[l];
  }

  /// Lanes that lie above their target fall as the limit lets them.
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
  Density lowest_target_{};
  Wide none_ = std::numeric_limits<Density>::max();  // a target that cuts nothing
  int first_k_ = 0, last_k_ = -1, last_i_ = -1;
  Tile tile_;
};

}  // namespace detail

/// Cuts `cutter` out of the grid and returns the bone removed [mm³]: the volume that the isosurface loses
/// (`BoneVolume`), never negative.
/// `slope` [densities per voxel], 0: `auto_slope`. A cutter with a non-finite place or away from the grid does nothing,
/// nor does an isovalue that is not finite.
template <VoxelDensity Density, Cutter C, CutPolicy Policy = GeometricCut>
double carve(VoxelGrid<Density>& grid, double isovalue, const C& cutter, const Policy& policy = {},
             const CutAllowance& allowance = {}, double slope = 0) noexcept {
  if (!std::isfinite(isovalue)) return 0;
  const auto limit = policy.template limit<Density>(allowance);
  const double s = slope_or_auto(slope, grid, isovalue);
  return detail::Cut<Density, C, std::remove_const_t<decltype(limit)>>(grid, isovalue, s, cutter, limit).run();
}

}  // namespace trephine
