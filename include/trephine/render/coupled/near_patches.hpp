// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace trephine {

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
    for (auto* v : {&x_, &y_, &z_, &spread_of_}) v->resize(static_cast<std::size_t>(capacity_ + kLane));
    patches_.resize(capacity_);
    distance_.resize(capacity_ + kLane);
    bricks_.reserve(kMostBricks);
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
    if (valid_ && is_current(view) && motion_between(bounds, X_, X) + need <= reach_) return true;
    reach = std::max(need, reach);
    if (stamp_ != view.grid().rise_stamp() || motion_between(bounds, X_bricks_, X) + reach > brick_reach_)
      find_bricks(view, shape, X, reach + kBrickReach * view.grid().spacing().minCoeff());
    return gather(view, shape, X, reach);
  }

  /// Whether it is known that no patch comes nearer than `distance` [m] to a tool at X.
  template <class View>
  [[nodiscard]] bool is_empty_around(const View& view, const ToolBounds& bounds, const Posed& X,
                                     double distance) const noexcept {
    return valid_ && count_ == 0 && stamp_ == view.grid().rise_stamp() && edits_ == view.grid().edit_count() &&
           motion_between(bounds, X_, X) + distance <= reach_;
  }

  /// No part of a tool that goes from pose a to b moves farther than this [m]. Turning about its own axis is no motion.
  [[nodiscard]] static double motion_between(const ToolBounds& bounds, const Posed& a, const Posed& b) noexcept {
    const double turn = (a.linear().col(2) - b.linear().col(2)).norm();
    return (a.translation() - b.translation()).norm() + turn * (std::max(-bounds.z_low, bounds.z_high) + bounds.radius);
  }

  [[nodiscard]] std::size_t size() const noexcept { return count_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// How far around X the list reaches [m].
  [[nodiscard]] double reach_at(const ToolBounds& bounds, const Posed& X) const noexcept {
    return reach_ - motion_between(bounds, X_, X);
  }
  struct Patch : SurfacePatch {
    std::uint64_t key;  ///< the voxel edge that it is of, the same number in every list
  };
  [[nodiscard]] const Patch& operator[](std::size_t i) const noexcept { return patches_[i]; }

  /// Calls touches(i) for each patch that may have a point inside the tool at X; returns how near the others come [m].
  template <ToolShape Shape, class Visit>
  double for_each_touching(const Shape& shape, const Posed& X, Visit&& touches) noexcept {
    const Vec3<float> from = (X_.translation() - X.translation()).template cast<float>();
    const Vec3<float> u = X.linear().col(2).template cast<float>();
    const auto n = static_cast<std::size_t>(padded_to_lane(static_cast<int>(count_)));
    using Lanes = Eigen::Array<float, kLane, 1>;
    for (std::size_t i = 0; i < n; i += kLane) {
      const Lanes x = Eigen::Map<const Lanes>(x_.data() + i) + from.x();
      const Lanes y = Eigen::Map<const Lanes>(y_.data() + i) + from.y();
      const Lanes z = Eigen::Map<const Lanes>(z_.data() + i) + from.z();
      const Lanes along = x * u.x() + y * u.y() + z * u.z();
      const Lanes rho = (x.square() + y.square() + z.square() - along.square()).max(0.0F).sqrt();
      shape.distances(rho.data(), along.data(), distance_.data() + i, std::size_t{kLane});
    }
    float nearest = static_cast<float>(reach_at(shape.bounds(), X));
    for (std::size_t i = 0; i < count_; ++i) {
      const float beyond = distance_[i] - spread_of_[i];
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
  static constexpr std::size_t kMostBricks = 16384;
  /// Bricks are looked for this much farther than patches [voxels], so that most lists of patches need no search.
  static constexpr double kBrickReach = 8;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };

  /// Whether no brick near the tool was cut since patches were gathered.
  template <class View>
  [[nodiscard]] bool is_current(const View& view) noexcept {
    const auto& grid = view.grid();
    if (stamp_ != grid.rise_stamp()) return false;
    if (edits_ == grid.edit_count()) return true;
    for (const NearBrick& b : bricks_)
      if (grid.brick_version(b.brick) != b.version) return false;
    edits_ = grid.edit_count();
    return true;
  }

  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, double reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, double reach) noexcept;
  template <class View, ToolShape Shape>
  void gather_brick(const View& view, const Shape& shape, std::size_t brick) noexcept;

  std::size_t capacity_ = 0;
  std::size_t count_ = 0;
  std::vector<float> x_, y_, z_;    // from the tool's origin where they were gathered [m]
  std::vector<float> spread_of_;    // how far a patch's points are from its position at most [m]
  std::vector<float> distance_;     // from the tool, at the last pose asked for
  std::vector<Patch> patches_;
  std::vector<NearBrick> bricks_;
  Posed X_bricks_ = Posed::Identity();  // where bricks, and …
  double brick_reach_ = -1;
  Posed X_ = Posed::Identity();  // … where patches were gathered, and how far around
  double reach_ = 0;
  std::uint64_t stamp_ = 0;
  std::uint64_t edits_ = 0;
  std::uint64_t generation_ = 0;
  bool valid_ = false;
};

