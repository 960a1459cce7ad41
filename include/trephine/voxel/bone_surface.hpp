// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/sampling.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <memory>
#include <mutex>
#include <vector>

namespace trephine {

template <VoxelDensity Density>
class BoneSurfaceView;

/// A small piece of the isosurface where it crosses the edge between two voxels: a parallelogram about `position`,
/// exact on the trilinear interpolant, spanned by `along` and `across` (half of the way to the next crossing on either
/// side), of `area` [m²]. G axes, metres.
struct SurfacePatch {
  Vec3d position;
  Vec3d along;
  Vec3d across;
  double area;
};

/// A patch as a brick keeps it: single precision, relative to the brick's voxel 0.
struct PatchInBrick {
  float x, y, z;          ///< position [m]
  float slope_b, slope_c;  ///< voxels that the surface rises along the edge's axis in one voxel of the next two
  float area;              ///< [m²]
  std::uint32_t edge;      ///< 3 (x + 9 y + 81 z) + axis of the voxel edge, x, y, z from −1 on; …
                           ///< and kEdges times which of its parts
  static constexpr std::uint32_t kEdges = 3 * 9 * 9 * 9;
};

/// A grid's spacing and how a patch is cut into parts along each axis, so that parts are as long as they are wide.
struct PatchSpacing {
  Vec3d spacing = Vec3d::Zero();  ///< of the voxels [m]
  Vec3d part = Vec3d::Zero();     ///< of the parts [m]
};

/// The patch in G; `corner` is where the brick's voxel 0 lies.
[[nodiscard]] inline SurfacePatch surface_patch(const PatchInBrick& in_brick, const Vec3d& corner,
                                                const PatchSpacing& of) noexcept {
  const int a = static_cast<int>(in_brick.edge % 3), b = (a + 1) % 3, c = (a + 2) % 3;
  const Vec3d &spacing = of.spacing, &part = of.part;
  SurfacePatch p;
  p.position = corner + Vec3d(static_cast<double>(in_brick.x), static_cast<double>(in_brick.y),
                              static_cast<double>(in_brick.z));
  p.along.setZero();
  p.across.setZero();
  p.along[b] = part[b] / 2;
  p.along[a] = static_cast<double>(in_brick.slope_b) * spacing[a] * (part[b] / spacing[b]) / 2;
  p.across[c] = part[c] / 2;
  p.across[a] = static_cast<double>(in_brick.slope_c) * spacing[a] * (part[c] / spacing[c]) / 2;
  p.area = static_cast<double>(in_brick.area);
  return p;
}

/// Patches of a brick in arrays of this many.
struct PatchBlock {
  static constexpr int kSize = 64;
  std::array<float, kSize> x, y, z, slope_b, slope_c, area;  // as PatchInBrick has them
  std::array<float, kSize> spread;                           // no point of the patch is farther from its position [m]
  std::array<std::uint32_t, kSize> edge;

  [[nodiscard]] PatchInBrick at(std::size_t i) const noexcept {
    return {x[i], y[i], z[i], slope_b[i], slope_c[i], area[i], edge[i]};
  }
};

/// The bone's isosurface as quadrature points, kept brick by brick (8³ voxels) where a tool comes near.
///
/// A voxel edge whose ends lie on different sides of the isovalue carries a patch. Crossings along x sample the surface
/// on the lattice of (y, z), each standing for the area h_y h_z / |n_x|; those along y and z sample it again. A
/// partition of unity weighs the three, χ_a = g_a⁸ / Σ g⁸ with g the density's gradient per voxel, so that areas add up
/// to the surface's in every direction and every orientation is sampled along its steepest axis.
///
/// Bricks are made when they are asked for, made anew when the grid's version of them changed, and let go, those that
/// were not used longest, when the store is full. Memory: 2 kB a block of 64 patches, one to three blocks a brick of
/// bone's surface, `blocks` of them at most; and 4 bytes a brick of the grid. No allocation after construction.
///
/// Threads: construction anywhere, all else on the haptic thread. The grid must outlive it and stay where it is.
template <VoxelDensity Density>
class BoneSurface {
 public:
  using Grid = VoxelGrid<Density>;
  static constexpr int kBrick = Grid::kBrick;
  static constexpr std::size_t kDefaultBlocks = 4096;  ///< 9 MB
  static constexpr int kMostParts = 8;                 ///< of a patch along an axis
  /// Bricks that one tick may make (`begin_tick`): about 0.2 ms.
  static constexpr int kBricksPerTick = 128;

