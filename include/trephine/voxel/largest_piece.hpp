// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

/// Leaves out of a volume what hangs apart from its bone: a scanner's head rest, a table, specks.
namespace trephine::inline TREPHINE_ALIGNED {

/// What `keep_largest_piece` took out of a grid.
struct RemovedPieces {
  std::size_t pieces = 0;
  std::size_t voxels = 0;  ///< of all these pieces
};

namespace detail {

/// The connected pieces of a grid's bone, as runs of voxels along x that know the piece they belong to (union-find).
template <class Density>
class BonePieces {
 public:
  struct Run {
    int first, last;  ///< voxels along x, both included
    std::uint32_t parent;
  };

  BonePieces(const VoxelGrid<Density>& grid, double isovalue) : size_(grid.size()) {
    rows_.reserve(static_cast<std::size_t>(size_[1]) * static_cast<std::size_t>(size_[2]) + 1);
    rows_.push_back(0);
    for (int k = 0; k < size_[2]; ++k)
      for (int j = 0; j < size_[1]; ++j) {
        add_row(grid, isovalue, j, k);
        join_rows(j, k, j - 1, k);
        for (int beside = j - 1; beside <= j + 1; ++beside) join_rows(j, k, beside, k - 1);
      }
    voxels_.assign(runs_.size(), 0);
    for (std::uint32_t r = 0; r < runs_.size(); ++r)
      voxels_[root(r)] += static_cast<std::size_t>(runs_[r].last - runs_[r].first + 1);
  }

  /// Returns the voxels of each piece, at the index of its root; 0 for all other runs.
  [[nodiscard]] const std::vector<std::size_t>& voxels() const noexcept { return voxels_; }

  /// Calls `visit(j, k, first, last)` for the voxels in and beside the runs of the piece `kept`, or of all others; some
  /// more than once.
  template <class Visit>
  void for_each_run_beside(std::uint32_t kept, bool others, const Visit& visit) {
    std::size_t row = 0;
    for (int k = 0; k < size_[2]; ++k)
      for (int j = 0; j < size_[1]; ++j, ++row)
        for (std::uint32_t r = rows_[row]; r < rows_[row + 1]; ++r) {
          if ((root(r) == kept) == others) continue;
          const int first = std::max(runs_[r].first - 1, 0), last = std::min(runs_[r].last + 1, size_[0] - 1);
          for (int b = std::max(k - 1, 0); b <= std::min(k + 1, size_[2] - 1); ++b)
            for (int a = std::max(j - 1, 0); a <= std::min(j + 1, size_[1] - 1); ++a) visit(a, b, first, last);
        }
  }

 private:
  void add_row(const VoxelGrid<Density>& grid, double isovalue, int j, int k) {
    const Density* const voxels = grid.data() + grid.index(0, j, k);
    const auto is_bone = [&](int i) { return static_cast<double>(voxels[i]) >= isovalue; };
    for (int i = 0; i < size_[0]; ++i) {
      if (!is_bone(i)) continue;
      const int first = i;
      while (i + 1 < size_[0] && is_bone(i + 1)) ++i;
      runs_.push_back({first, i, static_cast<std::uint32_t>(runs_.size())});
    }
    rows_.push_back(static_cast<std::uint32_t>(runs_.size()));
  }

  /// Joins runs of two rows that have neighbours, also over an edge or a corner.
  void join_rows(int j, int k, int other_j, int other_k) {
    if (other_j < 0 || other_j >= size_[1] || other_k < 0) return;
    const auto row_of = [this](int row_j, int row_k) {
      return static_cast<std::size_t>(row_k) * static_cast<std::size_t>(size_[1]) + static_cast<std::size_t>(row_j);
    };
    const std::size_t here = row_of(j, k), there = row_of(other_j, other_k);
    std::uint32_t a = rows_[here], b = rows_[there];
    while (a < rows_[here + 1] && b < rows_[there + 1]) {
      if (runs_[a].first <= runs_[b].last + 1 && runs_[b].first <= runs_[a].last + 1) join(a, b);
      ++(runs_[a].last < runs_[b].last ? a : b);
    }
  }

