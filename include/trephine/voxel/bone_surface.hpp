// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/crossed_edges.hpp>
#include <trephine/voxel/crossing_points.hpp>
#include <trephine/voxel/cut_turn.hpp>
#include <trephine/voxel/dual_element.hpp>
#include <trephine/voxel/element_size.hpp>
#include <trephine/voxel/sampling.hpp>
#include <trephine/voxel/surface_element.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <memory>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

template <VoxelDensity Density>
class BoneSurfaceView;

/// Quadrature points of the bone's isosurface, computed brick by brick (8³ voxels) where a tool comes near, and kept.
///
/// Each voxel edge whose ends lie on different sides of the isovalue carries an element (`DualElements`). A use has a
/// level (`ElementSize`): at level 0 elements of long voxels are cut into parts, at others there are points at the
/// crossings instead, joined by cells (`CrossingPoints`).
///
/// A request computes a brick, and computes it anew where the grid's version of the brick changed; where cuts take
/// turns, in the brick's turn alone (`begin_turn`), unless densities rose. Bricks that were
/// requested longest ago are evicted when the store is full. Memory: 0.8 kB a block of 16 elements, four to twelve
/// blocks a brick of bone's surface, at most `blocks` of them; and 4.25 bytes a brick of the grid. No allocation after
/// construction.
///
/// Threads: construction on any thread, all else on the haptic thread. The grid must outlive the surface, in place.
template <VoxelDensity Density>
class BoneSurface {
 public:
  using Grid = VoxelGrid<Density>;
  static constexpr int kBrick = Grid::kBrick;
  static constexpr std::size_t kDefaultBlocks = 16384;  ///< 13 MB
  static constexpr int kBox = 4;                        ///< bricks along the edge of a box (`for_each_brick_of_bone`)
  /// Bricks that one tick may compute (`begin_tick`), so that its work is bounded, unless a renderer asks for more.
  static constexpr int kBricksPerTick = 128;

  /// Throws std::invalid_argument for an isovalue that is not finite.
  BoneSurface(const Grid& grid, double isovalue, std::size_t blocks = kDefaultBlocks)
      : grid_(&grid),
        isovalue_(isovalue),
        slot_of_(grid.brick_count(), kNone),
        boxes_(box_count(grid)),
        slots_(blocks),
        blocks_(blocks),
        next_(blocks) {
    for (std::size_t level = 0; level < sizes_.size(); ++level)
      sizes_[level] = ElementSize::at_level(grid.spacing(), static_cast<int>(level));
    if (!is_finite(isovalue)) refuse("BoneSurface", "isovalue must be finite", isovalue);
    if (blocks < kMinBlocks) refuse("BoneSurface", "blocks must be at least 8749", blocks);
    for (std::size_t i = 0; i < blocks; ++i) {
      next_[i] = i + 1 < blocks ? static_cast<std::int32_t>(i + 1) : kEnd;
      slots_[i].next_free = next_[i];
    }
  }
  BoneSurface(const BoneSurface&) = delete;
  BoneSurface& operator=(const BoneSurface&) = delete;

