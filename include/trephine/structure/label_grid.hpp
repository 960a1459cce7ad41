// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/number.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/voxel/grid_checks.hpp>
#include <trephine/voxel/grid_geometry.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// The number formats of a label: unsigned integers of 8 or 16 bits.
template <class T>
concept VoxelLabel = std::same_as<T, std::uint8_t> || std::same_as<T, std::uint16_t>;

/// An anatomical structure of a segmentation: nerve, dura, vessel.
struct Structure {
  std::uint16_t label = 0;               ///< its voxels hold this number, >= 1
  std::string name{};                    ///< one line, not empty
  std::array<float, 3> colour{1, 1, 1};  ///< red, green, blue for drawing, each 0 to 1
};

/// Options of a LabelGrid.
struct LabelGridOptions {
  bool ignore_unlisted = false;  ///< voxels whose label is not listed count as 0; they are refused otherwise
};

/// A segmentation: each voxel holds the label of its structure, or 0 for none. Structures cannot overlap.
///
/// Voxel (i, j, k) is a sample at its centre, which lies at `spacing * (i, j, k)` in S, the structure grid's frame.
/// Size, spacing and pose `X_WS` are its own and need not be those of the bone. Labels beyond the grid are 0.
///
/// Memory: one linear array, x fastest, and a few bytes a structure. Threads: immutable but for its pose. Any thread
/// may read while no thread calls `set_X_WS`. Construction, `find` and copies of structures are not for the haptic
/// thread.
template <VoxelLabel Label>
class LabelGrid {
 public:
  /// [structures] most that a grid holds, so that an 8-bit number can tell them apart with one left for none.
  static constexpr std::size_t kMaxStructures = 255;

  /// Copies `voxels` (x fastest); `geometry.X_WG` is the pose X_WS. Throws std::invalid_argument for
  /// - a buffer that does not match the size, a size or spacing out of range, a pose that is not rigid or too far;
  /// - a density outside other than 0;
  /// - a structure with label 0 or beyond `Label`'s range, an empty name, a name of several lines, a colour out of
  /// range;
  /// - a label or name listed twice, or more than kMaxStructures structures;
  /// - a listed structure without a voxel, and a voxel whose label is not listed, unless `options` ignores those.
  LabelGrid(const GridGeometry& geometry, std::span<const Label> voxels, std::vector<Structure> structures,
            const LabelGridOptions& options = {})
      : size_(geometry.size), spacing_(geometry.spacing), X_WS_(geometry.X_WG), structures_(std::move(structures)) {
    detail::check_grid(kType, "X_WS", geometry, voxels.size());
    if (geometry.outside && *geometry.outside != 0)
      refuse(kType, "labels outside the grid are 0, so outside must be 0 or not given", *geometry.outside);
    check_structures();
    voxels_.assign(voxels.begin(), voxels.end());
    survey(options);
  }

  [[nodiscard]] const std::array<int, 3>& size() const noexcept { return size_; }
  [[nodiscard]] const Vec3d& spacing() const noexcept { return spacing_; }  ///< [m]
  [[nodiscard]] const Posed& X_WS() const noexcept { return X_WS_; }

  /// Moves the grid to the pose X_WS, while no other thread reads it. Throws std::invalid_argument if the pose is not
  /// rigid or lies farther than kFarthestPosition.
  void set_X_WS(const Posed& X_WS) {
    detail::check_grid_pose(kType, "X_WS", X_WS);
    X_WS_ = X_WS;
  }

  /// Returns true for the index of a voxel.
  [[nodiscard]] bool contains(int i, int j, int k) const noexcept {
    return i >= 0 && j >= 0 && k >= 0 && i < size_[0] && j < size_[1] && k < size_[2];
  }
  /// Returns the voxel's label; 0 outside the grid.
  [[nodiscard]] Label at(int i, int j, int k) const noexcept { return contains(i, j, k) ? voxels_[index(i, j, k)] : 0; }

  /// Returns the label of the voxel nearest to the point p_S [m] in S. It is 0 farther than half a voxel beyond the
  /// outermost centres, and for a point that is not finite. A point midway belongs to the voxel of the higher index.
  [[nodiscard]] Label label_at(const Vec3d& p_S) const noexcept {
    std::array<int, 3> u{};
    for (std::size_t a = 0; a < 3; ++a) {
      const auto axis = static_cast<Eigen::Index>(a);
      const double nearest = std::floor(p_S[axis] / spacing_[axis] + 0.5);
      if (!(nearest >= 0 && nearest < size_[a])) return 0;
      u[a] = static_cast<int>(nearest);
    }
    return voxels_[index(u[0], u[1], u[2])];
  }

  /// Returns the structures in the order in which they were listed.
  [[nodiscard]] const std::vector<Structure>& structures() const noexcept { return structures_; }
  /// Returns the structure of a label or name, or nullptr. It lives as long as the grid.
  [[nodiscard]] const Structure* find(std::uint16_t label) const noexcept {
    const std::size_t s = place_of(label);
    return s < structures_.size() ? &structures_[s] : nullptr;
  }
  [[nodiscard]] const Structure* find(std::string_view name) const noexcept {
    const auto same = [name](const Structure& s) { return s.name == name; };
    const auto s = std::find_if(structures_.begin(), structures_.end(), same);
    return s != structures_.end() ? &*s : nullptr;
  }