  /// Throws std::invalid_argument for an isovalue that is not finite.
  BoneSurface(const Grid& grid, double isovalue, std::size_t blocks = kDefaultBlocks)
      : grid_(&grid),
        isovalue_(isovalue),
        slot_of_(grid.brick_count(), kNone),
        slots_(blocks),
        blocks_(blocks),
        next_(blocks) {
    patch_spacing_.spacing = grid.spacing();
    for (int a = 0; a < 3; ++a) {
      const double longer = grid.spacing()[a] / grid.spacing().minCoeff();
      parts_[static_cast<std::size_t>(a)] = std::clamp(static_cast<int>(std::lround(longer)), 1, kMostParts);
      patch_spacing_.part[a] = grid.spacing()[a] / parts_[static_cast<std::size_t>(a)];
    }
    if (!std::isfinite(isovalue)) refuse("BoneSurface", "isovalue must be finite", isovalue);
    if (blocks < kLeastBlocks) refuse("BoneSurface", "blocks must be at least 2188", blocks);
    for (std::size_t i = 0; i < blocks; ++i) {
      next_[i] = static_cast<std::int32_t>(i + 1 < blocks ? i + 1 : kEnd);
      slots_[i].next_free = next_[i];
    }
  }
  BoneSurface(const BoneSurface&) = delete;
  BoneSurface& operator=(const BoneSurface&) = delete;

