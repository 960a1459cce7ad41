// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/depth_build.hpp>

#include <array>
#include <cstdint>
#include <functional>
#include <limits>

namespace trephine {

struct DepthOptions {
  /// Distances are kept up to this many voxels (shortest spacing) to either side of the surface; farther ones say as
  /// much and no more. Work of a cut goes with its cube.
  double reach = 4;
  bool keep_original = true;  ///< keep a copy for `restore()`: two bytes a voxel more

  void validate() const {
    if (!(reach >= 2 && reach <= 100)) refuse("DepthMap", "reach must be 2 to 100 voxels", reach);
  }
};

namespace detail {
/// A limit by steepness, where that is the same everywhere: of depths, but for those that say no more than "deeper".
template <class Limit>
struct EvenlySteep {
  Limit limit;
  float steepness;
  int deepest;
  [[nodiscard]] int operator()(int old, int target, float share, std::uint32_t voxel) const noexcept {
    return old < deepest ? limit(old, target, share, voxel, steepness) : old;
  }
};
}  // namespace detail

/// Signed depth in bone on the voxels' own lattice: positive in bone, the distance to its surface, which is where the
/// trilinear density meets the isovalue. 16 bit in steps of 1/256 voxel. One sample of it says how deep a point is and
/// where the way out is, which takes a search in the densities; and outside it bounds how far bone is.
///
/// *Made* from a grid once, at load: the nearest point of the surface for each voxel beside it (on the interpolant,
/// with normals as `SplineGradient` gives them), then the nearest of those points for all voxels within reach. Its
/// memory is 2 bytes a voxel (4 with `keep_original`); 12 bytes a voxel more while it is made.
///
/// *Cut* together with the bone: inside, the depth of A without B is min(depth in A, distance to B), which a cut does
/// voxel by voxel and exactly, as far as the reach. Outside, depths stay what they were or fall: there they are bounds
/// of the distance to bone, not distances. A cut by rate lowers the depth in `follow`, one by speed in `recede`.
///
/// Threads: as a VoxelGrid has it; the map is the haptic thread's.
class DepthMap {
 public:
  using Grid = VoxelGrid<std::int16_t>;
  static constexpr int kPerVoxel = 256;
  /// Called while a map is made with the share done, 0 to 1.
  using Progress = std::function<void(double)>;

  /// Throws std::invalid_argument for an isovalue that is not finite or options out of range.
  template <VoxelDensity Density>
  DepthMap(const VoxelGrid<Density>& bone, double isovalue, const DepthOptions& options = {},
           const Progress& progress = {})
      : unit_(bone.spacing().minCoeff() / kPerVoxel),
        reach_(options.reach * bone.spacing().minCoeff()),
        grid_(make(bone, isovalue, options, unit_, progress)) {}

  /// The depths as densities of a grid whose isovalue is 0, in G of the bone.
  [[nodiscard]] const Grid& grid() const noexcept { return grid_; }
  /// Metres per step of depth.
  [[nodiscard]] double unit() const noexcept { return unit_; }
  /// Largest depth it tells [m].
  [[nodiscard]] double reach() const noexcept { return reach_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return grid_.bytes(); }

  /// Takes the cutter's body out. Haptic thread; no allocation; work bounded by the voxels within reach of the cutter.
  template <Cutter C>
  void cut(const C& cutter) noexcept {
    const auto limit = GeometricCut{}.limit<std::int16_t>({});
    const double slope = kPerVoxel * grid_.spacing().maxCoeff() / grid_.spacing().minCoeff();
    static_cast<void>(detail::Cut<std::int16_t, C, std::remove_const_t<decltype(limit)>, false>(grid_, 0, slope, reach_,
                                                                                                cutter, limit)
                          .run());
  }

  /// Lets depths follow a cut that lets the surface recede at a speed: those within reach fall alike where the cutter
  /// covers them, and all there and beside it to at most a neighbour's depth and the way to it. Haptic thread; no
  /// allocation; work bounded by the cutter's box.
  template <Cutter C, class Policy>
  void recede(const C& cutter, const Policy& policy, const CutAllowance& allowance) noexcept {
    const detail::EvenlySteep<typename Policy::template Limit<std::int16_t>> limit{
        policy.template limit<std::int16_t>(allowance), static_cast<float>(1 / unit_),
        static_cast<int>(reach_ / unit_ - 0.5)};
    const double slope = kPerVoxel * grid_.spacing().maxCoeff() / grid_.spacing().minCoeff();
    const std::uint64_t edits = grid_.edit_count();
    static_cast<void>(detail::Cut<std::int16_t, C, std::remove_const_t<decltype(limit)>>(
                          grid_, 0, slope, cut_reach(grid_.spacing()), cutter, limit)
                          .run());
    if (grid_.edit_count() != edits) keep_slopes(VoxelBox(grid_.last_edit()));
  }