  /// Returns the number of voxels of a structure; 0 for a label that is not listed.
  [[nodiscard]] std::size_t voxel_count(std::uint16_t label) const noexcept {
    const std::size_t s = place_of(label);
    return s < extents_.size() ? extents_[s].count : 0;
  }
  /// Returns the smallest box of voxels that holds the structure; empty for a label that is not listed.
  [[nodiscard]] VoxelBox box_of(std::uint16_t label) const noexcept {
    const std::size_t s = place_of(label);
    return s < extents_.size() ? extents_[s].box : VoxelBox{};
  }

  /// Returns all labels, x fastest, without a border.
  [[nodiscard]] std::span<const Label> voxels() const noexcept { return voxels_; }
  [[nodiscard]] std::size_t index(int i, int j, int k) const noexcept {
    return static_cast<std::size_t>((static_cast<std::ptrdiff_t>(k) * size_[1] + j) * size_[0] + i);
  }
  /// Returns the memory of this grid's arrays [bytes], names excluded.
  [[nodiscard]] std::size_t bytes() const noexcept {
    return voxels_.size() * sizeof(Label) + structures_.size() * (sizeof(Structure) + sizeof(Extent));
  }

 private:
  static constexpr std::string_view kType = "LabelGrid";
  struct Extent {
    std::size_t count = 0;
    VoxelBox box{};
  };

  [[nodiscard]] std::size_t place_of(std::uint16_t label) const noexcept {
    const auto same = [label](const Structure& s) { return s.label == label; };
    return static_cast<std::size_t>(std::find_if(structures_.begin(), structures_.end(), same) - structures_.begin());
  }

  void check_structures() const {
    if (structures_.size() > kMaxStructures) refuse(kType, "at most 255 structures fit", structures_.size());
    for (auto s = structures_.begin(); s != structures_.end(); ++s) {
      if (s->name.empty()) refuse(kType, "each structure needs a name", "none for label " + std::to_string(s->label));
      const auto is_control = [](char c) { return static_cast<unsigned char>(c) < ' '; };
      std::string own = "'" + s->name + "'";
      std::replace_if(own.begin(), own.end(), is_control, '?');
      if (std::any_of(s->name.begin(), s->name.end(), is_control) || s->name.front() == ' ' || s->name.back() == ' ')
        refuse(kType, "a name must be one line without spaces at its ends", own);
      if (s->label == 0)
        refuse(kType, "label 0 means no structure, so a structure's label must be >= 1", "0 for " + own);
      if (s->label > std::numeric_limits<Label>::max())
        refuse(kType, "labels must fit the voxels' type", std::to_string(s->label) + " for " + own);
      for (const float c : s->colour)
        if (!(c >= 0 && c <= 1)) refuse(kType, "colours must lie in 0 to 1", number_text(c) + " for " + own);
      for (auto other = structures_.begin(); other != s; ++other) {
        if (other->label == s->label)
          refuse(kType, "each label must be listed once",
                 std::to_string(s->label) + " for '" + other->name + "' and " + own);
        if (other->name == s->name)
          refuse(kType, "each name must be listed once",
                 own + " for labels " + std::to_string(other->label) + " and " + std::to_string(s->label));
      }
    }
  }

  /// Counts and boxes the voxels of each structure, a run of equal labels at a time; refuses or clears the others.
  void survey(const LabelGridOptions& options) {
    constexpr std::size_t kLabels = std::size_t{std::numeric_limits<Label>::max()} + 1;
    std::vector<Extent> found(kLabels);
    for (int k = 0; k < size_[2]; ++k)
      for (int j = 0; j < size_[1]; ++j) {
        const Label* const row = &voxels_[index(0, j, k)];
        for (int i = 0, end = 0; i < size_[0]; i = end) {
          while (end < size_[0] && row[end] == row[i]) ++end;
          include(found[row[i]], {{i, j, k}, {end - 1, j, k}});
        }
      }
    for (const Structure& s : structures_) {
      if (found[s.label].count == 0)
        refuse(kType, "each structure must have a voxel",
               "none of '" + s.name + "' (label " + std::to_string(s.label) + ")");
      extents_.push_back(std::exchange(found[s.label], {}));
    }
    found[0] = {};
    const auto unlisted = [](const Extent& e) { return e.count > 0; };
    const auto others = std::count_if(found.begin(), found.end(), unlisted);
    if (others == 0) return;
    if (!options.ignore_unlisted) {
      const auto first = std::find_if(found.begin(), found.end(), unlisted);
      std::string got = "label " + std::to_string(first - found.begin()) + " in " + std::to_string(first->count) +
                        (first->count == 1 ? " voxel" : " voxels");
      if (others > 1) got += " and " + std::to_string(others - 1) + " more";
      refuse(kType, "every voxel's label must be listed, or ignored (ignore_unlisted)", got);
    }
    for (Label& label : voxels_)
      if (found[label].count > 0) label = 0;
  }

  static void include(Extent& extent, const VoxelBox& run) {
    if (extent.count == 0) extent.box = run;
    extent.count += static_cast<std::size_t>(run.hi[0] - run.lo[0] + 1);
    for (std::size_t a = 0; a < 3; ++a) {
      extent.box.lo[a] = std::min(extent.box.lo[a], run.lo[a]);
      extent.box.hi[a] = std::max(extent.box.hi[a], run.hi[a]);
    }
  }

  std::array<int, 3> size_{};
  Vec3d spacing_;
  Posed X_WS_;
  std::vector<Structure> structures_;
  std::vector<Extent> extents_;  // of each structure
  std::vector<Label> voxels_;
};

}  // namespace trephine