  [[nodiscard]] const Grid& grid() const noexcept { return *grid_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  [[nodiscard]] std::size_t bytes() const noexcept {
    return blocks_.size() * (sizeof(PatchBlock) + sizeof(std::int32_t)) + slots_.size() * sizeof(Slot) +
           slot_of_.size() * sizeof(std::int32_t);
  }

  /// The surface as renderers take it.
  [[nodiscard]] BoneSurfaceView<Density> view() noexcept { return BoneSurfaceView<Density>(*this); }

  /// A new tick may make kBricksPerTick bricks again.
  void begin_tick() noexcept { budget_ = kBricksPerTick; }
  /// Bricks asked for from here on are let go after those asked for before.
  void begin_use() noexcept { ++use_; }

  /// Whether the surface crosses the brick, as its range of densities has it.
  [[nodiscard]] bool crosses(std::size_t brick) const noexcept {
    const auto range = grid_->brick_range(brick);
    return static_cast<double>(range.min) < isovalue_ && static_cast<double>(range.max) >= isovalue_;
  }

  /// Whether the brick or its halo holds bone.
  [[nodiscard]] bool has_bone(std::size_t brick) const noexcept {
    return static_cast<double>(grid_->brick_range(brick).max) >= isovalue_;
  }

  /// Makes the brick's patches or finds them up to date; false where this tick may make no more. They stay until the
  /// next call.
  [[nodiscard]] bool provide(std::size_t brick) noexcept {
    std::int32_t s = slot_of_[brick];
    const std::uint32_t version = grid_->brick_version(brick);
    const std::uint64_t stamp = grid_->rise_stamp();
    if (s != kNone && slots_[at(s)].version == version && slots_[at(s)].stamp == stamp) {
      slots_[at(s)].used = use_;
      return true;
    }
    if (budget_ == 0) return false;
    --budget_;
    if (s == kNone) {
      if (free_slot_ == kEnd) let_go(nullptr);
      s = free_slot_;
      free_slot_ = slots_[at(s)].next_free;
      slots_[at(s)] = {};
      slots_[at(s)].brick = static_cast<std::int64_t>(brick);
      slot_of_[brick] = s;
    }
    make(slots_[at(s)], brick);
    slots_[at(s)].used = use_;
    slots_[at(s)].version = version;
    slots_[at(s)].stamp = stamp;
    return true;
  }

  /// Calls visit(block, count) for the blocks of a brick that `provide` provided.
  template <class Visit>
  void for_each_block(std::size_t brick, Visit&& visit) const noexcept {
    const Slot& slot = slots_[at(slot_of_[brick])];
    int left = slot.count;
    for (std::int32_t b = slot.first; b != kEnd; b = next_[at(b)], left -= PatchBlock::kSize)
      visit(blocks_[at(b)], std::min(left, PatchBlock::kSize));
  }

  /// Where a brick's voxel 0 lies in G [m].
  [[nodiscard]] Vec3d corner(std::size_t brick) const noexcept {
    const auto [bx, by, bz] = grid_->brick_coordinates(brick);
    return grid_->spacing().cwiseProduct(Vec3d(bx * kBrick, by * kBrick, bz * kBrick));
  }

  [[nodiscard]] const PatchSpacing& patch_spacing() const noexcept { return patch_spacing_; }

  /// Whether p_G is bone: its interpolated density reaches the isovalue.
  [[nodiscard]] bool is_bone(const Vec3d& p_G) const noexcept {
    const Vec3d u = p_G.cwiseQuotient(grid_->spacing()) + Vec3d::Ones();
    return sample(SampleView<Density, double>(*grid_), u) >= isovalue_;
  }

 private:
  static constexpr std::int32_t kNone = -1, kEnd = -2;
  /// What a brick can take, every edge of it crossed and every patch in all its parts.
  static constexpr std::size_t kLeastBlocks =
      PatchInBrick::kEdges * kMostParts * kMostParts / static_cast<std::size_t>(PatchBlock::kSize) + 1;
  /// Patches of a smaller share χ are left out: they lie so flat along their axis that they would reach far.
  static constexpr float kLeastShare = 0.01F;
  static constexpr float kRoundedUp = 1.001F;

  struct Slot {
    std::int64_t brick = -1;
    std::uint64_t used = 0;
    std::uint64_t stamp = 0;
    std::uint32_t version = 0;
    int count = 0;
    std::int32_t first = kEnd;
    std::int32_t next_free = kEnd;
  };

  [[nodiscard]] static std::size_t at(std::int32_t i) noexcept { return static_cast<std::size_t>(i); }

  void release_blocks(Slot& slot) noexcept {
    while (slot.first != kEnd) {
      const std::int32_t b = slot.first;
      slot.first = next_[at(b)];
      next_[at(b)] = free_block_;
      free_block_ = b;
    }
    slot.count = 0;
  }
  void release(std::int32_t s) noexcept {
    Slot& slot = slots_[at(s)];
    release_blocks(slot);
    slot_of_[static_cast<std::size_t>(slot.brick)] = kNone;
    slot.brick = -1;
    slot.next_free = free_slot_;
    free_slot_ = s;
  }

  /// Lets a brick other than `keep` go by the clock rule: one of an earlier use if the first round finds any.
  void let_go(const Slot* keep) noexcept {
    for (std::size_t tried = 0; tried <= 2 * slots_.size(); ++tried) {
      hand_ = hand_ + 1 < slots_.size() ? hand_ + 1 : 0;
      const Slot& slot = slots_[hand_];
      if (slot.brick < 0 || &slot == keep || (slot.used >= use_ && tried < slots_.size())) continue;
      release(static_cast<std::int32_t>(hand_));
      return;
    }
  }

  void make(Slot& slot, std::size_t brick) noexcept;

  const Grid* grid_;
  double isovalue_;
  std::vector<std::int32_t> slot_of_;  // of each brick of the grid
  std::vector<Slot> slots_;
  std::vector<PatchBlock> blocks_;
  std::vector<std::int32_t> next_;  // block after a block, in a brick or among the free ones
  std::int32_t free_block_ = 0;
  std::int32_t free_slot_ = 0;
  std::size_t hand_ = 0;
  std::uint64_t use_ = 2;
  int budget_ = kBricksPerTick;
  std::array<int, 3> parts_{};
  PatchSpacing patch_spacing_;
};

/// Finds the crossed edges of a brick by rows of bits, then interpolates on each.
template <VoxelDensity Density>
void BoneSurface<Density>::make(Slot& slot, std::size_t brick) noexcept {
  release_blocks(slot);
  const auto [bx, by, bz] = grid_->brick_coordinates(brick);
  const std::array<int, 3> base{bx * kBrick, by * kBrick, bz * kBrick};
  std::array<int, 3> lo{}, hi{};  // edges start at voxels lo to hi − 1, relative to the brick
  for (std::size_t a = 0; a < 3; ++a) {
    lo[a] = base[a] == 0 ? -1 : 0;
    hi[a] = std::min(kBrick, grid_->size()[a] - base[a]);
  }
  // Bit i + 1 of row (j, k): whether voxel i is bone.
  std::array<std::array<std::uint32_t, kBrick + 2>, kBrick + 2> bone{};
  const auto isovalue = static_cast<float>(isovalue_);
  const std::ptrdiff_t row = grid_->row_pitch(), plane = grid_->plane_pitch();
  const Density* const origin = grid_->data() + grid_->index(base[0], base[1], base[2]);
  for (int k = lo[2]; k <= hi[2]; ++k)
    for (int j = lo[1]; j <= hi[1]; ++j) {
      const Density* const voxel = origin + k * plane + j * row;
      std::uint32_t bits = 0;
      for (int i = lo[0]; i <= hi[0]; ++i)
        bits |= static_cast<std::uint32_t>(static_cast<float>(voxel[i]) >= isovalue) << (i + 1);
      bone[static_cast<std::size_t>(k + 1)][static_cast<std::size_t>(j + 1)] = bits;
    }

  const std::array<std::ptrdiff_t, 3> pitch{1, row, plane};
  const Vec3<float> h = grid_->spacing().template cast<float>();
  const std::array<float, 3> face{h.y() * h.z(), h.z() * h.x(), h.x() * h.y()};
  PatchBlock* block = nullptr;
  std::size_t n = PatchBlock::kSize;
  std::int32_t last = kEnd;
  const auto add = [&](int i, int j, int k, std::size_t a) {
    const std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
    const Density* const v = origin + k * plane + j * row + i;
    const auto d = [](const Density* p, std::ptrdiff_t to, std::ptrdiff_t from) {
      return static_cast<float>(p[to]) - static_cast<float>(p[from]);
    };
    const float rise = d(v, pitch[a], 0);
    const float f = (isovalue - static_cast<float>(v[0])) / rise;
    const Density* const w = v + pitch[a];
    const float gb = 0.5F * lerp(d(v, pitch[b], -pitch[b]), d(w, pitch[b], -pitch[b]), f);
    const float gc = 0.5F * lerp(d(v, pitch[c], -pitch[c]), d(w, pitch[c], -pitch[c]), f);
    const float mb2 = (gb / rise) * (gb / rise), mc2 = (gc / rise) * (gc / rise);
    const float share = 1 / (1 + mb2 * mb2 * mb2 * mb2 + mc2 * mc2 * mc2 * mc2);
    if (!(share >= kLeastShare)) return;
    const auto ha = h[static_cast<int>(a)], hb = h[static_cast<int>(b)], hc = h[static_cast<int>(c)];
    const int parts_b = parts_[b], parts_c = parts_[c];
    const float slope_b = -gb / rise, slope_c = -gc / rise;
    const float part_b = hb / static_cast<float>(parts_b), part_c = hc / static_cast<float>(parts_c);
    // How far a part rises along the edge's axis [m].
    const float rise_b = slope_b * ha / static_cast<float>(parts_b), rise_c = slope_c * ha / static_cast<float>(parts_c);
    const float mb = slope_b * ha / hb, mc = slope_c * ha / hc;
    const float area = share * face[a] * std::sqrt(1 + mb * mb + mc * mc) / static_cast<float>(parts_b * parts_c);
    const float spread =
        kRoundedUp * (std::sqrt(part_b * part_b + rise_b * rise_b) + std::sqrt(part_c * part_c + rise_c * rise_c)) / 2;
    const auto edge = static_cast<std::uint32_t>(3 * (i + 1 + 9 * (j + 1) + 81 * (k + 1)) + static_cast<int>(a));
    std::array<float, 3> at_edge{static_cast<float>(i) * h.x(), static_cast<float>(j) * h.y(),
                                 static_cast<float>(k) * h.z()};
    at_edge[a] += f * ha;
    for (int q = 0; q < parts_b * parts_c; ++q) {
      if (n == PatchBlock::kSize) {
        while (free_block_ == kEnd) let_go(&slot);
        const std::int32_t next = free_block_;
        free_block_ = next_[at(next)];
        next_[at(next)] = kEnd;
        (last == kEnd ? slot.first : next_[at(last)]) = next;
        last = next;
        block = &blocks_[at(next)];
        n = 0;
      }
      // The part's place from the patch's middle, in parts.
      const float qb = static_cast<float>(q % parts_b) - 0.5F * static_cast<float>(parts_b - 1);
      const float qc = static_cast<float>(q / parts_b) - 0.5F * static_cast<float>(parts_c - 1);
      std::array<float, 3> p = at_edge;
      p[b] += qb * part_b;
      p[c] += qc * part_c;
      p[a] += qb * rise_b + qc * rise_c;
      block->x[n] = p[0];
      block->y[n] = p[1];
      block->z[n] = p[2];
      block->slope_b[n] = slope_b;
      block->slope_c[n] = slope_c;
      block->area[n] = area;
      block->spread[n] = spread;
      block->edge[n] = edge + PatchInBrick::kEdges * static_cast<std::uint32_t>(q);
      ++n;
      ++slot.count;
    }
  };
  for (int k = lo[2]; k < hi[2]; ++k)
    for (int j = lo[1]; j < hi[1]; ++j) {
      const auto z = static_cast<std::size_t>(k + 1), y = static_cast<std::size_t>(j + 1);
      const std::uint32_t here = bone[z][y];
      const std::uint32_t starts = ((1U << (hi[0] + 1)) - 1) & ~((1U << (lo[0] + 1)) - 1);
      const std::array<std::uint32_t, 3> crossed{(here ^ (here >> 1)) & starts, (here ^ bone[z][y + 1]) & starts,
                                                 (here ^ bone[z + 1][y]) & starts};
      for (std::size_t a = 0; a < 3; ++a)
        for (std::uint32_t bits = crossed[a]; bits != 0; bits &= bits - 1)
          add(std::countr_zero(bits) - 1, j, k, a);
    }
  for (; block && n % 16 != 0; ++n) block->x[n] = block->y[n] = block->z[n] = 0;  // whole lanes
}

/// The bone's surface as a renderer gets it: a copyable view. Haptic thread.
template <VoxelDensity D>
class BoneSurfaceView {
 public:
  using Scalar = double;
  using Density = D;
  explicit BoneSurfaceView(BoneSurface<Density>& surface) noexcept : surface_(&surface) {}
  [[nodiscard]] BoneSurface<Density>& surface() const noexcept { return *surface_; }
  [[nodiscard]] const VoxelGrid<Density>& grid() const noexcept { return surface_->grid(); }
  /// Longest spacing [m].
  [[nodiscard]] double voxel() const noexcept { return grid().spacing().maxCoeff(); }
  /// Whether all within `radius` [m] of p_G lies beyond the grid, and air is there.
  [[nodiscard]] bool is_beyond(const Vec3d& p_G, double radius) const noexcept {
    const Vec3d& h = grid().spacing();
    bool beyond = false;
    for (int a = 0; a < 3; ++a)
      beyond = beyond || p_G[a] + radius <= -h[a] ||
               p_G[a] - radius >= h[a] * grid().size()[static_cast<std::size_t>(a)];
    return beyond && static_cast<double>(grid().outside()) < surface_->isovalue();
  }

 private:
  BoneSurface<Density>* surface_;
};

/// The one surface that all scenes of a grid and an isovalue share, made by the first that asks. Throws as
/// BoneSurface's constructor. Any thread.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<BoneSurface<Density>> share_bone_surface(const VoxelGrid<Density>& grid,
                                                                       double isovalue) {
  static std::mutex mutex;
  static std::vector<std::weak_ptr<BoneSurface<Density>>> made;
  const std::scoped_lock lock(mutex);
  std::erase_if(made, [](const auto& w) { return w.expired(); });
  for (const auto& w : made)
    if (auto s = w.lock(); s && &s->grid() == &grid && s->isovalue() == isovalue) return s;
  auto s = std::make_shared<BoneSurface<Density>>(grid, isovalue);
  made.push_back(s);
  return s;
}

}  // namespace trephine