/// Halves boxes of bricks as long as the tool's distance from their middle lets one of them be near.
template <class View, ToolShape Shape>
void NearPatches::find_bricks(const View& view, const Shape& shape, const Posed& X, double reach) noexcept {
  const auto& grid = view.grid();
  bricks_.clear();
  X_bricks_ = X;
  brick_reach_ = reach;
  const ToolBounds bounds = shape.bounds();
  const Vec3d brick_size = BoneSurface<typename View::Density>::kBrick * grid.spacing();
  const Vec3d p = X.translation(), u = X.linear().col(2);
  // Patches reach beyond their edges' bricks by less than two voxels.
  const double margin = reach + 2 * grid.spacing().maxCoeff();
  const Vec3d end_low = p + bounds.z_low * u, end_high = p + bounds.z_high * u;
  struct Box {
    std::array<int, 3> lo, hi;
  };
  Box all;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double last = grid.bricks()[i] - 1, pad = bounds.radius + margin;
    all.lo[i] = static_cast<int>(std::clamp((std::min(end_low[a], end_high[a]) - pad) / brick_size[a], 0.0, last));
    all.hi[i] = static_cast<int>(std::clamp((std::max(end_low[a], end_high[a]) + pad) / brick_size[a], 0.0, last));
  }
  constexpr std::size_t kDeep = 64;  // each halving leaves one box behind, and 3 · 16 halvings are more than int has
  std::array<Box, kDeep> stack;
  std::size_t top = 0;
  stack[top++] = all;
  while (top > 0) {
    const Box box = stack[--top];
    const Vec3d lo = brick_size.cwiseProduct(Vec3d(box.lo[0], box.lo[1], box.lo[2]));
    const Vec3d hi = brick_size.cwiseProduct(Vec3d(box.hi[0] + 1, box.hi[1] + 1, box.hi[2] + 1));
    const Vec3d middle = 0.5 * (lo + hi) - p;
    const double z = middle.dot(u);
    const double rho = std::sqrt(std::max(0.0, middle.squaredNorm() - z * z));
    if (!(shape.at(rho, z).distance <= 0.5 * (hi - lo).norm() + margin)) continue;
    std::size_t longest = 0;
    for (std::size_t a = 1; a < 3; ++a)
      if (box.hi[a] - box.lo[a] > box.hi[longest] - box.lo[longest]) longest = a;
    if (box.hi[longest] == box.lo[longest]) {
      if (bricks_.size() == kMostBricks) {
        brick_reach_ = -1;
        return;
      }
      bricks_.push_back({grid.brick_index(box.lo[0], box.lo[1], box.lo[2]), 0});
      continue;
    }
    const int half = (box.lo[longest] + box.hi[longest]) / 2;
    Box low = box, high = box;
    low.hi[longest] = half;
    high.lo[longest] = half + 1;
    stack[top++] = high;
    stack[top++] = low;
  }
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
  const Vec3d p = X.translation(), u = X.linear().col(2);
  const Vec3d half = 0.5 * BoneSurface<typename View::Density>::kBrick * grid.spacing();
  const double margin = half.norm() + reach + 2 * grid.spacing().maxCoeff();
  for (NearBrick& b : bricks_) {
    b.version = grid.brick_version(b.brick);
    if (!surface.crosses(b.brick)) continue;
    const Vec3d middle = surface.corner(b.brick) + half - p;
    const double z = middle.dot(u);
    const double rho = std::sqrt(std::max(0.0, middle.squaredNorm() - z * z));
    if (!(shape.at(rho, z).distance <= margin)) continue;
    if (!surface.provide(b.brick)) return false;
    gather_brick(view, shape, b.brick);
    if (count_ == capacity_) return false;
  }
  valid_ = true;
  return true;
}

template <class View, ToolShape Shape>
void NearPatches::gather_brick(const View& view, const Shape& shape, std::size_t brick) noexcept {
  auto& surface = view.surface();
  const Vec3d corner = surface.corner(brick);
  const Vec3<float> from_T = (corner - X_.translation()).template cast<float>();
  const Vec3<float> u = X_.linear().col(2).template cast<float>();
  const auto most = static_cast<float>(reach_);
  surface.for_each_block(brick, [&](const PatchBlock& block, int count) {
    using Lanes = Eigen::Array<float, kLane, 1>;
    std::array<float, PatchBlock::kSize> beyond;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); i += kLane) {
      const Lanes x = Eigen::Map<const Lanes>(block.x.data() + i) + from_T.x();
      const Lanes y = Eigen::Map<const Lanes>(block.y.data() + i) + from_T.y();
      const Lanes z = Eigen::Map<const Lanes>(block.z.data() + i) + from_T.z();
      const Lanes along = x * u.x() + y * u.y() + z * u.z();
      const Lanes rho = (x.square() + y.square() + z.square() - along.square()).max(0.0F).sqrt();
      shape.distances(rho.data(), along.data(), beyond.data() + i, std::size_t{kLane});
    }
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      if (!(beyond[i] - block.spread[i] <= most) || count_ == capacity_) continue;
      const std::size_t n = count_++;
      Patch& patch = patches_[n];
      static_cast<SurfacePatch&>(patch) = surface.patch(block, i, corner);
      patch.key = (static_cast<std::uint64_t>(brick) << 16) | block.edge[i];
      x_[n] = block.x[i] + from_T.x();
      y_[n] = block.y[i] + from_T.y();
      z_[n] = block.z[i] + from_T.z();
      spread_of_[n] = block.spread[i];
    }
  });
}

}  // namespace trephine
