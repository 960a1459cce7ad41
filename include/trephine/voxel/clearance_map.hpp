// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <atomic>
#include <cmath>

namespace trephine {

/// How far bone is from anywhere, coarsely: for each brick of 8³ voxels, how many bricks away the nearest is that holds
/// any. A point's clearance is one lookup, so that a tick can pass over what cannot touch. Three bytes a brick: 0.6 %
/// of an 8-bit grid.
///
/// Always conservative. Removing bone leaves an old map too cautious and no more; after `restore` no point is said to
/// be clear until a map is made of what came back.
///
/// Threads: construction before the loop starts; `refresh` on one other thread, as often as it likes; `begin_tick`,
/// once a tick, and `clearance` on the haptic thread. Neither waits for the other, and no map changes while it is in
/// use. The grid must outlive the map.
template <VoxelDensity Density>
class ClearanceMap {
 public:
  static constexpr int kBrick = VoxelGrid<Density>::kBrick;

  /// Throws std::invalid_argument for an isovalue that is not finite.
  ClearanceMap(const VoxelGrid<Density>& grid, double isovalue)
      : grid_(&grid),
        reader_(grid, false),
        isovalue_(isovalue),
        bricks_(grid.bricks()),
        last_(grid.size()[0], grid.size()[1], grid.size()[2]),
        spacing_(grid.spacing()),
        per_metre_(grid.spacing().cwiseInverse()),
        brick_(kBrick * grid.spacing().minCoeff()),
        air_outside_(static_cast<double>(grid.outside()) < isovalue),
        stamp_(grid.increase_stamp()) {
    if (!std::isfinite(isovalue)) refuse("ClearanceMap", "isovalue must be finite", isovalue);
    for (Map& m : maps_) m.distance.resize(grid.brick_count());
    refresh();
    begin_tick();
  }
  ClearanceMap(const ClearanceMap&) = delete;
  ClearanceMap& operator=(const ClearanceMap&) = delete;

  /// Makes a map of the bone as it is now and hands it to the haptic thread. Any thread but that one, a single one.
  void refresh() noexcept {
    Map& m = maps_[static_cast<std::size_t>(back_)];
    m.epoch = epoch_.load(std::memory_order_acquire);
    for (std::size_t b = 0; b < m.distance.size(); ++b)
      m.distance[b] = static_cast<double>(reader_.brick_range(b).max) >= isovalue_ ? 0 : kFar;
    sweep(m.distance, 1);
    sweep(m.distance, -1);
    back_ = middle_.exchange(back_ | kFresh, std::memory_order_acq_rel) & ~kFresh;
  }

  /// Takes the newest map. Haptic thread, before anything of the tick asks for clearance.
  void begin_tick() noexcept {
    if (grid_->increase_stamp() != stamp_) {
      stamp_ = grid_->increase_stamp();
      epoch_.store(epoch_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }
    if ((middle_.load(std::memory_order_relaxed) & kFresh) != 0)
      front_ = middle_.exchange(front_, std::memory_order_acq_rel) & ~kFresh;
    usable_ = air_outside_ && maps_[static_cast<std::size_t>(front_)].epoch == epoch_.load(std::memory_order_relaxed);
  }

  /// No bone is nearer than this [m] to p_G; 0 where that is not known.
  [[nodiscard]] double clearance(const Vec3d& p_G) const noexcept { return clearance(p_G.x(), p_G.y(), p_G.z()); }
  /// The same, by numbers: compilers pass a vector through memory, and lookups wait for it (clang: for a third of
  /// their time).
  [[nodiscard]] double clearance(double x, double y, double z) const noexcept {
    if (!usable_) return 0;
    const std::array<double, 3> p{x, y, z};
    std::array<int, 3> at{};
    double to_side = std::numeric_limits<double>::max();
    double beyond = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double u = p[a] * per_metre_[axis];
      // Bone lies between the border's voxels: of a point beyond them the way there counts in addition. NaN is nowhere.
      double inside = u > -1.0 ? u : -1.0;
      inside = inside < last_[axis] ? inside : last_[axis];
      const double way = (u - inside) * spacing_[axis];
      beyond += way * way;
      at[a] = std::min(static_cast<int>(inside > 0 ? inside : 0.0) / kBrick, bricks_[a] - 1);
      const double low = inside - kBrick * at[a];
      const double high = kBrick - low;
      const double side = (low > 0 ? (low < high ? low : high) : 0.0) - kClearanceMargin;
      to_side = std::min(to_side, side * spacing_[axis]);
    }
    if (!(beyond < 1e12)) return 0;
    const int bricks = maps_[static_cast<std::size_t>(front_)].distance[grid_->brick_index(at[0], at[1], at[2])];
    const double clear = bricks > 0 ? std::max((bricks - 1) * brick_ + to_side, 0.0) : 0.0;
    return beyond > 0 ? std::sqrt(clear * clear + beyond) : clear;
  }

