// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/tolerances.hpp>
#include <trephine/voxel/grid_reader.hpp>

#include <atomic>
#include <cmath>

namespace trephine::inline TREPHINE_ALIGNED {

/// A coarse distance map of the bone: each brick of 8³ voxels stores its distance, in bricks, to the nearest brick with
/// bone. A point's clearance is one lookup, so a tick can skip parts of a tool that cannot touch bone. Memory: three
/// bytes a brick, 0.6 % of an 8-bit grid.
///
/// The map is always conservative. Removing bone only makes an old map too cautious. After `restore` every clearance is
/// 0 until a map of the restored bone is published.
///
/// Threads: construct before the loop starts. One worker thread calls `refresh`, at any rate. The haptic thread calls
/// `begin_tick` once a tick, and `clearance_at`. Neither thread waits for the other, and no map changes while in use.
/// The grid must outlive the map.
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
        brick_edge_(kBrick * grid.spacing().minCoeff()),
        air_outside_(static_cast<double>(grid.outside()) < isovalue),
        stamp_(grid.increase_stamp()) {
    if (!is_finite(isovalue)) refuse("ClearanceMap", "isovalue must be finite", isovalue);
    for (Map& m : maps_) m.distance.resize(grid.brick_count());
    refresh();
    begin_tick();
  }
  ClearanceMap(const ClearanceMap&) = delete;
  ClearanceMap& operator=(const ClearanceMap&) = delete;

  /// Computes a map of the present bone and publishes it to the haptic thread. Call it from one worker thread only.
  void refresh() noexcept {
    Map& m = maps_[static_cast<std::size_t>(back_)];
    m.epoch = epoch_.load(std::memory_order_acquire);
    for (std::size_t b = 0; b < m.distance.size(); ++b)
      m.distance[b] = static_cast<double>(reader_.brick_range(b).max) >= isovalue_ ? 0 : kFar;
    sweep(m.distance, 1);
    sweep(m.distance, -1);
    back_ = middle_.exchange(back_ | kNew, std::memory_order_acq_rel) & ~kNew;
  }

  /// Switches to the newest published map. Haptic thread, before any clearance of the tick is read.
  void begin_tick() noexcept {
    if (grid_->increase_stamp() != stamp_) {
      stamp_ = grid_->increase_stamp();
      epoch_.store(epoch_.load(std::memory_order_relaxed) + 1, std::memory_order_release);
    }
    if ((middle_.load(std::memory_order_relaxed) & kNew) != 0)
      front_ = middle_.exchange(front_, std::memory_order_acq_rel) & ~kNew;
    usable_ = air_outside_ && maps_[static_cast<std::size_t>(front_)].epoch == epoch_.load(std::memory_order_relaxed);
  }

