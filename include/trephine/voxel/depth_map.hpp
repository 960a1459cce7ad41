// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/carving.hpp>
#include <trephine/voxel/depth_build.hpp>

#include <cstdint>
#include <functional>

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

  /// Lowers depths to what densities allow that were lowered by anything else than a whole cut: in `box` to at most
  /// (ρ − iso) / slope voxels, the ramp that cuts leave; and there and beside it to at most a neighbour's depth and the
  /// way to it. Haptic thread; no allocation; work bounded by the box.
  template <VoxelDensity Density>
  void follow(const VoxelGrid<Density>& bone, double isovalue, double slope, const VoxelBox& box) noexcept {
    if (box.empty() || !(slope > 0)) return;
    const auto per_density =
        static_cast<float>(kPerVoxel * bone.spacing().maxCoeff() / bone.spacing().minCoeff() / slope);
    const auto iso = static_cast<float>(isovalue);
    lower(box, 0, [&](int i, int j, int k, const auto&, auto& value) {
      const Density* density = bone.data() + bone.index(i, j, k);
      for (std::size_t l = 0; l < value.size(); ++l)
        value[l] = std::min(value[l], at_most(per_density * (static_cast<float>(density[l]) - iso)));
    });
    keep_slopes(box);
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

  /// In `box` and beside it.
  void keep_slopes(const VoxelBox& box) noexcept {
    Ways ways;
    for (int n = 0; n < 8; ++n) {
      const Vec3d step = grid_.spacing().cwiseProduct(Vec3d(n & 1, (n >> 1) & 1, n >> 2)) / unit_;
      ways[static_cast<std::size_t>(n)] = static_cast<std::int16_t>(std::min(std::ceil(step.norm()), 16000.0));
    }
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
  void follow(double isovalue, double slope = 0) noexcept {
    depth_->follow(*bone_, isovalue, slope_or_auto(slope, *bone_, isovalue), bone_->last_edit());
  }

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
    bone.follow(isovalue, slope);
  return removed;
}

}  // namespace trephine