  [[nodiscard]] const Grid& grid() const noexcept { return *grid_; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  [[nodiscard]] std::size_t bytes() const noexcept {
    return blocks_.size() * (sizeof(ElementBlock) + sizeof(std::int32_t)) + slots_.size() * sizeof(Slot) +
           slot_of_.size() * sizeof(std::int32_t) + boxes_.size() * sizeof(Box);
  }

  /// Returns the view that renderers get.
  [[nodiscard]] BoneSurfaceView<Density> view() noexcept { return BoneSurfaceView<Density>(*this); }

  /// Starts a tick, which may compute so many bricks.
  void begin_tick(int bricks = kBricksPerTick) noexcept {
    budget_ = bricks;
    ++tick_;
  }
  /// Number of the tick, in which no brick is computed twice unless it is cut again.
  [[nodiscard]] std::uint64_t tick() const noexcept { return tick_; }
  /// Bricks of other turns keep their elements, for a round of ticks at most. A cut changes the bricks of its
  /// turn and the neighbours' halos, and each would else be computed several times a round.
  void begin_turn(const CutTurn& turn) noexcept { turn_ = turn; }
  /// Starts a use at a level of `ElementSize`: bricks requested from now on are evicted after those requested before.
  void begin_use(int level = 0) noexcept {
    ++use_;
    level_ = level;
  }

  /// Returns whether the brick's range of densities holds the isovalue.
  [[nodiscard]] bool crosses(std::size_t brick) const noexcept {
    const auto range = grid_->brick_range(brick);
    return static_cast<double>(range.min) < isovalue_ && static_cast<double>(range.max) >= isovalue_;
  }

  /// Returns whether the brick or its halo holds bone.
  [[nodiscard]] bool has_bone(std::size_t brick) const noexcept {
    return static_cast<double>(grid_->brick_range(brick).max) >= isovalue_;
  }

  /// Calls visit(at) for the bricks of a box that have bone, or had bone since densities last rose. A box has kBox³
  /// bricks; `box` counts boxes from the grid's corner, `at` bricks.
  template <class Visit>
  void for_each_brick_of_bone(const std::array<int, 3>& box, Visit&& visit) noexcept {
    for (std::uint64_t bits = bone_in(box); bits != 0; bits &= bits - 1) visit(brick_of(box, std::countr_zero(bits)));
  }

  /// Brings the brick's elements up to date. Returns false where this tick may compute no more bricks. The elements
  /// stay valid until the next call.
  [[nodiscard]] bool provide(std::size_t brick) noexcept {
    std::int32_t s = slot_at_level(brick);
    const std::uint32_t version = grid_->brick_version(brick);
    const std::uint64_t stamp = grid_->increase_stamp();
    if (s != kNone && slots_[at(s)].stamp == stamp) {
      Slot& slot = slots_[at(s)];
      const bool is_current = slot.version == version;
      if (is_current) slot.current = tick_;
      if (is_current || (!has_turn(brick) && may_wait(slot))) {
        slot.used = use_;
        return true;
      }
    }
    if (budget_ == 0) return false;
    --budget_;
    if (s == kNone) s = make_slot(brick);
    compute(slots_[at(s)], brick);
    slots_[at(s)].used = use_;
    slots_[at(s)].current = tick_;
    slots_[at(s)].version = version;
    slots_[at(s)].stamp = stamp;
    return true;
  }

  /// Returns the version of a brick that `provide` found.
  [[nodiscard]] std::uint32_t provided_version(std::size_t brick) const noexcept {
    return slots_[at(slot_at_level(brick))].version;
  }
  /// Takes what may wait in another surface, of a grid with the same densities: then both provide the same elements.
  void take_waiting(const BoneSurface& other) noexcept {
    turn_ = other.turn_;
    if (turn_.turns == 1) return;
    for (const Slot& from : other.slots_) {
      if (from.brick < 0 || !other.may_wait(from) || from.stamp != other.grid_->increase_stamp()) continue;
      const auto brick = static_cast<std::size_t>(from.brick);
      level_ = from.level;
      const std::int32_t s = slot_at_level(brick);
      Slot& slot = slots_[at(s == kNone ? make_slot(brick) : s)];
      ++changes_;
      release_blocks(slot);
      std::int32_t last = kEnd;
      for (std::int32_t b = from.first; b != kEnd; b = other.next_[at(b)]) {
        last = append_block(slot, last);
        blocks_[at(last)] = other.blocks_[at(b)];
      }
      slot.count = from.count;
      slot.used = use_;
      slot.current = tick_ - (other.tick_ - from.current);
      slot.stamp = grid_->increase_stamp();
      const bool waits = from.version != other.grid_->brick_version(brick);
      slot.version = grid_->brick_version(brick) - (waits ? 1 : 0);
    }
  }

  /// Counts computed bricks. While it stays the same, visited blocks stay valid.
  [[nodiscard]] std::uint64_t changes() const noexcept { return changes_; }
  /// Counts evicted bricks that were requested since `begin_use`. More than 0: the store is too small.
  [[nodiscard]] std::uint64_t overruns() const noexcept { return overruns_; }
  [[nodiscard]] std::size_t block_count() const noexcept { return blocks_.size(); }

  /// Calls visit(block, count) for the blocks of a brick that `provide` brought up to date.
  template <class Visit>
  void for_each_block(std::size_t brick, Visit&& visit) const noexcept {
    const Slot& slot = slots_[at(slot_at_level(brick))];
    int left = slot.count;
    for (std::int32_t b = slot.first; b != kEnd; b = next_[at(b)], left -= ElementBlock::kSize)
      visit(blocks_[at(b)], std::min(left, ElementBlock::kSize));
  }

  /// Returns the position of a brick's voxel 0 in G [m].
  [[nodiscard]] Vec3d corner(std::size_t brick) const noexcept {
    const auto [bx, by, bz] = grid_->brick_coordinates(brick);
    return grid_->spacing().cwiseProduct(Vec3d(bx * kBrick, by * kBrick, bz * kBrick));
  }

  /// Returns whether the interpolated density at p_G reaches the isovalue.
  [[nodiscard]] bool is_bone(const Vec3d& p_G) const noexcept {
    const Vec3d u = p_G.cwiseQuotient(grid_->spacing()) + Vec3d::Ones();
    return sample(SampleView<Density, double>(*grid_), u) >= isovalue_;
  }

 private:
  static constexpr std::int32_t kNone = -1, kEnd = -2;
  /// Blocks of a brick that is crossed at every edge, each element cut into the most parts.
  static constexpr std::size_t kMinBlocks = ElementBlock::kEdges * ElementSize::kMaxParts * ElementSize::kMaxParts /
                                                static_cast<std::size_t>(ElementBlock::kSize) +
                                            1;
  /// Margin for rounding of the bounding balls.
  static constexpr float kRoundedUp = 1.001F;

  /// A stored brick at a level: a linked list of blocks.
  struct Slot {
    std::int64_t brick = -1;
    int level = 0;
    std::int32_t next_level = kNone;  // slot of the same brick at another level
    std::uint64_t used = 0;
    std::uint64_t current = 0;  // last tick in which it was asked for and up to date
    std::uint64_t stamp = 0;
    std::uint32_t version = 0;
    int count = 0;
    std::int32_t first = kEnd;
    std::int32_t next_free = kEnd;
  };

  /// Bricks with bone of a box, a bit each, found when first asked for since densities rose.
  struct Box {
    std::uint64_t stamp = 0;  // of the grid; no grid has stamp 0
    std::uint64_t bone = 0;
  };
  [[nodiscard]] static constexpr int boxes_along(int bricks) noexcept { return (bricks + kBox - 1) / kBox; }
  [[nodiscard]] static std::size_t box_count(const Grid& grid) noexcept {
    std::size_t count = 1;
    for (const int bricks : grid.bricks()) count *= static_cast<std::size_t>(boxes_along(bricks));
    return count;
  }

  [[nodiscard]] static std::array<int, 3> brick_of(const std::array<int, 3>& box, int bit) noexcept {
    return {kBox * box[0] + bit % kBox, kBox * box[1] + bit / kBox % kBox, kBox * box[2] + bit / (kBox * kBox)};
  }
  [[nodiscard]] std::uint64_t bone_in(const std::array<int, 3>& at) noexcept {
    const auto& bricks = grid_->bricks();
    const int row = boxes_along(bricks[0]), plane = row * boxes_along(bricks[1]);
    Box& box = boxes_[static_cast<std::size_t>(at[0] + row * at[1] + plane * at[2])];
    if (box.stamp == grid_->increase_stamp()) return box.bone;
    box = {grid_->increase_stamp(), 0};
    for (int bit = 0; bit < kBox * kBox * kBox; ++bit) {
      const auto [x, y, z] = brick_of(at, bit);
      const bool inside = x < bricks[0] && y < bricks[1] && z < bricks[2];
      if (inside && has_bone(grid_->brick_index(x, y, z))) box.bone |= std::uint64_t{1} << bit;
    }
    return box.bone;
  }

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
  /// The brick's slot at the use's level, or kNone.
  [[nodiscard]] std::int32_t slot_at_level(std::size_t brick) const noexcept {
    std::int32_t s = slot_of_[brick];
    while (s != kNone && slots_[at(s)].level != level_) s = slots_[at(s)].next_level;
    return s;
  }
  [[nodiscard]] bool has_turn(std::size_t brick) const noexcept {
    if (turn_.turns == 1) return true;
    const auto [x, y, z] = grid_->brick_coordinates(brick);
    return turn_.has(x * kBrick, y * kBrick, z * kBrick);
  }
  [[nodiscard]] bool may_wait(const Slot& slot) const noexcept {
    return tick_ - slot.current <= static_cast<std::uint64_t>(turn_.turns);
  }
  [[nodiscard]] std::int32_t make_slot(std::size_t brick) noexcept {
    if (free_slot_ == kEnd) evict(nullptr);
    const std::int32_t s = free_slot_;
    free_slot_ = slots_[at(s)].next_free;
    slots_[at(s)] = {};
    slots_[at(s)].brick = static_cast<std::int64_t>(brick);
    slots_[at(s)].level = level_;
    slots_[at(s)].next_level = slot_of_[brick];
    slot_of_[brick] = s;
    return s;
  }
  void release(std::int32_t s) noexcept {
    Slot& slot = slots_[at(s)];
    release_blocks(slot);
    std::int32_t* link = &slot_of_[static_cast<std::size_t>(slot.brick)];
    while (*link != s) link = &slots_[at(*link)].next_level;
    *link = slot.next_level;
    slot.brick = -1;
    slot.next_free = free_slot_;
    free_slot_ = s;
  }

  /// Evicts a brick other than `keep` by the clock rule, preferring bricks of earlier uses.
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

  /// Takes a free block and links it after `last`, or as the slot's first.
  [[nodiscard]] std::int32_t append_block(Slot& slot, std::int32_t last) noexcept {
    while (free_block_ == kEnd) evict(&slot);
    const std::int32_t block = free_block_;
    free_block_ = next_[at(block)];
    next_[at(block)] = kEnd;
    (last == kEnd ? slot.first : next_[at(last)]) = block;
    return block;
  }

  /// Where a brick's next elements go: the last of its blocks, and its elements so far.
  struct Writer {
    ElementBlock* block = nullptr;
    std::int32_t last = kEnd;
    std::size_t count = ElementBlock::kSize;
  };
  /// Makes room for another element of the brick; returns its place in the writer's block.
  [[nodiscard]] std::size_t append(Slot& slot, Writer& writer) noexcept {
    if (writer.count == ElementBlock::kSize) {
      if (writer.block) writer.block->finish(ElementBlock::kSize);
      writer.last = append_block(slot, writer.last);
      writer.block = &blocks_[at(writer.last)];
      writer.count = 0;
    }
    ++slot.count;
    return writer.count++;
  }

  void compute(Slot& slot, std::size_t brick) noexcept;
  void add_elements(Slot& slot, Writer& writer, std::size_t brick) noexcept;
  void add_points(Slot& slot, Writer& writer, std::size_t brick) noexcept;

  const Grid* grid_;
  double isovalue_;
  std::vector<std::int32_t> slot_of_;  // slot of each brick of the grid, or kNone
  std::vector<Box> boxes_;
  std::vector<Slot> slots_;
  std::vector<ElementBlock> blocks_;
  std::vector<std::int32_t> next_;  // successor of each block, in its brick's list or in the free list
  std::int32_t free_block_ = 0;
  std::int32_t free_slot_ = 0;
  std::size_t hand_ = 0;  // the clock rule's
  std::uint64_t use_ = 2, tick_ = 0;
  std::uint64_t changes_ = 0;
  std::uint64_t overruns_ = 0;
  int budget_ = kBricksPerTick;
  int level_ = 0;  // of the use
  CutTurn turn_;
  std::array<ElementSize, ElementSize::kMaxLevel + 1> sizes_;
};

/// Computes the brick's elements or points from the densities of the brick and its halo.
template <VoxelDensity Density>
void BoneSurface<Density>::compute(Slot& slot, std::size_t brick) noexcept {
  ++changes_;
  release_blocks(slot);
  Writer writer;
  if (slot.level == 0)
    add_elements(slot, writer, brick);
  else
    add_points(slot, writer, brick);
  if (writer.block) writer.block->finish(static_cast<int>(writer.count));
}

/// Adds an element for each crossed edge that is the brick's own, in parts.
template <VoxelDensity Density>
void BoneSurface<Density>::add_elements(Slot& slot, Writer& writer, std::size_t brick) noexcept {
  const CrossedEdges<Density> edges(*grid_, brick, isovalue_);
  const DualElements elements{grid_->spacing().template cast<float>()};
  CrossingLanes around;
  DualElementLanes whole;
  for (std::size_t i = 0; i < edges.crossings().size(); ++i) {
    const std::size_t l = i % CrossingLanes::kLanes;
    if (l == 0) {
      edges.surround(i, around);
      elements.compute(around, edges.isovalue(), whole);
    }
    if (!(whole.area[l] > 0)) continue;
    const auto& crossing = edges.crossings()[i];
    constexpr std::array<std::size_t, 3> kNext{1, 2, 0};
    const std::size_t a = crossing.axis, b = kNext[a], c = kNext[b];
    const std::array<std::size_t, 3> axes{a, b, c};
    const int parts_b = sizes_[0].parts[b], parts_c = sizes_[0].parts[c];
    const float per_b = 1 / static_cast<float>(parts_b), per_c = 1 / static_cast<float>(parts_c);
    const float spread = kRoundedUp * (whole.along_length[l] * per_b + whole.across_length[l] * per_c);
    std::uint32_t edge = crossing.edge;
    for (int ic = 1 - parts_c; ic < parts_c; ic += 2)
      for (int ib = 1 - parts_b; ib < parts_b; ib += 2) {
        const std::size_t n = append(slot, writer);
        ElementBlock& block = *writer.block;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const std::size_t g = axes[axis];
          const float along = whole.along[axis][l] * per_b, across = whole.across[axis][l] * per_c;
          block.position[g][n] =
              whole.middle[axis][l] + static_cast<float>(ib) * along + static_cast<float>(ic) * across;
          block.along[g][n] = along;
          block.across[g][n] = across;
        }
        block.area[n] = whole.area[l] * per_b * per_c;
        block.spread[n] = spread;
        block.edge[n] = edge;
        edge += ElementBlock::kEdges;
      }
  }
}

