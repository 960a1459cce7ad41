// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/crossed_edges.hpp>
#include <trephine/voxel/sampling.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

namespace trephine {

template <VoxelDensity Density>
class BoneSurfaceView;

/// A small piece of the isosurface: a parallelogram about `position` with the half sides `along` and `across`, which
/// stands for `area` [m²]: its own, more at edges of bone. G axes, metres.
struct SurfaceElement {
  Vec3d position;
  Vec3d along;
  Vec3d across;
  double area;
};

/// Elements of a brick in arrays of this many, single precision, positions relative to the brick's voxel 0 [m].
struct ElementBlock {
  static constexpr int kSize = 16;
  /// `edge` is its voxel edge's number plus this times the number of the element's part.
  static constexpr std::uint32_t kEdges = 3 * 9 * 9 * 9;
  using Lanes = std::array<float, kSize>;
  std::array<Lanes, 3> position, along, across;
  Lanes area;
  Lanes spread;                           ///< no point of the element is farther from its position [m]
  std::array<std::uint32_t, kSize> edge;  ///< 3 (x + 9 y + 81 z) + axis of its voxel edge, 0 for voxel −1
  Vec3<float> middle;                     ///< of a ball that holds the elements, from the brick's voxel 0 [m]
  float radius;                           ///< of that ball [m]

  /// Element i in G; `corner` is where the brick's voxel 0 lies.
  [[nodiscard]] SurfaceElement element(std::size_t i, const Vec3d& corner) const noexcept {
    const auto vector = [&](const std::array<Lanes, 3>& v) {
      return Vec3d(static_cast<double>(v[0][i]), static_cast<double>(v[1][i]), static_cast<double>(v[2][i]));
    };
    return {corner + vector(position), vector(along), vector(across), static_cast<double>(area[i])};
  }

  /// Finds the ball about the first `count` elements, and fills the other lanes.
  void finish(int count) noexcept {
    const auto n = static_cast<std::size_t>(count);
    Vec3<float> low, high;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto [least, most] = std::minmax_element(position[axis].begin(), position[axis].begin() + count);
      low[static_cast<Eigen::Index>(axis)] = *least;
      high[static_cast<Eigen::Index>(axis)] = *most;
    }
    middle = 0.5F * (low + high);
    radius = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3<float> p(position[0][i], position[1][i], position[2][i]);
      radius = std::max(radius, (p - middle).norm() + spread[i]);
    }
    for (std::size_t i = n; i < kSize; ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) position[axis][i] = position[axis][0];
      spread[i] = spread[0];
    }
  }
};

/// The bone's isosurface as quadrature points, kept brick by brick (8³ voxels) where a tool comes near.
///
/// A voxel edge whose ends lie on different sides of the isovalue carries a element: the parallelogram of the same
/// middle and area as the quadrilateral of the four cells around it (dual contouring's: Ju et al. 2002), whose corners
/// are the means of the cells' crossings (surface nets', Gibson 1998). So elements tile the surface whichever way it
/// lies, and follow from the trilinear interpolant's crossings alone. Where voxels are longer along an axis, elements
/// are cut into parts along it, at most kMostParts.
///
/// *Curved bone*: means of crossings are chords. With S = κ L² + κ' L'², L and L' the ways to the next crossings, the
/// quadrilateral lies S/4 below the edge's own crossing, the means of the crossings on faces S/8, and a element's
/// points on the surface S/32. Crossings themselves lie up to κ L²/8 below a curved surface, as densities are
/// interpolated along edges. So a element moves out by twice the way from its quadrilateral to the faces' mean.
///
/// *Edges of bone*: where bone is convex like a ball of less than kRound voxels, a element moves less, becomes as wide
/// as the faces' means, and ends as the parallelogram through them. Their chords cut an edge off, so that no point
/// stands out beside it: a tool fits into the rim of the hole that it cut.
///
/// Bricks are made when they are asked for, made anew when the grid's version of them changed, and let go, those that
/// were not used longest, when the store is full. Memory: 0.8 kB a block of 16 elements, four to twelve blocks a
/// brick of bone's surface, `blocks` of them at most; and 4 bytes a brick of the grid. No allocation after
/// construction.
///
/// Threads: construction anywhere, all else on the haptic thread. The grid must outlive it and stay where it is.
template <VoxelDensity Density>
class BoneSurface {
 public:
  using Grid = VoxelGrid<Density>;
  static constexpr int kBrick = Grid::kBrick;
  static constexpr std::size_t kDefaultBlocks = 16384;  ///< 13 MB
  static constexpr int kMostParts = 8;                  ///< of a element along an axis
  /// Bricks that one tick may make (`begin_tick`): its work is bounded.
  static constexpr int kBricksPerTick = 128;

