// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/structure/structure_field.hpp>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// The distance to one structure with a continuous gradient: a quadratic B-spline whose coefficients are the field's
/// distances at knots.
///
/// It is a mean of the distances around a point. So it is smooth where two parts of a structure are equally near, it
/// changes by at most 1 m/m, and it reads too long by spacing² / (4 r) on a surface of radius r.
///
/// Memory: 4 kB for each block of 8³ knots near the structure. Immutable; lookups from any thread.
class SmoothDistance {
 public:
  /// Samples the distances of `structure` at knots `spacing` [m] apart, where they may be below `zone` [m]. A negative
  /// zone makes an empty spline.
  SmoothDistance(const StructureField& field, int structure, double spacing, double zone) : H_(spacing) {
    if (zone < 0 || field.brick_count(structure) == 0) return;
    Eigen::AlignedBox3d box;
    for (std::size_t b = 0; b < field.brick_count(structure); ++b) {
      const std::array<int, 3> first = field.brick(structure, b);
      const Vec3d lo(first[0], first[1], first[2]);
      box.extend(Vec3d(lo.cwiseProduct(field.spacing())));
      box.extend(Vec3d((lo + Vec3d::Constant(8)).cwiseProduct(field.spacing())));
    }
    for (int a = 0; a < 3; ++a) {
      const auto axis = static_cast<std::size_t>(a);
      // Blocks of all splines of one spacing lie alike.
      first_[axis] = kBlock * block_of_knot(static_cast<int>(std::floor(box.min()[a] / H_)) - 2);
      const int last = static_cast<int>(std::ceil(box.max()[a] / H_)) + 2;
      blocks_along_[axis] = (last - first_[axis]) / kBlock + 1;
    }
    block_of_.assign(
        static_cast<std::size_t>(blocks_along_[0]) * static_cast<std::size_t>(blocks_along_[1] * blocks_along_[2]), -1);
    for (int z = 0; z < blocks_along_[2]; ++z)
      for (int y = 0; y < blocks_along_[1]; ++y)
        for (int x = 0; x < blocks_along_[0]; ++x) add_block(field, structure, {x, y, z}, zone);
  }

  /// True if no point has a smooth distance.
  [[nodiscard]] bool empty() const noexcept { return blocks_.empty(); }
  [[nodiscard]] std::size_t bytes() const noexcept {
    return blocks_.size() * sizeof(Block) + block_of_.size() * sizeof(std::int32_t);
  }
  /// Calls `visit(block)` for each block of knots, by its coordinates: knot n along an axis is in block ⌊n / 8⌋.
  template <class Visit>
  void for_each_block(const Visit& visit) const {
    std::array<int, 3> at{};
    for (at[2] = 0; at[2] < blocks_along_[2]; ++at[2])
      for (at[1] = 0; at[1] < blocks_along_[1]; ++at[1])
        for (at[0] = 0; at[0] < blocks_along_[0]; ++at[0])
          if (block_of_[table_index(at)] >= 0)
            visit(std::array{at[0] + first_[0] / kBlock, at[1] + first_[1] / kBlock, at[2] + first_[2] / kBlock});
  }
  /// Returns the knots in the zone, in S [m].
  [[nodiscard]] std::span<const Vec3d> knots() const noexcept { return places_; }
  /// Frees the list of knots.
  void release_knots() noexcept { places_ = {}; }

  /// The knots around a point of S, and the spline's weights there: the same for all structures of one spacing.
  class Place {
   public:
    /// `spacing` is that between knots [m].
    Place(const Vec3d& p_S, double spacing) noexcept : per_spacing_(1 / spacing) {
      for (std::size_t a = 0; a < 3; ++a) {
        const double x = p_S[static_cast<Eigen::Index>(a)] * per_spacing_;
        if (!(std::abs(x) < kFarthest)) return;
        const double knot = std::floor(x + 0.5), t = x - knot, below = 0.5 - t, above = 0.5 + t;
        knot_[a] = static_cast<int>(knot);
        w_[a] = {below * below / 2, 0.75 - t * t, above * above / 2};
        dw_[a] = {-below, -2 * t, above};
      }
      valid_ = true;
    }

    /// False if no spline has a distance there.
    [[nodiscard]] bool is_valid() const noexcept { return valid_; }
    /// Returns the coordinates of the block of knots.
    [[nodiscard]] std::array<int, 3> block() const noexcept {
      return {block_of_knot(knot_[0]), block_of_knot(knot_[1]), block_of_knot(knot_[2])};
    }

   private:
    friend class SmoothDistance;
    static constexpr double kFarthest = 1e9;  // [knots]

    double per_spacing_;
    bool valid_ = false;                               // the point is finite and near enough for integers
    std::array<int, 3> knot_{};                        // the nearest one
    std::array<std::array<double, 3>, 3> w_{}, dw_{};  // by axis
  };