/// Adds the points at the brick's own crossed edges, joined by cells: elements without sides.
template <VoxelDensity Density>
void BoneSurface<Density>::add_points(Slot& slot, Writer& writer, std::size_t brick) noexcept {
  using Points = CrossingPoints<Density>;
  const Points points(*grid_, brick, isovalue_, sizes_[static_cast<std::size_t>(slot.level)].joins);
  points.for_each([&](const typename Points::Point& point) {
    const std::size_t n = append(slot, writer);
    ElementBlock& block = *writer.block;
    for (std::size_t g = 0; g < 3; ++g) {
      block.position[g][n] = point.position[g];
      block.along[g][n] = block.across[g][n] = 0;
    }
    block.area[n] = point.weight;
    block.spread[n] = 0;
    block.edge[n] = point.number;
  });
}

/// A copyable view of a bone's surface, as renderers get it. Haptic thread.
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
  /// Returns whether a ball of `radius` [m] about p_G lies beyond the grid, where `outside` is air.
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

/// Returns the surface of a grid and an isovalue that all scenes constructed on this thread share, and constructs it at
/// the first call. Throws as BoneSurface's constructor. Any thread.
template <VoxelDensity Density>
[[nodiscard]] std::shared_ptr<BoneSurface<Density>> shared_bone_surface(const VoxelGrid<Density>& grid,
                                                                        double isovalue) {
  thread_local std::vector<std::weak_ptr<BoneSurface<Density>>> made;
  std::erase_if(made, [](const auto& surface) { return surface.expired(); });
  for (const auto& surface : made)
    if (auto s = surface.lock(); s && &s->grid() == &grid && s->isovalue() == isovalue) return s;
  auto s = std::make_shared<BoneSurface<Density>>(grid, isovalue);
  made.push_back(s);
  return s;
}

}  // namespace trephine