  /// Lets depths follow densities that were lowered by anything else than a whole cut, in `box`: voxels beside the
  /// surface are as deep as it lies off by the densities' fall toward it, those behind it at most as deep as a
  /// neighbour and the way to it, on either side. Bone that wears is no ramp: of a neighbour emptied to far below the
  /// isovalue, or hard bone behind it, only both together tell where the surface is. What lies behind is looked at one
  /// voxel a call. Haptic thread; no allocation; work bounded by the box.
  template <VoxelDensity Density>
  void follow(const VoxelGrid<Density>& bone, double isovalue, const VoxelBox& box) noexcept {
    if (box.empty()) return;
    lower(box, 1, [&](int i, int j, int k, const auto& old, auto& value) {
      meet_surface(bone, static_cast<float>(isovalue), bone.index(i, j, k), old, value);
    });
    keep_slopes(box);
    const Ways ways = ways_to_neighbours();
    lower(box, 1, [&](int i, int j, int k, const auto& old, auto& value) {
      fall_outside(bone, static_cast<float>(isovalue), i, j, k, ways, old, value);
    });
  }

  /// The depths as they were made; see VoxelGrid::restore. Throws std::invalid_argument without `keep_original`.
  std::size_t restore(std::size_t max_bricks = std::numeric_limits<std::size_t>::max()) {
    return grid_.restore(max_bricks);
  }

 private:
  template <VoxelDensity Density>
  static Grid make(const VoxelGrid<Density>& bone, double isovalue, const DepthOptions& options, double unit,
                   const Progress& progress) {
    if (!std::isfinite(isovalue)) refuse("DepthMap", "isovalue must be finite", isovalue);
    options.validate();
    const double reach = options.reach * bone.spacing().minCoeff();
    const auto depths = detail::DepthBuilder<Density>(bone, isovalue, reach, progress).run(unit);
    // Bone that the volume's edge cuts off ends half a voxel beyond it.
    return Grid({.size = bone.size(), .spacing = bone.spacing(), .X_WG = bone.X_WG(), .outside = -kPerVoxel / 2},
                depths, {.keep_original = options.keep_original});
  }

  using Ways = std::array<std::int16_t, 8>;  // to a neighbour that differs along x (1), y (2), z (4)

  /// A bound as a depth, rounded down; whole depths are far from the type's ends.
  [[nodiscard]] static std::int16_t at_most(float bound) noexcept {
    constexpr float kEnd = 30000;
    const float b = bound < kEnd ? (bound > -kEnd ? bound : -kEnd) : kEnd;
    const int whole = static_cast<int>(b);
    return static_cast<std::int16_t>(static_cast<float>(whole) > b ? whole - 1 : whole);
  }

  [[nodiscard]] Ways ways_to_neighbours() const noexcept {
    Ways ways;
    for (int n = 0; n < 8; ++n) {
      const Vec3d step = grid_.spacing().cwiseProduct(Vec3d(n & 1, (n >> 1) & 1, n >> 2)) / unit_;
      ways[static_cast<std::size_t>(n)] = static_cast<std::int16_t>(std::min(std::ceil(step.norm()), 16000.0));
    }
    return ways;
  }

