// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <array>
#include <cstdint>
#include <vector>

namespace trephine {

/// Distances of a tool at the origin with its axis along u from kProfileLanes points [m].
template <ToolShape Shape>
void distances_from(const Shape& shape, const Vec3<float>& u, const Vec3<float>& shift, const float* x, const float* y,
                    const float* z, float* out) noexcept {
  ProfileLanes<float> rho, along;
  const float ux = u.x(), uy = u.y(), uz = u.z(), sx = shift.x(), sy = shift.y(), sz = shift.z();
  for (std::size_t i = 0; i < kProfileLanes; ++i) {
    const float px = x[i] + sx, py = y[i] + sy, pz = z[i] + sz;
    const float a = px * ux + py * uy + pz * uz;
    // What is square to the axis, without cancellation.
    const float qx = px - a * ux, qy = py - a * uy, qz = pz - a * uz;
    along[i] = a;
    rho[i] = qx * qx + qy * qy + qz * qz;
  }
  take_roots(rho);
  ProfileLanes<float> d;
  shape.distances(rho, along, d);
  std::copy(d.begin(), d.end(), out);
}

/// Positions and sides of patches, component by component [m].
template <class Array>
struct PatchComponents {
  std::array<Array, 3> position, along, across;
};
using PatchLanes = PatchComponents<std::vector<float>>;

/// Broad phase: the surface patches within a distance of the tool, kept while the tool stays near the pose that they
/// were gathered at and the bone is not cut there. One list a tool.
class NearPatches {
 public:
  /// Takes memory for what a tool of this shape may have near it.
  template <class View, ToolShape Shape>
  void reserve(const View& view, const Shape& shape) {
    const ToolBounds b = shape.bounds();
    const double h = view.grid().spacing().minCoeff();
    const double sides = 2 * 3.15 * b.radius * (b.z_high - b.z_low + b.radius) / (h * h);
    capacity_ = static_cast<std::size_t>(std::clamp(6 * sides, 4096.0, 262144.0));
    for (auto* part : {&lanes_.position, &lanes_.along, &lanes_.across})
      for (auto& v : *part) v.resize(capacity_ + kLane);
    spread_of_.resize(capacity_ + kLane);
    patches_.resize(capacity_);
    distance_.resize(capacity_ + kLane);
    bricks_.reserve(kMostBricks);
    corners_.reserve(kMostBricks);
    for (auto* v : {&mx_, &my_, &mz_, &brick_distance_}) v->resize(kMostBricks + kLane);
    forget();
  }

  void forget() noexcept {
    valid_ = false;
    count_ = 0;
    brick_reach_ = -1;
  }

  /// Makes sure of every patch that comes nearer than `need` [m] to a tool at X; where it has to look, it looks as far
  /// as `reach`. False where the bone's surface could not all be had in this tick.
  template <class View, ToolShape Shape>
  [[nodiscard]] bool cover(const View& view, const Shape& shape, const Posed& X, double need, double reach) noexcept {
    const ToolBounds bounds = shape.bounds();
    if (is_current(view) && bounds.motion_between(X_, X) + need <= reach_) return true;
    reach = std::max(need, reach);
    if (stamp_ != view.grid().rise_stamp() || bounds.motion_between(X_bricks_, X) + reach > brick_reach_)
      find_bricks(view, shape, X, reach + kBrickReach * view.grid().spacing().minCoeff());
    return gather(view, shape, X, reach);
  }

  /// Whether no brick near the tool was cut since patches were gathered.
  template <class View>
  [[nodiscard]] bool is_current(const View& view) noexcept {
    const auto& grid = view.grid();
    if (!valid_ || stamp_ != grid.rise_stamp()) return false;
    if (edits_ == grid.edit_count()) return true;
    for (const NearBrick& b : bricks_)
      if (grid.brick_version(b.brick) != b.version) return false;
    edits_ = grid.edit_count();
    return true;
  }