  [[nodiscard]] std::uint32_t root(std::uint32_t r) noexcept {
    while (runs_[r].parent != r) {
      runs_[r].parent = runs_[runs_[r].parent].parent;  // halves the path
      r = runs_[r].parent;
    }
    return r;
  }
  void join(std::uint32_t a, std::uint32_t b) noexcept {
    a = root(a);
    b = root(b);
    runs_[std::max(a, b)].parent = std::min(a, b);
  }

  std::array<int, 3> size_;
  std::vector<Run> runs_;
  std::vector<std::uint32_t> rows_;  ///< first run of each row, and the end
  std::vector<std::size_t> voxels_;
};

}  // namespace detail

/// Keeps the largest connected piece of bone (density ≥ `isovalue`, by number of voxels; of equals the first in memory)
/// and sets all other bone to the grid's `outside` density: a scanner's head rest, a table, specks. So it does with the
/// voxels beside removed bone, which the image's blur lifts: splines of them would reach the isovalue (`resampled`).
///
/// Voxels are connected over faces, edges and corners, as the corners of a cell are. So no cell holds corners of two
/// pieces. No voxel beside the kept bone changes, so the kept surface stays as it was, to the bit. A part that touches
/// the bone in one voxel is part of it.
///
/// The grid is made anew where something is removed: originals, ranges and slopes are those of the cleaned volume, and
/// `restore` does not bring pieces back. So clean a volume before a scene, a reader or a map uses the grid. A grid
/// without bone, or with one piece, is left alone.
///
/// Cost: one pass over the voxels, about linear in them. Memory while it works: 20 bytes for each run of bone along x,
/// and one Density a voxel where something is removed. Throws std::invalid_argument for an isovalue that is not finite,
/// or that `outside` reaches. One thread, which owns the grid; not within a tick.
template <class Density>
RemovedPieces keep_largest_piece(VoxelGrid<Density>& grid, double isovalue) {
  if (!is_finite(isovalue)) refuse("keep_largest_piece", "isovalue must be finite", isovalue);
  if (static_cast<double>(grid.outside()) >= isovalue)
    refuse("keep_largest_piece", "isovalue must be above the density outside of the grid", isovalue);
  detail::BonePieces<Density> pieces(grid, isovalue);
  const std::vector<std::size_t>& voxels = pieces.voxels();
  RemovedPieces removed;
  std::uint32_t kept = 0;
  for (std::uint32_t r = 0; r < voxels.size(); ++r) {
    if (voxels[r] > voxels[kept]) kept = r;
    removed.pieces += voxels[r] > 0 ? 1 : 0;
    removed.voxels += voxels[r];
  }
  if (removed.pieces < 2) return {};
  --removed.pieces;
  removed.voxels -= voxels[kept];

  const std::array<int, 3>& n = grid.size();
  std::vector<Density> left(static_cast<std::size_t>(n[0]) * static_cast<std::size_t>(n[1]) *
                            static_cast<std::size_t>(n[2]));
  grid.copy_voxels(left);
  const auto place = [&](int i, int j, int k) {
    return left.begin() + ((static_cast<std::ptrdiff_t>(k) * n[1] + j) * n[0] + i);
  };
  pieces.for_each_run_beside(kept, true, [&](int j, int k, int first, int last) {
    std::fill(place(first, j, k), place(last, j, k) + 1, grid.outside());
  });
  pieces.for_each_run_beside(kept, false, [&](int j, int k, int first, int last) {
    const Density* const from = grid.data() + grid.index(first, j, k);
    std::copy(from, from + (last - first + 1), place(first, j, k));
  });
  grid = VoxelGrid<Density>(
      {.size = n, .spacing = grid.spacing(), .X_WG = grid.X_WG(), .outside = static_cast<double>(grid.outside())}, left,
      {.keep_original = grid.keeps_original()});
  return removed;
}

}  // namespace trephine