  /// Returns a lower bound [m] of the distance from p_G to bone; 0 if it is unknown.
  [[nodiscard]] double clearance_at(const Vec3d& p_G) const noexcept { return clearance_at(p_G.x(), p_G.y(), p_G.z()); }
  /// The same for coordinates of p_G [m]. Compilers pass a vector through memory, and clang's lookups spend a third of
  /// their time on that.
  [[nodiscard]] double clearance_at(double x, double y, double z) const noexcept {
    if (!usable_) return 0;
    const std::array<double, 3> p{x, y, z};
    std::array<int, 3> brick{};
    double to_side = std::numeric_limits<double>::max();
    double beyond_squared = 0;
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double u = p[a] * per_metre_[axis];
      // Bone lies between the border's voxels: a point beyond them adds its distance to the border. NaN gives 0.
      double inside = u > -1.0 ? u : -1.0;
      inside = inside < last_[axis] ? inside : last_[axis];
      const double offset = (u - inside) * spacing_[axis];
      beyond_squared += offset * offset;
      brick[a] = std::min(static_cast<int>(inside > 0 ? inside : 0.0) / kBrick, bricks_[a] - 1);
      const double low = inside - kBrick * brick[a];
      const double high = kBrick - low;
      const double side = (low > 0 ? (low < high ? low : high) : 0.0) - kClearanceMargin;
      to_side = std::min(to_side, side * spacing_[axis]);
    }
    if (!(beyond_squared < kMaxBeyondSquared)) return 0;
    const Map& map = maps_[static_cast<std::size_t>(front_)];
    const int bricks = map.distance[grid_->brick_index(brick[0], brick[1], brick[2])];
    const double clear = bricks > 0 ? std::max((bricks - 1) * brick_edge_ + to_side, 0.0) : 0.0;
    return beyond_squared > 0 ? std::sqrt(clear * clear + beyond_squared) : clear;
  }

  /// True if this map was made of `grid`.
  [[nodiscard]] bool is_map_of(const VoxelGrid<Density>& grid) const noexcept { return grid_ == &grid; }
  [[nodiscard]] double isovalue() const noexcept { return isovalue_; }
  [[nodiscard]] std::size_t bytes() const noexcept { return maps_.size() * maps_[0].distance.size(); }

 private:
  // Numbers that decide.
  static constexpr std::uint8_t kFar = 255;          // [bricks] cap of a stored distance: the largest byte
  static constexpr double kMaxBeyondSquared = 1e12;  // [m²] beyond 1000 km, or NaN: clearance 0
  static constexpr int kNew = 4;                     // bit of `middle_`: the map is published and not yet taken

  struct Map {
    std::uint64_t epoch = 0;
    std::vector<std::uint8_t> distance;
  };

  /// One sweep of a chamfer transform with equal weights. An upward and a downward sweep give exact Chebyshev
  /// distances.
  void sweep(std::vector<std::uint8_t>& distance, int step) const noexcept {
    const auto [nx, ny, nz] = bricks_;
    for (int n = 0; n < nx * ny * nz; ++n) {
      const std::size_t b = step > 0 ? static_cast<std::size_t>(n) : distance.size() - 1 - static_cast<std::size_t>(n);
      const auto [x, y, z] = grid_->brick_coordinates(b);
      int nearest = distance[b];
      // This sweep has already passed 13 of the 26 neighbours.
      for (int i = 0; i < 13 && nearest > 0; ++i) {
        const int px = x - step * (1 - i % 3), py = y - step * (1 - i / 3 % 3), pz = z - step * (1 - i / 9);
        if (px < 0 || py < 0 || pz < 0 || px >= nx || py >= ny || pz >= nz) continue;
        nearest = std::min(nearest, distance[grid_->brick_index(px, py, pz)] + 1);
      }
      distance[b] = static_cast<std::uint8_t>(std::min<int>(nearest, kFar));
    }
  }

  const VoxelGrid<Density>* grid_;
  GridReader<Density> reader_;
  double isovalue_;
  std::array<int, 3> bricks_;
  Vec3d last_;
  Vec3d spacing_;
  Vec3d per_metre_;
  double brick_edge_;  // the shortest [m]
  bool air_outside_;
  std::uint64_t stamp_;
  std::array<Map, 3> maps_;
  // Triple buffer: indices of maps.
  int back_ = 0;                // written by the worker
  std::atomic<int> middle_{1};  // in exchange; carries kNew until the haptic thread takes it
  int front_ = 2;               // read by the haptic thread
  bool usable_ = false;
  std::atomic<std::uint64_t> epoch_{1};  // counts the rises of densities that the haptic thread noticed
};

/// A contact field with the clearances of a ClearanceMap.
template <class Field, VoxelDensity Density>
class FieldWithClearance : public Field {
 public:
  FieldWithClearance(const Field& field, const ClearanceMap<Density>& map) noexcept : Field(field), map_(&map) {}
  /// Returns a lower bound [m] of the distance from p_G to bone; 0 if it is unknown.
  template <class S>
  [[nodiscard]] S clearance_at(const Vec3<S>& p_G) const noexcept {
    return static_cast<S>(
        map_->clearance_at(static_cast<double>(p_G.x()), static_cast<double>(p_G.y()), static_cast<double>(p_G.z())));
  }

 private:
  const ClearanceMap<Density>* map_;
};

/// A scene part that skips contact search far from bone: list `EmptySpaceSkipping{map}` in a scene. Results stay equal
/// to the bit.
template <VoxelDensity Density>
class EmptySpaceSkipping {
 public:
  static constexpr bool kSkipsEmptySpace = true;
  explicit EmptySpaceSkipping(ClearanceMap<Density>& map) noexcept : map_(&map) {}
  void begin_tick() noexcept { map_->begin_tick(); }
  [[nodiscard]] const ClearanceMap<Density>& map() const noexcept { return *map_; }
  /// Throws std::invalid_argument if the map belongs to another grid, or if its isovalue exceeds `isovalue`: such a map
  /// would miss bone.
  void validate_for(const VoxelGrid<Density>& bone, double isovalue) const {
    if (!map_->is_map_of(bone))
      refuse("EmptySpaceSkipping", "the ClearanceMap must be made of this bone; its bricks are", bone.brick_count());
    if (!(map_->isovalue() <= isovalue))
      refuse("EmptySpaceSkipping", "the ClearanceMap's isovalue must be at most the scene's", map_->isovalue());
  }
  /// Returns the field that the renderer reads: `field` with clearances.
  template <class Field>
  [[nodiscard]] FieldWithClearance<Field, Density> field_for(const Field& field) const noexcept {
    return {field, *map_};
  }

 private:
  ClearanceMap<Density>* map_;
};

}  // namespace trephine