  /// Whether it is known that no patch comes nearer than `distance` [m] to a tool at X.
  template <class View>
  [[nodiscard]] bool is_empty_around(const View& view, const ToolBounds& bounds, const Posed& X,
                                     double distance) const noexcept {
    return valid_ && count_ == 0 && stamp_ == view.grid().rise_stamp() && edits_ == view.grid().edit_count() &&
           bounds.motion_between(X_, X) + distance <= reach_;
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// How far around X the list reaches [m].
  [[nodiscard]] double reach_at(const ToolBounds& bounds, const Posed& X) const noexcept {
    return reach_ - bounds.motion_between(X_, X);
  }
  /// The patch in G.
  [[nodiscard]] SurfacePatch operator[](std::size_t i) const noexcept {
    const auto vector = [&](const std::array<std::vector<float>, 3>& v) {
      return Vec3d(static_cast<double>(v[0][i]), static_cast<double>(v[1][i]), static_cast<double>(v[2][i]));
    };
    const Near& n = patches_[i];
    return {corners_[n.brick] + n.position.template cast<double>(), vector(lanes_.along), vector(lanes_.across),
            static_cast<double>(n.area)};
  }
  /// All patches' components in single precision, positions from `shift` of the pose's origin.
  [[nodiscard]] const PatchLanes& lanes() const noexcept { return lanes_; }
  [[nodiscard]] Vec3<float> shift(const Posed& X) const noexcept {
    return (X_.translation() - X.translation()).template cast<float>();
  }
  /// The voxel edge that a patch is of, the same number in every list.
  [[nodiscard]] std::uint64_t key(std::size_t i) const noexcept {
    const Near& n = patches_[i];
    return (static_cast<std::uint64_t>(bricks_[n.brick].brick) << 20) | n.edge;
  }

  /// Calls touches(i) for each patch that may have a point nearer than `touching` [m] to the tool at X; returns how
  /// much farther off the others are [m].
  template <ToolShape Shape, class Visit>
  double for_each_touching(const Shape& shape, const Posed& X, double touching, Visit&& touches) noexcept {
    const Vec3<float> from = shift(X);
    const Vec3<float> u = X.linear().col(2).template cast<float>();
    const auto n = static_cast<std::size_t>(padded_to_lane(static_cast<int>(count_)));
    for (std::size_t i = 0; i < n; i += kLane)
      distances_from(shape, u, from, lanes_.position[0].data() + i, lanes_.position[1].data() + i,
                     lanes_.position[2].data() + i, distance_.data() + i);
    const auto offset = static_cast<float>(touching);
    float nearest = static_cast<float>(reach_at(shape.bounds(), X)) - offset;
    for (std::size_t i = 0; i < count_; ++i) {
      const float beyond = distance_[i] - spread_of_[i] - offset;
      if (beyond < 0)
        touches(i);
      else
        nearest = beyond < nearest ? beyond : nearest;
    }
    return std::max(0.0, static_cast<double>(nearest));
  }

  /// Counts the lists: another number, another order of patches.
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

 private:
  static_assert(kProfileLanes == static_cast<std::size_t>(kLane));
  static constexpr std::size_t kMostBricks = 16384;
  /// Bricks are looked for this much farther than patches [voxels], so that most lists of patches need no search.
  static constexpr double kBrickReach = 8;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };
  struct Near {
    Vec3<float> position;  // from the brick's voxel 0 [m]
    float area;            // [m²]
    std::uint32_t edge;
    std::uint32_t brick;  // of the near bricks
  };

  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, double reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, double reach) noexcept;
  template <class View, ToolShape Shape>
  void gather_brick(const View& view, const Shape& shape, std::size_t near_brick) noexcept;

  std::size_t capacity_ = 0;
  std::size_t count_ = 0;
  PatchLanes lanes_;              // positions from the tool's origin where they were gathered
  std::vector<float> spread_of_;  // how far a patch's points are from its position at most [m]
  std::vector<float> distance_;   // from the tool, at the last pose asked for
  std::vector<Near> patches_;
  std::vector<NearBrick> bricks_;
  std::vector<Vec3d> corners_;       // of their voxels 0, in G [m]
  std::vector<float> mx_, my_, mz_;  // of their middles, from the tool's origin where they were found [m]
  std::vector<float> brick_distance_;
  Posed X_bricks_ = Posed::Identity();  // where bricks, and …
  double brick_reach_ = -1;
  Posed X_ = Posed::Identity();  // … where patches were gathered, and how far around
  double reach_ = 0;
  std::uint64_t stamp_ = 0;
  std::uint64_t edits_ = 0;
  std::uint64_t generation_ = 0;
  bool valid_ = false;
};