  /// Throws std::invalid_argument for an isovalue that is not finite.
  BoneSurface(const Grid& grid, double isovalue, std::size_t blocks = kDefaultBlocks)
      : grid_(&grid),
        isovalue_(isovalue),
        slot_of_(grid.brick_count(), kNone),
        slots_(blocks),
        blocks_(blocks),
        next_(blocks) {
    for (int a = 0; a < 3; ++a) {
      const double longer = grid.spacing()[a] / grid.spacing().minCoeff();
      parts_[static_cast<std::size_t>(a)] = std::clamp(static_cast<int>(std::lround(longer)), 1, kMostParts);
    }
    if (!std::isfinite(isovalue)) refuse("BoneSurface", "isovalue must be finite", isovalue);
    if (blocks < kLeastBlocks) refuse("BoneSurface", "blocks must be at least 8749", blocks);
    for (std::size_t i = 0; i < blocks; ++i) {
      next_[i] = i + 1 < blocks ? static_cast<std::int32_t>(i + 1) : kEnd;
      slots_[i].next_free = next_[i];
    }
  }
  BoneSurface(const BoneSurface&) = delete;
  BoneSurface& operator=(const BoneSurface&) = delete;

  [[nodiscard]] const Grid& grid() const noexcept { return *grid_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  /// Longest spacing over the parts that elements are cut into along it [m].
  [[nodiscard]] double longest_part() const noexcept {
    double longest = 0;
    for (std::size_t a = 0; a < 3; ++a)
      longest = std::max(longest, grid_->spacing()[static_cast<Eigen::Index>(a)] / parts_[a]);
    return longest;
  }
  [[nodiscard]] std::size_t bytes() const noexcept {
    return blocks_.size() * (sizeof(ElementBlock) + sizeof(std::int32_t)) + slots_.size() * sizeof(Slot) +
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

  /// Makes the brick's elements or finds them up to date; false where this tick may make no more. They stay until the
  /// next call.
  [[nodiscard]] bool provide(std::size_t brick) noexcept {
    std::int32_t s = slot_of_[brick];
    const std::uint32_t version = grid_->brick_version(brick);
    const std::uint64_t stamp = grid_->increase_stamp();
    if (s != kNone && slots_[at(s)].version == version && slots_[at(s)].stamp == stamp) {
      slots_[at(s)].used = use_;
      return true;
    }
    if (budget_ == 0) return false;
    --budget_;
    if (s == kNone) {
      if (free_slot_ == kEnd) evict(nullptr);
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

  /// Grows whenever blocks were made or let go: while it stays, so do the blocks that were visited.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }
  /// Bricks that were let go although they were asked for since `begin_use`: the store is too small.
  [[nodiscard]] std::uint64_t overruns() const noexcept { return overruns_; }
  [[nodiscard]] std::size_t block_count() const noexcept { return blocks_.size(); }

  /// Calls visit(block, count) for the blocks of a brick that `provide` provided.
  template <class Visit>
  void for_each_block(std::size_t brick, Visit&& visit) const noexcept {
    const Slot& slot = slots_[at(slot_of_[brick])];
    int left = slot.count;
    for (std::int32_t b = slot.first; b != kEnd; b = next_[at(b)], left -= ElementBlock::kSize)
      visit(blocks_[at(b)], std::min(left, ElementBlock::kSize));
  }

  /// Where a brick's voxel 0 lies in G [m].
  [[nodiscard]] Vec3d corner(std::size_t brick) const noexcept {
    const auto [bx, by, bz] = grid_->brick_coordinates(brick);
    return grid_->spacing().cwiseProduct(Vec3d(bx * kBrick, by * kBrick, bz * kBrick));
  }

  /// Whether p_G is bone: its interpolated density reaches the isovalue.
  [[nodiscard]] bool is_bone(const Vec3d& p_G) const noexcept {
    const Vec3d u = p_G.cwiseQuotient(grid_->spacing()) + Vec3d::Ones();
    return sample(SampleView<Density, double>(*grid_), u) >= isovalue_;
  }

 private:
  static constexpr std::int32_t kNone = -1, kEnd = -2;
  /// What a brick can take, every edge of it crossed and every element in all its parts.
  static constexpr std::size_t kLeastBlocks =
      ElementBlock::kEdges * kMostParts * kMostParts / static_cast<std::size_t>(ElementBlock::kSize) + 1;
  /// Smaller elements are left out [faces of a voxel]: of the worst direction's area, a ten-thousandth.
  static constexpr float kLeastArea = 1e-4F;
  static constexpr float kRoundedUp = 1.001F;
  /// Bone more convex than a ball of half this radius is an edge, more and more so from a ball of this radius on
  /// [shortest spacings].
  static constexpr float kRound = 12;

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
  void evict(const Slot* keep) noexcept {
    for (std::size_t tried = 0; tried <= 2 * slots_.size(); ++tried) {
      hand_ = hand_ + 1 < slots_.size() ? hand_ + 1 : 0;
      const Slot& slot = slots_[hand_];
      if (slot.brick < 0 || &slot == keep || (slot.used >= use_ && tried < slots_.size())) continue;
      overruns_ += slot.used >= use_ ? 1 : 0;
      release(static_cast<std::int32_t>(hand_));
      return;
    }
  }

  /// A element before it is parted, from the brick's voxel 0 [m]. `area` 0: too small to count.
  struct Parallelogram {
    Vec3<float> middle, along, across;
    float area;
  };
  [[nodiscard]] Parallelogram parallelogram(const CrossedEdges<Density>& edges,
                                            const typename CrossedEdges<Density>::Crossing& crossing) const noexcept;
  void make(Slot& slot, std::size_t brick) noexcept;

  const Grid* grid_;
  double isovalue_;
  std::vector<std::int32_t> slot_of_;  // of each brick of the grid
  std::vector<Slot> slots_;
  std::vector<ElementBlock> blocks_;
  std::vector<std::int32_t> next_;  // block after a block, in a brick or among the free ones
  std::int32_t free_block_ = 0;
  std::int32_t free_slot_ = 0;
  std::size_t hand_ = 0;
  std::uint64_t use_ = 2;
  std::uint64_t changes_ = 0;
  std::uint64_t overruns_ = 0;
  int budget_ = kBricksPerTick;
  std::array<int, 3> parts_{};
};

/// The parallelogram of a crossed edge.
template <VoxelDensity Density>
auto BoneSurface<Density>::parallelogram(const CrossedEdges<Density>& edges,
                                         const typename CrossedEdges<Density>::Crossing& crossing) const noexcept
    -> Parallelogram {
  const std::size_t a = crossing.axis, b = (a + 1) % 3, c = (a + 2) % 3;
  const Vec3<float> h = grid_->spacing().template cast<float>();
  const auto length = [&](std::size_t axis) { return h[static_cast<Eigen::Index>(axis)]; };
  const auto metres = [&](const Vec3<float>& u) -> Vec3<float> { return u.cwiseProduct(h); };
  const Vec3<float> p00 = metres(edges.cell_mean(crossing, -1, -1)), p10 = metres(edges.cell_mean(crossing, 0, -1)),
                    p01 = metres(edges.cell_mean(crossing, -1, 0)), p11 = metres(edges.cell_mean(crossing, 0, 0));
  Parallelogram p{0.25F * (p00 + p10 + p01 + p11), 0.25F * (p10 + p11 - p00 - p01), 0.25F * (p01 + p11 - p00 - p10), 0};
  const Vec3<float> normal = p.along.cross(p.across);
  const float size = normal.norm();
  if (!(4 * size > kLeastArea * length(b) * length(c))) return p;
  p.area = 4 * size;

  // Outward: away from the edge's end in bone.
  const bool up = (normal[static_cast<Eigen::Index>(a)] > 0) == crossing.starts_in_bone;
  const Vec3<float> out = (up ? 1 / size : -1 / size) * normal;
  const Vec3<float> b0 = metres(edges.beside(crossing, b, -1)), b1 = metres(edges.beside(crossing, b, 1)),
                    c0 = metres(edges.beside(crossing, c, -1)), c1 = metres(edges.beside(crossing, c, 1));
  // Halfway to them the surface crosses the cells' faces.
  const Vec3<float> on_faces = 0.5F * metres(crossing.position()) + 0.125F * (b0 + b1 + c0 + c1);
  const float rise = (on_faces - p.middle).dot(out);
  const float round = (length(b) * length(b) + length(c) * length(c)) / (8 * kRound * h.minCoeff());
  p.middle += (rise + std::min(rise, std::max(0.0F, 2 * round - rise))) * out;
  const float sharp = std::clamp(rise / round - 1, 0.0F, 1.0F);
  if (sharp > 0) {
    p.middle += sharp * (on_faces - p.middle);
    p.along += sharp * (0.25F * (b1 - b0) - p.along);
    p.across += sharp * (0.25F * (c1 - c0) - p.across);
  }
  return p;
}

/// Makes a element of each crossed edge that is the brick's own. Nothing beyond the brick and its halo is read.
template <VoxelDensity Density>
void BoneSurface<Density>::make(Slot& slot, std::size_t brick) noexcept {
  ++changes_;
  release_blocks(slot);
  const CrossedEdges<Density> edges(*grid_, brick, isovalue_);
  ElementBlock* block = nullptr;
  std::size_t n = ElementBlock::kSize;
  std::int32_t last = kEnd;
  for (const auto& crossing : edges.crossings()) {
    const std::size_t a = crossing.axis, b = (a + 1) % 3, c = (a + 2) % 3;
    const Parallelogram whole = parallelogram(edges, crossing);
    if (!(whole.area > 0)) continue;

    const int parts_b = parts_[b], parts_c = parts_[c];
    const Vec3<float> part_along = whole.along / static_cast<float>(parts_b),
                      part_across = whole.across / static_cast<float>(parts_c);
    const float spread = kRoundedUp * (part_along.norm() + part_across.norm());
    for (int part = 0; part < parts_b * parts_c; ++part) {
      if (n == ElementBlock::kSize) {
        while (free_block_ == kEnd) evict(&slot);
        const std::int32_t next = free_block_;
        free_block_ = next_[at(next)];
        next_[at(next)] = kEnd;
        (last == kEnd ? slot.first : next_[at(last)]) = next;
        if (block) block->finish(ElementBlock::kSize);
        last = next;
        block = &blocks_[at(next)];
        n = 0;
      }
      const auto ib = static_cast<float>(2 * (part % parts_b) + 1 - parts_b);
      const auto ic = static_cast<float>(2 * (part / parts_b) + 1 - parts_c);
      const Vec3<float> position = whole.middle + ib * part_along + ic * part_across;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto e = static_cast<Eigen::Index>(axis);
        block->position[axis][n] = position[e];
        block->along[axis][n] = part_along[e];
        block->across[axis][n] = part_across[e];
      }
      block->area[n] = whole.area / static_cast<float>(parts_b * parts_c);
      block->spread[n] = spread;
      block->edge[n] = crossing.edge + ElementBlock::kEdges * static_cast<std::uint32_t>(part);
      ++n;
      ++slot.count;
    }
  }
  if (block) block->finish(static_cast<int>(n));
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
      beyond =
          beyond || p_G[a] + radius <= -h[a] || p_G[a] - radius >= h[a] * grid().size()[static_cast<std::size_t>(a)];
    return beyond && static_cast<double>(grid().outside()) < surface_->isovalue();
  }

 private:
  BoneSurface<Density>* surface_;
};

/// The one surface that all scenes of a grid and an isovalue share that are made on one thread: the first that asks
/// makes it. Throws as BoneSurface's constructor. Any thread.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<BoneSurface<Density>> shared_bone_surface(const VoxelGrid<Density>& grid,
                                                                        double isovalue) {
  struct Made {
    std::weak_ptr<BoneSurface<Density>> surface;
    std::thread::id thread;
  };
  static std::mutex mutex;
  static std::vector<Made> all;
  const std::scoped_lock lock(mutex);
  std::erase_if(all, [](const Made& m) { return m.surface.expired(); });
  const std::thread::id here = std::this_thread::get_id();
  for (const Made& m : all)
    if (auto s = m.surface.lock(); s && &s->grid() == &grid && s->isovalue() == isovalue && m.thread == here) return s;
  auto s = std::make_shared<BoneSurface<Density>>(grid, isovalue);
  all.push_back({s, here});
  return s;
}

}  // namespace trephine