  /// Lowers the depths of voxels beside the surface to where it lies by the densities' fall toward it (exact where they
  /// are linear), and of those that are bone no more to 0.
  template <VoxelDensity Density, class Lanes>
  void meet_surface(const VoxelGrid<Density>& bone, float isovalue, std::size_t voxel, const Lanes& old,
                    Lanes& value) const noexcept {
    constexpr std::size_t kLanes = std::tuple_size_v<Lanes>;
    const Density* const here = bone.data() + voxel;
    const std::array<std::ptrdiff_t, 3> pitch{1, bone.row_pitch(), bone.plane_pitch()};
    const auto to_air = [&](std::size_t l) {
      return static_cast<float>(here[l]) >= isovalue ? old[l] : std::min(old[l], std::int16_t{0});
    };
    if (!meets_surface<kLanes>(here, pitch, isovalue)) {
      for (std::size_t l = 0; l < kLanes; ++l) value[l] = to_air(l);
      return;
    }
    std::array<float, kLanes> steepness{};  // [densities per step of depth]
    std::array<std::int32_t, kLanes> beside{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto per_step = static_cast<float>(unit_ / bone.spacing()[static_cast<Eigen::Index>(a)]);
      for (std::size_t l = 0; l < kLanes; ++l) {
        const auto at = static_cast<std::ptrdiff_t>(l);
        const auto mine = static_cast<float>(here[at]);
        const auto one = static_cast<float>(here[at - pitch[a]]), other = static_cast<float>(here[at + pitch[a]]);
        const float least = std::min(one, other), most = std::max(one, other);
        const bool in = mine >= isovalue;
        const float fall = std::max(0.0F, in ? mine - least : most - mine) * per_step;
        steepness[l] += fall * fall;
        beside[l] |= static_cast<std::int32_t>(in ? least < isovalue : most >= isovalue);
      }
    }
    detail::take_roots(steepness);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float above = static_cast<float>(here[l]) - isovalue;
      const std::int16_t met = at_most(above / steepness[l]);
      value[l] = beside[l] != 0 ? std::min(old[l], met) : to_air(l);
    }
  }

  /// Whether any of these voxels may have a neighbour on the surface's other side.
  template <std::size_t kLanes, VoxelDensity Density>
  [[nodiscard]] static bool meets_surface(const Density* here, const std::array<std::ptrdiff_t, 3>& pitch,
                                          float isovalue) noexcept {
    Density least = *here, most = *here;
    const auto widen = [&](std::ptrdiff_t by) {
      for (std::size_t l = 0; l < kLanes; ++l) {
        const Density d = here[static_cast<std::ptrdiff_t>(l) + by];
        least = std::min(least, d);
        most = std::max(most, d);
      }
    };
    widen(0);
    for (const std::ptrdiff_t p : pitch) {
      widen(-p);
      widen(p);
    }
    return static_cast<float>(least) < isovalue && static_cast<float>(most) >= isovalue;
  }

  /// Lowers depths outside bone to at least a neighbour's less seven eighths of the way to it: the shortest way goes
  /// between neighbours. Not beside the surface, where depths are told.
  template <VoxelDensity Density, class Lanes>
  void fall_outside(const VoxelGrid<Density>& bone, float isovalue, int i, int j, int k, const Ways& ways,
                    const Lanes& old, Lanes& value) const noexcept {
    std::int16_t highest = std::numeric_limits<std::int16_t>::min();
    std::int16_t lowest = std::numeric_limits<std::int16_t>::max();
    for (const std::int16_t v : old) {
      highest = std::max(highest, v);
      lowest = std::min(lowest, v);
    }
    const auto enough = static_cast<std::int16_t>(-2 * std::max({ways[1], ways[2], ways[4]}));  // for all who ask
    if (lowest > 0 || highest <= enough) return;
    const std::int16_t* here = grid_.data() + grid_.index(i, j, k);
    Lanes most;
    most.fill(enough);
    for (int dk = -1; dk <= 1; ++dk)
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          if (di == 0 && dj == 0 && dk == 0) continue;
          const int whole = ways[static_cast<std::size_t>(di * di + 2 * dj * dj + 4 * dk * dk)];
          const auto way = static_cast<std::int16_t>(whole - whole / 8);
          const std::int16_t* there = here + (dk * grid_.plane_pitch() + dj * grid_.row_pitch() + di);
          for (std::size_t l = 0; l < most.size(); ++l)
            most[l] = std::max(most[l], static_cast<std::int16_t>(there[l] - way));
        }
    const Density* const density = bone.data() + bone.index(i, j, k);
    const std::array<std::ptrdiff_t, 3> pitch{1, bone.row_pitch(), bone.plane_pitch()};
    for (std::size_t l = 0; l < most.size(); ++l) {
      const Density* const mine = density + l;
      float densest = static_cast<float>(*mine);
      for (const std::ptrdiff_t p : pitch) densest = std::max(densest, static_cast<float>(std::max(mine[-p], mine[p])));
      value[l] = densest >= isovalue ? old[l] : std::min(old[l], most[l]);
    }
  }

  /// In `box` and beside it.
  void keep_slopes(const VoxelBox& box) noexcept {
    const Ways ways = ways_to_neighbours();
    lower(box, 2, [&](int i, int j, int k, const auto& old, auto& value) { keep_slope(i, j, k, ways, old, value); });
  }

  /// Lowers depths in bone to at most a neighbour's and the way to it.
  template <class Lanes>
  void keep_slope(int i, int j, int k, const Ways& ways, const Lanes& old, Lanes& value) const noexcept {
    std::int16_t deepest = 0;
    for (const std::int16_t v : old) deepest = std::max(deepest, v);
    if (deepest == 0) return;  // outside, depths are bounds already
    const std::int16_t* here = grid_.data() + grid_.index(i, j, k);
    Lanes least = old;
    for (int dk = -1; dk <= 1; ++dk)
      for (int dj = -1; dj <= 1; ++dj)
        for (int di = -1; di <= 1; ++di) {
          const std::int16_t way = ways[static_cast<std::size_t>(di * di + 2 * dj * dj + 4 * dk * dk)];
          const std::int16_t* there = here + (dk * grid_.plane_pitch() + dj * grid_.row_pitch() + di);
          for (std::size_t l = 0; l < least.size(); ++l)
            least[l] = std::min(least[l], static_cast<std::int16_t>(there[l] + way));
        }
    for (std::size_t l = 0; l < least.size(); ++l) value[l] = old[l] > 0 ? std::max(least[l], std::int16_t{0}) : old[l];
  }

  /// Lowers the voxels of `box`, `margin` voxels grown, by `edit(i, j, k, old, value)`, lanes of a row at a time.
  template <class Edit>
  void lower(const VoxelBox& box, int margin, const Edit& edit) noexcept {
    std::array<int, 3> lo;
    std::array<int, 3> hi;
    for (std::size_t a = 0; a < 3; ++a) {
      lo[a] = std::max(box.lo[a] - margin, 0);
      hi[a] = std::min(box.hi[a] + margin, grid_.size()[a] - 1);
    }
    for (int k = lo[2]; k <= hi[2]; ++k)
      for (int j = lo[1]; j <= hi[1]; ++j)
        grid_.lower_lanes(j, k, lo[0], hi[0], [&](int i, int count, const auto& old, auto& value) {
          edit(i, j, k, old, value);
          for (auto l = static_cast<std::size_t>(count); l < value.size(); ++l) value[l] = old[l];
        });
    grid_.commit();
  }

  double unit_;
  double reach_;
  Grid grid_;
};