  [[nodiscard]] bool is_of(const VoxelGrid<Density>& grid) const noexcept { return grid_ == &grid; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return maps_.size() * maps_[0].distance.size(); }

 private:
  static constexpr std::uint8_t kFar = 255;
  static constexpr int kFresh = 4;
  struct Map {
    std::uint64_t epoch = 0;
    std::vector<std::uint8_t> distance;
  };

  /// Chamfer of equal weights, which tells Chebyshev distances exactly after a sweep up and one down.
  void sweep(std::vector<std::uint8_t>& distance, int step) const noexcept {
    const auto [nx, ny, nz] = bricks_;
    for (int n = 0; n < nx * ny * nz; ++n) {
      const std::size_t b = step > 0 ? static_cast<std::size_t>(n) : distance.size() - 1 - static_cast<std::size_t>(n);
      const auto [x, y, z] = grid_->brick_coordinates(b);
      int least = distance[b];
      // Of the 26 neighbours the 13 that this sweep has been at.
      for (int i = 0; i < 13 && least > 0; ++i) {
        const int px = x - step * (1 - i % 3), py = y - step * (1 - i / 3 % 3), pz = z - step * (1 - i / 9);
        if (px < 0 || py < 0 || pz < 0 || px >= nx || py >= ny || pz >= nz) continue;
        least = std::min(least, distance[grid_->brick_index(px, py, pz)] + 1);
      }
      distance[b] = static_cast<std::uint8_t>(std::min<int>(least, kFar));
    }
  }

  const VoxelGrid<Density>* grid_;
  GridReader<Density> reader_;
  double isovalue_;
  std::array<int, 3> bricks_;
  Vec3d last_;
  Vec3d spacing_;
  Vec3d per_metre_;
  double brick_;  // shortest edge
  bool air_outside_;
  std::uint64_t stamp_;
  std::array<Map, 3> maps_;
  int back_ = 0;                // the worker's
  std::atomic<int> middle_{1};  // handed over, with kFresh until it is taken
  int front_ = 2;               // the haptic thread's
  bool usable_ = false;
  std::atomic<std::uint64_t> epoch_{1};  // how often densities rose, as the haptic thread saw it
};

/// A contact field that also tells where there is no bone.
template <class Field, VoxelDensity Density>
class FieldWithClearance : public Field {
 public:
  FieldWithClearance(const Field& field, const ClearanceMap<Density>& map) noexcept : Field(field), map_(&map) {}
  /// No bone is nearer than this [m] to p_G.
  template <class S>
  [[nodiscard]] S clearance_at(const Vec3<S>& p_G) const noexcept {
    return static_cast<S>(
        map_->clearance(static_cast<double>(p_G.x()), static_cast<double>(p_G.y()), static_cast<double>(p_G.z())));
  }

 private:
  const ClearanceMap<Density>* map_;
};

/// List it in a scene to pass over what is far from bone: `EmptySpaceSkipping{map}`. What is found stays the same.
template <VoxelDensity Density>
class EmptySpaceSkipping {
 public:
  static constexpr bool kSkips = true;
  explicit EmptySpaceSkipping(ClearanceMap<Density>& map) noexcept : map_(&map) {}
  void begin_tick() noexcept { map_->begin_tick(); }
  [[nodiscard]] const ClearanceMap<Density>& map() const noexcept { return *map_; }
  /// Throws std::invalid_argument where the map is of another grid or leaves out what is bone at `isovalue`.
  void validate_for(const VoxelGrid<Density>& bone, double isovalue) const {
    if (!map_->is_of(bone))
      refuse("EmptySpaceSkipping", "the ClearanceMap must be made of this bone; its bricks are", bone.brick_count());
    if (!(map_->isovalue() <= isovalue))
      refuse("EmptySpaceSkipping", "the ClearanceMap's isovalue must be at most the scene's", map_->isovalue());
  }
  /// The field as the renderer is to see it.
  template <class Field>
  [[nodiscard]] FieldWithClearance<Field, Density> field_for(const Field& field) const noexcept {
    return {field, *map_};
  }

 private:
  ClearanceMap<Density>* map_;
};

}  // namespace trephine