/// Looks at blocks of 4³ bricks, then at the bricks of those that may be near.
template <class View, ToolShape Shape>
void NearPatches::find_bricks(const View& view, const Shape& shape, const Posed& X, double reach) noexcept {
  constexpr int kBlock = 4;
  const auto& grid = view.grid();
  bricks_.clear();
  corners_.clear();
  X_bricks_ = X;
  brick_reach_ = reach;
  const ToolBounds bounds = shape.bounds();
  const Vec3d size = BoneSurface<typename View::Density>::kBrick * grid.spacing();
  const Vec3d p = X.translation(), u = X.linear().col(2);
  // Patches reach beyond their edges' bricks by less than two voxels.
  const double margin = reach + 2 * grid.spacing().maxCoeff();
  const Vec3d end_low = p + bounds.z_low * u, end_high = p + bounds.z_high * u;
  std::array<int, 3> lo, hi;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double last = grid.bricks()[i] - 1, pad = bounds.radius + margin;
    lo[i] = static_cast<int>(std::clamp((std::min(end_low[a], end_high[a]) - pad) / size[a], 0.0, last));
    hi[i] = static_cast<int>(std::clamp((std::max(end_low[a], end_high[a]) + pad) / size[a], 0.0, last));
  }
  // Calls near(i, j, k) for the boxes of `count` bricks along each axis, from brick (x, y, z) on, that may be near.
  const auto for_each_near = [&](int count, const std::array<int, 3>& from, const std::array<int, 3>& to, auto&& near) {
    const Vec3<float> half = (0.5 * count * size).template cast<float>();
    const Vec3<float> shift = (-p).template cast<float>(), axis = u.template cast<float>();
    const float most = half.norm() + static_cast<float>(margin);
    std::array<float, kLane> x, y, z, d;
    std::array<std::array<int, 3>, kLane> at;
    std::size_t n = 0;
    const auto look = [&] {
      for (std::size_t l = n; l < static_cast<std::size_t>(kLane); ++l) x[l] = y[l] = z[l] = 0;
      distances_from(shape, axis, shift, x.data(), y.data(), z.data(), d.data());
      for (std::size_t l = 0; l < n; ++l)
        if (d[l] <= most) near(at[l]);
      n = 0;
    };
    for (int k = from[2]; k <= to[2]; k += count)
      for (int j = from[1]; j <= to[1]; j += count)
        for (int i = from[0]; i <= to[0]; i += count) {
          at[n] = {i, j, k};
          x[n] = static_cast<float>(i * size.x()) + half.x();
          y[n] = static_cast<float>(j * size.y()) + half.y();
          z[n] = static_cast<float>(k * size.z()) + half.z();
          if (++n == static_cast<std::size_t>(kLane)) look();
        }
    if (n > 0) look();
  };
  const Vec3d half = 0.5 * size;
  for_each_near(kBlock, lo, hi, [&](const std::array<int, 3>& block) {
    const std::array<int, 3> end{std::min(block[0] + kBlock - 1, hi[0]), std::min(block[1] + kBlock - 1, hi[1]),
                                 std::min(block[2] + kBlock - 1, hi[2])};
    for_each_near(1, block, end, [&](const std::array<int, 3>& at) {
      const std::size_t brick = grid.brick_index(at[0], at[1], at[2]);
      // Air stays air until densities rise.
      if (!view.surface().has_bone(brick) || brick_reach_ < 0) return;
      if (bricks_.size() == kMostBricks) {
        brick_reach_ = -1;
        return;
      }
      const std::size_t n = bricks_.size();
      bricks_.push_back({brick, 0});
      corners_.push_back(view.surface().corner(brick));
      mx_[n] = static_cast<float>(corners_[n].x() + half.x() - p.x());
      my_[n] = static_cast<float>(corners_[n].y() + half.y() - p.y());
      mz_[n] = static_cast<float>(corners_[n].z() + half.z() - p.z());
    });
  });
}

template <class View, ToolShape Shape>
bool NearPatches::gather(const View& view, const Shape& shape, const Posed& X, double reach) noexcept {
  const auto& grid = view.grid();
  auto& surface = view.surface();
  valid_ = false;
  count_ = 0;
  ++generation_;
  X_ = X;
  reach_ = reach;
  stamp_ = grid.rise_stamp();
  edits_ = grid.edit_count();
  surface.begin_use();
  if (brick_reach_ < 0) return false;
  const Vec3<float> shift = (X_bricks_.translation() - X.translation()).template cast<float>();
  const Vec3<float> u = X.linear().col(2).template cast<float>();
  for (std::size_t i = 0; i < bricks_.size(); i += static_cast<std::size_t>(kLane))
    distances_from(shape, u, shift, mx_.data() + i, my_.data() + i, mz_.data() + i, brick_distance_.data() + i);
  const double half = 0.5 * (BoneSurface<typename View::Density>::kBrick * grid.spacing()).norm();
  const auto margin = static_cast<float>(half + reach + 2 * grid.spacing().maxCoeff());
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    NearBrick& b = bricks_[i];
    b.version = grid.brick_version(b.brick);
    if (!(brick_distance_[i] <= margin) || !surface.crosses(b.brick)) continue;
    if (!surface.provide(b.brick)) return false;
    gather_brick(view, shape, i);
    if (count_ == capacity_) return false;
  }
  valid_ = true;
  return true;
}

template <class View, ToolShape Shape>
void NearPatches::gather_brick(const View& view, const Shape& shape, std::size_t near_brick) noexcept {
  auto& surface = view.surface();
  const Vec3<float> from_T = (corners_[near_brick] - X_.translation()).template cast<float>();
  const Vec3<float> u = X_.linear().col(2).template cast<float>();
  const auto most = static_cast<float>(reach_);
  surface.for_each_block(bricks_[near_brick].brick, [&](const PatchBlock& block, int count) {
    std::array<float, PatchBlock::kSize> distance;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += static_cast<std::size_t>(kLane))
      distances_from(shape, u, from_T, block.position[0].data() + i, block.position[1].data() + i,
                     block.position[2].data() + i, distance.data() + i);
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (!(distance[i] - block.spread[i] <= most) || count_ == capacity_) continue;
      const std::size_t n = count_++;
      patches_[n] = {{block.position[0][i], block.position[1][i], block.position[2][i]},
                     block.area[i],
                     block.edge[i],
                     static_cast<std::uint32_t>(near_brick)};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        lanes_.position[axis][n] = block.position[axis][i] + from_T[static_cast<Eigen::Index>(axis)];
        lanes_.along[axis][n] = block.along[axis][i];
        lanes_.across[axis][n] = block.across[axis][i];
      }
      spread_of_[n] = block.spread[i];
    }
  });
}

}  // namespace trephine