/// A bone and its depths, for cuts that keep both.
template <VoxelDensity Density>
class BoneWithDepth {
 public:
  BoneWithDepth(VoxelGrid<Density>& bone, DepthMap& depth) noexcept : bone_(&bone), depth_(&depth) {}

  [[nodiscard]] VoxelGrid<Density>& bone() const noexcept { return *bone_; }
  [[nodiscard]] DepthMap& depth() const noexcept { return *depth_; }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return bone_->spacing(); }
  [[nodiscard]] std::uint64_t rise_stamp() const noexcept { return bone_->rise_stamp(); }

  /// Lets the depths follow the bone's last edit, made by anything else than a whole cut.
  void follow(double isovalue) noexcept { depth_->follow(*bone_, isovalue, bone_->last_edit()); }

  /// Puts the originals back, as VoxelGrid::restore does; returns how many bricks are left in the one that has more.
  std::size_t restore(std::size_t max_bricks = std::numeric_limits<std::size_t>::max()) {
    return std::max(bone_->restore(max_bricks), depth_->restore(max_bricks));
  }

 private:
  VoxelGrid<Density>* bone_;
  DepthMap* depth_;
};

/// As for a bone alone; its depths follow. Returns the removed volume [mm³].
template <VoxelDensity Density, Cutter C, CutPolicy Policy = GeometricCut>
double carve(BoneWithDepth<Density>& bone, double isovalue, const C& cutter, const Policy& policy = {},
             const CutAllowance& allowance = {}, double slope = 0) noexcept {
  const std::uint64_t edits = bone.bone().edit_count();
  const double removed = carve(bone.bone(), isovalue, cutter, policy, allowance, slope);
  // A body that changes no density lies in air, where no depth exceeds the distance to it.
  if (bone.bone().edit_count() == edits) return removed;
  if constexpr (std::is_same_v<Policy, GeometricCut>)
    bone.depth().cut(cutter);
  else if constexpr (LimitBySteepness<typename Policy::template Limit<Density>, WideDensity<Density>>)
    bone.depth().recede(cutter, policy, allowance);
  else
    bone.follow(isovalue);
  return removed;
}

}  // namespace trephine
