// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/voxel/grid_checks.hpp>
#include <trephine/voxel/grid_geometry.hpp>
#include <trephine/voxel/surface_slopes.hpp>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// A box of voxels, both corners included; empty where any hi < lo.
struct VoxelBox {
  std::array<int, 3> lo{0, 0, 0};
  std::array<int, 3> hi{-1, -1, -1};
  [[nodiscard]] bool empty() const noexcept { return hi[0] < lo[0] || hi[1] < lo[1] || hi[2] < lo[2]; }
};

/// Smallest and largest density of a set of voxels.
template <class Density>
struct DensityRange {
  Density min;
  Density max;
};

namespace detail {
/// Returns a number above 0 that the program has not returned before. Any thread.
[[nodiscard]] inline std::uint64_t unique_number() noexcept {
  static std::atomic<std::uint64_t> last{0};
  return last.fetch_add(1, std::memory_order_relaxed) + 1;
}
}  // namespace detail

/// The bone: a rectilinear CT volume that is read a thousand times a second while the drill lowers its densities.
///
/// Memory: one linear array, x fastest, with a border of one voxel of `outside` density on all sides, so that sampling
/// needs no branch at the edges. `keep_original` doubles it. Brick
/// data and the bookkeeping of an open edit add 4 % to 8-bit voxels (`bytes`).
///
/// Threads: only the haptic thread writes, and only it may call the members below. Other threads read through
/// `GridReader` (grid_reader.hpp). Each brick of 8³ voxels has a version and a density range, over the brick and its
/// one-voxel halo. So an edit also marks neighbouring bricks whose mesh cells reach the edited voxel.
template <class Density>
class VoxelGrid {
  // Through a variable, so that compilers do not explain the concept in twenty lines.
  static constexpr bool kIsDensity = VoxelDensity<Density>;
  static_assert(kIsDensity,
                "trephine::VoxelGrid: a voxel is a std::uint8_t, std::int8_t, std::uint16_t, std::int16_t or float; "
                "convert your densities to one of them");

 public:
  static constexpr int kBrick = 8;  ///< voxels along a brick's edge

  /// Copies `voxels` (x fastest). Throws std::invalid_argument for a buffer that does not match the size, a size or
  /// spacing out of range, a pose that is not rigid or too far, or a density that is not finite.
  VoxelGrid(const GridGeometry& geometry, std::span<const Density> voxels, const GridOptions& options = {});

