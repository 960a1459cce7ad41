// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/math.hpp>
#include <trephine/core/square_roots.hpp>
#include <trephine/voxel/bone_rows.hpp>
#include <trephine/voxel/crossed_edges.hpp>
#include <trephine/voxel/dual_element.hpp>
#include <trephine/voxel/voxel_grid.hpp>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// Quadrature points of a brick's isosurface at its crossed voxel edges, and joined by cells: for tools in whose
/// contact there are many crossings.
///
/// A point lies where its edge crosses the surface. Edges along the axis a cross it once for each h_b h_c of its
/// projection along a, so a point with the unit normal n has the weight h_b h_c |n_a| (Cauchy and Crofton's formula):
/// the points of one axis integrate f n_a² over the surface, those of all three f. The normal is that of the lines
/// between the surface's next crossings on either side (`DualElements::next_crossing`).
///
/// Points of a cell of 2^join voxels are joined where their edges have the same axis and the same end in bone, so two
/// sides of a thin wall stay apart. The joined point has their weight, at their centroid.
template <VoxelDensity Density>
class CrossingPoints {
 public:
  /// Positions are from the brick's voxel 0 [m].
  struct Point {
    std::uint32_t number;  ///< of its cell, axis and side in the brick
    float weight;          ///< area that it stands for [m²]
    std::array<float, 3> position;
  };

  /// `joins`: log2 of a cell's voxels along each axis, 0 to 3.
  CrossingPoints(const VoxelGrid<Density>& grid, std::size_t brick, double isovalue,
                 const std::array<int, 3>& joins) noexcept
      : rows_(grid, brick, isovalue), spacing_(grid.spacing().template cast<float>()), joins_(joins) {
    for (std::size_t i = 0; i < 3; ++i) {
      first_cell_[i] = cell_of(-1, i);
      cells_[i] = static_cast<std::size_t>(cell_of(kBrick - 1, i) - first_cell_[i] + 1);
    }
    std::fill_n(index_.begin(), kKinds * cells_[0] * cells_[1] * cells_[2], kNone);
    rows_.for_each_own_edge([&]<std::size_t kAxis>(const std::array<int, 3>& start, bool) { add<kAxis>(start); });
    flush();
  }

  /// Calls visit(point) for each point, in the order of their first edges.
  template <class Visit>
  void for_each(Visit&& visit) const noexcept {
    for (std::size_t n = 0; n < count_; ++n) {
      const Point& sum = points_[n];
      // A surface along its edge, or through a voxel where others cross, has no area.
      if (!(sum.weight > 0)) continue;
      const float per = 1 / sum.weight;
      visit(Point{sum.number, sum.weight, {sum.position[0] * per, sum.position[1] * per, sum.position[2] * per}});
    }
  }

 private:
  static constexpr int kBrick = BoneRows<Density>::kBrick;
  static constexpr std::size_t kKinds = 6;  // of edges: three axes, and which end is in bone
  static constexpr std::size_t kMostCells = (kBrick + 1) * (kBrick + 1) * (kBrick + 1);
  static constexpr std::uint16_t kNone = 0xFFFF;
  static constexpr std::size_t kLanes = CrossingLanes::kLanes;
  using Lanes = CrossingLanes::Lanes;

  /// Crossings whose points are computed together.
  struct Batch {
    std::size_t count = 0;
    CrossingLanes around;        // of which positions and cells are not needed
    Lanes face;                  // area of a voxel's face across the edge [m²]
    Lanes length, per_b, per_c;  // spacing along the edge [m], and over those along b and c
    std::array<Lanes, 3> start;  // of the edge, x, y, z [m]
    std::array<std::uint16_t, kLanes> point;
  };

  [[nodiscard]] int cell_of(int voxel, std::size_t axis) const noexcept { return (voxel + kBrick) >> joins_[axis]; }

  template <std::size_t a>
  void add(const std::array<int, 3>& start) noexcept {
    constexpr std::size_t b = (a + 1) % 3, c = (a + 2) % 3;
    const std::size_t l = batch_.count++;
    batch_.around.axis[l] = a;
    batch_.around.set_densities(l, rows_.at(start), {rows_.pitch(a), rows_.pitch(b), rows_.pitch(c)}, rows_.isovalue());
    batch_.face[l] = spacing_[b] * spacing_[c];
    batch_.length[l] = spacing_[a];
    batch_.per_b[l] = spacing_[a] / spacing_[b];
    batch_.per_c[l] = spacing_[a] / spacing_[c];
    std::size_t cell = 0;
    for (std::size_t i = 3; i-- > 0;) {
      batch_.start[i][l] = static_cast<float>(start[i]) * spacing_[static_cast<Eigen::Index>(i)];
      cell = cell * cells_[i] + static_cast<std::size_t>(cell_of(start[i], i) - first_cell_[i]);
    }
    const std::size_t kind = kKinds * cell + 2 * a + (batch_.around.starts_in_bone[l] > 0 ? 1 : 0);
    std::uint16_t& point = index_[kind];
    if (point == kNone) {
      point = static_cast<std::uint16_t>(count_);
      points_[count_++] = {static_cast<std::uint32_t>(kind), 0, {}};
    }
    batch_.point[l] = point;
    if (batch_.count == kLanes) flush();
  }

  /// Adds the batch's crossings to their points.
  void flush() noexcept {
    const float isovalue = rows_.isovalue();
    const CrossingLanes& q = batch_.around;
    const std::array<std::array<Lanes, 2>, 4> next{
        DualElements::next_crossing(q, isovalue, 0), DualElements::next_crossing(q, isovalue, 1),
        DualElements::next_crossing(q, isovalue, 2), DualElements::next_crossing(q, isovalue, 3)};
    Lanes place, cosine, weight;
    for (std::size_t l = 0; l < kLanes; ++l)
      place[l] = batch_.length[l] * (isovalue - q.ends[0][l]) / (q.ends[1][l] - q.ends[0][l]);
    for (std::size_t l = 0; l < kLanes; ++l) {
      const float b = batch_.per_b[l] * (next[1][0][l] - next[0][0][l]), way_b = next[1][1][l] + next[0][1][l];
      const float c = batch_.per_c[l] * (next[3][0][l] - next[2][0][l]), way_c = next[3][1][l] + next[2][1][l];
      // The normal's components, times the ways.
      const float up = way_b * way_c, aside_b = b * way_c, aside_c = c * way_b;
      weight[l] = up * up + aside_b * aside_b + aside_c * aside_c;
      cosine[l] = up;
    }
    square_roots(weight);
    for (std::size_t l = 0; l < kLanes; ++l)
      weight[l] = batch_.face[l] * cosine[l] / std::max(weight[l], std::numeric_limits<float>::min());
    for (std::size_t l = 0; l < batch_.count; ++l) {
      Point& sum = points_[batch_.point[l]];
      std::array<float, 3> p{batch_.start[0][l], batch_.start[1][l], batch_.start[2][l]};
      p[q.axis[l]] += place[l];
      sum.weight += weight[l];
      for (std::size_t i = 0; i < 3; ++i) sum.position[i] += weight[l] * p[i];
    }
    batch_.count = 0;
  }

  BoneRows<Density> rows_;
  Vec3<float> spacing_;
  std::array<int, 3> joins_, first_cell_{};
  std::array<std::size_t, 3> cells_{};
  std::size_t count_ = 0;
  Batch batch_;
  std::array<std::uint16_t, kKinds * kMostCells> index_;  // of a kind's point
  std::array<Point, 3 * kMostCells> points_;              // positions times weights, until they are told
};

}  // namespace trephine