  /// Returns the smooth distance at p_S [m] with its gradient; nothing where no knot around is below the zone.
  [[nodiscard]] std::optional<double> at(const Vec3d& p_S, Vec3d& gradient) const noexcept {
    return at(Place(p_S, H_), gradient);
  }
  /// The same at a place, which must be of this spline's spacing.
  [[nodiscard]] std::optional<double> at(const Place& place, Vec3d& gradient) const noexcept {
    if (!place.valid_) return std::nullopt;
    std::array<int, 3> block{}, in{};
    for (std::size_t a = 0; a < 3; ++a) {
      const int knot = place.knot_[a] - first_[a];
      if (knot < 0 || knot >= kBlock * blocks_along_[a]) return std::nullopt;
      block[a] = knot / kBlock;
      in[a] = knot % kBlock;
    }
    const std::int32_t found = block_of_[table_index(block)];
    if (found < 0) return std::nullopt;
    const auto &w = place.w_, &dw = place.dw_;
    const float* d = blocks_[static_cast<std::size_t>(found)].d.data() + (in[2] * kSide + in[1]) * kSide + in[0];
    double value = 0;
    Vec3d g = Vec3d::Zero();
    for (std::size_t k = 0; k < 3; ++k, d += kSide * (kSide - 3)) {
      double plane = 0, along_x = 0, along_y = 0;
      for (std::size_t j = 0; j < 3; ++j, d += kSide) {
        const double d0 = static_cast<double>(d[0]), d1 = static_cast<double>(d[1]), d2 = static_cast<double>(d[2]);
        const double row = w[0][0] * d0 + w[0][1] * d1 + w[0][2] * d2;
        plane += w[1][j] * row;
        along_x += w[1][j] * (dw[0][0] * d0 + dw[0][1] * d1 + dw[0][2] * d2);
        along_y += dw[1][j] * row;
      }
      value += w[2][k] * plane;
      g += Vec3d(w[2][k] * along_x, w[2][k] * along_y, dw[2][k] * plane);
    }
    gradient = place.per_spacing_ * g;
    return value;
  }

  /// Returns the second derivative where the gradient at p_S is `gradient`, by differences over half a spacing [1/m].
  [[nodiscard]] Mat3d curvature(const Vec3d& p_S, const Vec3d& gradient) const noexcept {
    Mat3d second;
    for (int a = 0; a < 3; ++a) {
      Vec3d more = gradient, less = gradient;
      static_cast<void>(at(Vec3d(p_S + 0.25 * H_ * Vec3d::Unit(a)), more));
      static_cast<void>(at(Vec3d(p_S - 0.25 * H_ * Vec3d::Unit(a)), less));
      second.col(a) = (more - less) / (0.5 * H_);
    }
    return 0.5 * (second + second.transpose());
  }

 private:
  static constexpr int kBlock = 8, kSide = kBlock + 2;
  [[nodiscard]] static constexpr int block_of_knot(int knot) noexcept { return knot >> 3; }
  /// Distances [m] at 8³ knots and one around them.
  struct Block {
    std::array<float, static_cast<std::size_t>(kSide) * kSide * kSide> d;
  };

  void add_block(const StructureField& field, int structure, const std::array<int, 3>& at, double zone) {
    const Vec3d lo = H_ * Vec3d(first_[0] + kBlock * at[0], first_[1] + kBlock * at[1], first_[2] + kBlock * at[2]);
    // A point in the block is at most half its diagonal from its middle.
    const Vec3d middle = lo + Vec3d::Constant(H_ * (kBlock - 1) / 2);
    const double half = H_ * (kBlock + 2) / 2 * std::sqrt(3.0);
    if (std::min(field.distance(structure, middle), field.reach()) > zone + half && zone + half < field.reach()) return;
    Block block;
    bool is_close = false;
    std::size_t n = 0;
    for (int k = -1; k <= kBlock; ++k)
      for (int j = -1; j <= kBlock; ++j)
        for (int i = -1; i <= kBlock; ++i, ++n) {
          const double d = field.distance(structure, lo + H_ * Vec3d(i, j, k));
          block.d[n] = static_cast<float>(d);
          is_close = is_close || d < zone + H_;
        }
    if (!is_close) return;
    block_of_[table_index(at)] = static_cast<std::int32_t>(blocks_.size());
    blocks_.push_back(block);
    note_places(block, lo, zone);
  }

  [[nodiscard]] std::size_t table_index(const std::array<int, 3>& at) const noexcept {
    return static_cast<std::size_t>((at[2] * blocks_along_[1] + at[1]) * blocks_along_[0] + at[0]);
  }

  void note_places(const Block& block, const Vec3d& lo, double zone) {
    for (int k = 0; k < kBlock; ++k)
      for (int j = 0; j < kBlock; ++j)
        for (int i = 0; i < kBlock; ++i)
          if (static_cast<double>(block.d[static_cast<std::size_t>(((k + 1) * kSide + j + 1) * kSide + i + 1)]) <
              zone + H_)
            places_.push_back(lo + H_ * Vec3d(i, j, k));
  }

  double H_;                                                   // between knots [m]
  std::array<int, 3> first_{0, 0, 0}, blocks_along_{0, 0, 0};  // first_: the first block's first knot
  std::vector<std::int32_t> block_of_;
  std::vector<Block> blocks_;
  std::vector<Vec3d> places_;
};

}  // namespace trephine