  VoxelGrid(VoxelGrid&&) = default;
  VoxelGrid& operator=(VoxelGrid&&) = default;
  /// Returns another grid with the same densities, original and pose, which `take` accepts.
  [[nodiscard]] VoxelGrid copy() const;

  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return size_; }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return spacing_; }
  [[nodiscard]] const Posed& X_WG() const noexcept { return X_WG_; }
  [[nodiscard]] Density outside() const noexcept { return outside_; }
  /// Returns the range of the densities at construction.
  [[nodiscard]] DensityRange<Density> original_range() const noexcept { return original_range_; }
  /// Returns how steep the image was at an isosurface, at construction [densities per voxel]; 0 without such a surface.
  [[nodiscard]] double surface_slope(double isovalue) const noexcept { return surface_slopes_.at(isovalue); }

  /// Moves the grid to the pose X_WG, between ticks, on the haptic thread. Throws std::invalid_argument if the pose is
  /// not rigid or lies farther than kFarthestPosition.
  void set_X_WG(const Posed& X_WG) {
    detail::check_grid_pose("VoxelGrid", "X_WG", X_WG);
    X_WG_ = X_WG;
  }

  /// Returns true for the index of a voxel, border excluded.
  [[nodiscard]] bool contains(int i, int j, int k) const noexcept {
    return i >= 0 && j >= 0 && k >= 0 && i < size_[0] && j < size_[1] && k < size_[2];
  }
  /// Returns the voxel's density; i, j, k from −1 (border) to size (border), not checked.
  [[nodiscard]] Density at(int i, int j, int k) const noexcept { return voxels_[index(i, j, k)]; }

  /// Copies all voxels without the border, x fastest, as files store them. Throws std::invalid_argument unless `out`
  /// holds exactly the product of size().
  void copy_voxels(std::span<Density> out) const;

  /// Returns the smallest box of all voxels at or above the isovalue; empty if there are none.
  [[nodiscard]] VoxelBox occupied_box(double isovalue) const noexcept;

  /// Returns a new grid of the occupied box and `margin` voxels around it, at the same place in the world.
  /// Throws std::invalid_argument if no voxel reaches the isovalue.
  [[nodiscard]] VoxelGrid cropped(double isovalue, int margin = 2) const;
  /// Returns a new grid of the intersection of `box` and this grid. Throws std::invalid_argument if it is empty.
  [[nodiscard]] VoxelGrid cropped(VoxelBox box) const;

  // --- Raw layout, for the sampling kernels ------------------------------------------------------------------------
  [[nodiscard]] const Density* data() const noexcept { return voxels_.data(); }  ///< border voxel (−1, −1, −1)
  /// Returns the densities at construction, in the same layout; the present ones without `keep_original`.
  [[nodiscard]] const Density* original_data() const noexcept {
    return keeps_original() ? original_.data() : voxels_.data();
  }
  [[nodiscard]] bool keeps_original() const noexcept { return !original_.empty(); }
  [[nodiscard]] int row_pitch() const noexcept { return row_; }
  [[nodiscard]] int plane_pitch() const noexcept { return plane_; }
  [[nodiscard]] std::size_t index(int i, int j, int k) const noexcept {
    return static_cast<std::size_t>((k + 1) * static_cast<std::ptrdiff_t>(plane_) + (j + 1) * row_ + (i + 1));
  }
  /// Returns the memory of this grid's arrays [bytes].
  [[nodiscard]] std::size_t bytes() const noexcept {
    return (voxels_.size() + original_.size()) * sizeof(Density) +
           versions_.size() * (sizeof(std::uint32_t) + sizeof(DensityRange<Density>)) +
           (edited_.size() + touched_.size()) * sizeof(std::uint64_t) + touched_.size() * sizeof(std::size_t) +
           (new_min_.size() + old_max_.size()) * sizeof(Density) + surface_slopes_.bytes();
  }

  // --- Editing, haptic thread ----------------------------------------------------------------------------------------
  /// Sets voxels `x0` to `x1` of row (j, k) to `density_of(i, old)` if that is lower than `old`; NaN is not lower. The
  /// voxels must lie in the grid, which is not checked. Call `commit()` once after all rows of an edit. Returns the
  /// number of changed voxels.
  template <class DensityOf>
  int lower_row(int j, int k, int x0, int x1, DensityOf&& density_of) noexcept;

  /// The vectorised form, in blocks of `kLowerLanes` voxels, or half of that at the end of a row.
  /// `edit(x, count, old, value)` receives the densities from voxel x on in the arrays `old` and `value`. It lowers the
  /// first `count` of `value` and must leave the other lanes, which belong to other voxels. Before a changed block is
  /// stored, `note(x, changed, value)` receives the changed lanes as bits. Returns true if any voxel changed.
  template <class Edit, class Note>
  bool lower_lanes(int j, int k, int x0, int x1, Edit&& edit, Note&& note) noexcept;
  static constexpr int kLowerLanes = 16;  ///< voxels of a block: one register of 8-bit voxels

  /// Publishes the rows edited since the last commit: gradients, ranges, then versions. The work is proportional to the
  /// number of edited bricks.
  void commit() noexcept;

  /// Restores the original densities in up to `max_bricks` edited bricks; returns the number of bricks still to
  /// restore. Restore a few bricks a tick to keep ticks short. Throws std::invalid_argument without `keep_original`.
  std::size_t restore(std::size_t max_bricks = std::numeric_limits<std::size_t>::max());

  /// Takes densities and pose of `other`: a copy of this grid, what this is a copy of, or another copy of that. The
  /// work is proportional to the bricks that were edited in either. Throws std::invalid_argument for any other grid and
  /// without `keep_original`.
  void take(const VoxelGrid& other);

  /// Returns a stamp that changes whenever densities may have risen, unique among all grids of the program. While it
  /// stays the same, voxels that were once cut are still cut.
  [[nodiscard]] std::uint64_t increase_stamp() const noexcept { return increase_stamp_; }

  /// Returns the number of published edits; `last_edit` returns the box of the voxels that the last edit changed.
  [[nodiscard]] std::uint64_t edit_count() const noexcept { return edit_count_; }
  [[nodiscard]] const VoxelBox& last_edit() const noexcept { return last_edit_; }

  // --- Bricks --------------------------------------------------------------------------------------------------------
  [[nodiscard]] const std::array<int, 3>& bricks() const noexcept { return bricks_; }
  [[nodiscard]] std::size_t brick_count() const noexcept { return versions_.size(); }
  [[nodiscard]] std::size_t brick_index(int bx, int by, int bz) const noexcept {
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(bz) * bricks_[1] + by) * bricks_[0] + bx);
  }
  [[nodiscard]] std::array<int, 3> brick_coordinates(std::size_t b) const noexcept {
    const int i = static_cast<int>(b);
    return {i % bricks_[0], i / bricks_[0] % bricks_[1], i / (bricks_[0] * bricks_[1])};
  }
  /// Returns the brick's version, raised by every commit that changed a voxel of the brick or its halo. Haptic thread.
  [[nodiscard]] std::uint32_t brick_version(std::size_t b) const noexcept { return versions_[b]; }
  /// Returns the range of densities in the brick and its halo, up to date after `commit()`.
  [[nodiscard]] DensityRange<Density> brick_range(std::size_t b) const noexcept { return ranges_[b]; }

 private:
  template <VoxelDensity>
  friend class GridReader;

  VoxelGrid(const VoxelGrid&) = default;

  void lay_out();
  [[nodiscard]] VoxelBox haloed_box(std::size_t b) const noexcept;
  [[nodiscard]] DensityRange<Density> scan_range(std::size_t b) const noexcept;
  [[nodiscard]] DensityRange<Density> scan(const VoxelBox& box, const Density* stop_at) const noexcept;
  /// The rows of bricks that contain a row of voxels, in the bricks or in their halos.
  struct BrickRows {
    std::size_t count;
    std::array<std::size_t, 4> row;
  };
  [[nodiscard]] BrickRows brick_rows(int j, int k) const noexcept;
  [[nodiscard]] std::size_t brick_row(int by, int bz) const noexcept {
    return static_cast<std::size_t>(static_cast<std::ptrdiff_t>(bz) * bricks_[1] + by);
  }
  template <std::size_t kLanes, class Edit, class Note>
  void lower_block(int j, int k, int x, int count, const BrickRows& bricks, int& first, int& last, Edit& edit,
                   Note& note) noexcept;
  /// The last marked range of voxels. Another row within it, in the same bricks and halos, needs no marking again.
  struct Marked {
    std::size_t own_row = 0, first_row = 0, last_row = 0;  // rows of bricks
    int from = 0, to = -1;                                 // voxels
  };
  void mark(int j, int k, int x0, int x1, const BrickRows& bricks) noexcept;
  void touch_row(std::size_t row, int bx0, int bx1) noexcept;
  template <class Visit>
  static void for_each_word(int first, int last, Visit&& visit) noexcept;
  [[nodiscard]] std::size_t brick_of_bit(std::size_t word, int bit) const noexcept;
  [[nodiscard]] static std::uint64_t word_bits(int first, int last) noexcept {
    return (~std::uint64_t{0} >> (kWord - 1 - (last - first))) << first;
  }
  [[nodiscard]] std::size_t profile_index(std::size_t row, int x) const noexcept {
    return row * profile_ + static_cast<std::size_t>(x + 1);
  }
  template <class Visit>
  void for_each_touched(Visit&& visit) noexcept;
  void grow_edit_box(const std::array<int, 3>& lo, const std::array<int, 3>& hi) noexcept;
  [[nodiscard]] bool corner_reaches(const VoxelBox& box, Density density) const noexcept;
  void update_range(std::size_t b) noexcept;
  void store_range(std::size_t b, const DensityRange<Density>& range) noexcept;
  template <class RenewRange>
  void publish(RenewRange&& renew_range) noexcept;
  void clear_edit() noexcept;
  void raise_brick(std::size_t b, const Density* from) noexcept;

  std::array<int, 3> size_{};
  Vec3d spacing_;
  Posed X_WG_;
  Density outside_{};
  DensityRange<Density> original_range_{};
  SurfaceSlopes surface_slopes_;
  int row_ = 0;
  int plane_ = 0;
  std::vector<Density> voxels_;
  std::vector<Density> original_;

  std::array<int, 3> bricks_{};
  std::vector<std::uint32_t> versions_;
  std::vector<DensityRange<Density>> ranges_;
  static constexpr int kWord = 64;     // bricks of a row whose bits share a word
  std::size_t words_ = 0;              // words of a row of bricks
  std::vector<std::uint64_t> edited_;  // one bit a brick: own voxels differ from the original

  // State of the open edit, which no commit has published yet.
  static constexpr VoxelBox kNothing{
      {std::numeric_limits<int>::max(), std::numeric_limits<int>::max(), std::numeric_limits<int>::max()},
      {-1, -1, -1}};
  std::vector<std::uint64_t> touched_;      // one bit a brick: the commit raises its version
  std::vector<std::size_t> touched_words_;  // indices of words that are not zero; capacity for all, never allocates
  Marked marked_;                           // skips marking, because most rows lie next to the previous row
  // Profiles of a row of bricks with its halo, per x: smallest density written, and largest density overwritten.
  // They give exact ranges without a scan of bricks.
  std::size_t profile_ = 0;  // length
  std::vector<Density> new_min_;
  std::vector<Density> old_max_;
  bool risen_ = false;  // the edit may have raised densities
  VoxelBox edit_box_ = kNothing;
  VoxelBox last_edit_;
  std::uint64_t edit_count_ = 0;
  std::uint64_t increase_stamp_ = detail::unique_number();
  std::uint64_t origin_ = increase_stamp_;  // the same in all copies
};

}  // namespace trephine

#include <trephine/voxel/voxel_grid_derived.hpp>
#include <trephine/voxel/voxel_grid_edit.hpp>
#include <trephine/voxel/voxel_grid_impl.hpp>
