// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
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
    // Square to the axis, without cancellation.
    const float qx = px - a * ux, qy = py - a * uy, qz = pz - a * uz;
    along[i] = a;
    rho[i] = qx * qx + qy * qy + qz * qz;
  }
  square_roots(rho);
  ProfileLanes<float> d;
  shape.distances(rho, along, d);
  std::copy(d.begin(), d.end(), out);
}

/// Centres of balls in lanes, about an origin [m], and their distances from a tool.
class BallLanes {
 public:
  void reserve(std::size_t balls) {
    for (auto* v : {&x_, &y_, &z_, &distance_}) v->resize(balls + kProfileLanes);
  }
  void set(std::size_t i, const Vec3<float>& p) noexcept {
    x_[i] = p.x();
    y_[i] = p.y();
    z_[i] = p.z();
  }
  /// How far ball i's centre is from the lanes' origin [m].
  [[nodiscard]] float arm(std::size_t i) const noexcept { return Vec3<float>(x_[i], y_[i], z_[i]).norm(); }
  [[nodiscard]] float distance(std::size_t i) const noexcept { return distance_[i]; }
  /// Finds the distances of the first `count` centres from a tool with its axis along u, the lanes' origin being at
  /// `shift` of the tool's.
  template <ToolShape Shape>
  void measure(const Shape& shape, const Vec3<float>& u, const Vec3<float>& shift, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; i += kProfileLanes)
      distances_from(shape, u, shift, x_.data() + i, y_.data() + i, z_.data() + i, distance_.data() + i);
  }

 private:
  std::vector<float> x_, y_, z_, distance_;
};

/// How far a tool may move before a element that does not touch comes to touch.
struct Clearance {
  double near = 0;    ///< distance of the elements of the list that do not touch [m], which are …
  double arm = 0;     ///< … at most this far from T's origin [m]
  ToolMotion others;  ///< motion that brings no element that is not in the list into touch; those are …
  double reach = 1;   ///< … at most this far from T's origin [m]

  /// Largest share of a motion that brings no element deeper into the tool than `deep` [m], but for those that touch.
  [[nodiscard]] double max_step_fraction(const ToolMotion& motion, double deep = 0) const noexcept {
    const auto share = [](double of, double whole) {
      return whole > 0 ? of / whole : std::numeric_limits<double>::infinity();
    };
    return std::min({share(near + deep, motion.at(arm)), share(others.shift + deep / 2, motion.shift),
                     share(others.turn + deep / 2 / reach, motion.turn)});
  }
};

/// A block of elements near the tool.
struct NearBlock {
  const ElementBlock* elements;
  int count;
  std::uint64_t brick;
  Vec3d corner;  ///< where the brick's voxel 0 lies, in G [m]

  [[nodiscard]] SurfaceElement element(std::size_t i) const noexcept { return elements->element(i, corner); }
  /// The voxel edge that a element is of, and its part: the same number in every list.
  [[nodiscard]] std::uint64_t key(std::size_t i) const noexcept { return brick << 20 | elements->edge[i]; }
};

/// Broad phase: the blocks of surface elements within a distance of the tool, kept while the tool stays near the pose
/// that they were gathered at and the bone is not cut there. One list a tool.
class BroadPhase {
 public:
  /// Takes memory for as many blocks as the bone's surface has. Elements touch from `touching` [m] outside the tool on.
  template <class View>
  void reserve(const View& view, double touching) {
    touching_ = touching;
    skipped_ = static_cast<float>(kSkipped * view.grid().spacing().minCoeff());
    blocks_.reserve(view.surface().block_count());
    balls_.reserve(view.surface().block_count());
    bricks_.reserve(kMostBricks);
    middles_.reserve(kMostBricks);
    invalidate();
  }

  void invalidate() noexcept {
    valid_ = false;
    blocks_.clear();
    brick_reach_ = {-1, 0};
  }

  /// Makes sure of every element that may touch a tool at X; where it has to look, it looks as far as the tool could
  /// touch after a motion by `ahead`, within kLeastReach and kMostReach. False where the bone's surface could not all
  /// be had in this tick.
  template <class View, ToolShape Shape>
  [[nodiscard]] bool cover(const View& view, const Shape& shape, const Posed& X, const ToolMotion& ahead) noexcept {
    // The same list again where another tool had the surface make or let go of blocks.
    if (is_current(view) && motion_between(X_, X).is_within(reach_))
      return changes_ == view.surface().changes() || gather(view, shape, X_, reach_);
    const double h = view.grid().spacing().minCoeff();
    const ToolMotion reach{std::clamp(ahead.shift, kLeastReach * h, kMostReach * h),
                           std::clamp(ahead.turn, kLeastTurn, kMostTurn)};
    const ToolMotion moved = motion_between(X_bricks_, X);
    if (stamp_ != view.grid().increase_stamp() ||
        !ToolMotion{moved.shift + reach.shift, moved.turn + reach.turn}.is_within(brick_reach_))
      find_bricks(view, shape, X, {reach.shift + kBrickReach * h, reach.turn + kMostTurn});
    return gather(view, shape, X, reach);
  }

  /// Whether no brick near the tool was cut since blocks were gathered.
  template <class View>
  [[nodiscard]] bool is_current(const View& view) noexcept {
    const auto& grid = view.grid();
    if (!valid_ || stamp_ != grid.increase_stamp()) return false;
    if (edits_ == grid.edit_count()) return true;
    for (const NearBrick& b : bricks_)
      if (grid.brick_version(b.brick) != b.version) return false;
    edits_ = grid.edit_count();
    return true;
  }

  /// Whether it is known that no element touches a tool that goes from X on by `motion`.
  template <class View>
  [[nodiscard]] bool is_empty_around(const View& view, const Posed& X, const ToolMotion& motion) noexcept {
    if (!blocks_.empty() || !is_current(view)) return false;
    const ToolMotion moved = motion_between(X_, X);
    return ToolMotion{moved.shift + motion.shift, moved.turn + motion.turn}.is_within(reach_);
  }

  /// Calls touches(block, i, shift) for each element that may have a point that touches the tool at X, points being no
  /// farther from their element's position than the share `extent` of its corners; `shift` is where its brick's corner
  /// lies from T's origin, in G. Returns the clearance of the others.
  template <ToolShape Shape, class Visit>
  Clearance for_each_touching(const Shape& shape, const Posed& X, double extent, Visit&& touches) noexcept {
    const Vec3d p = X.translation();
    const Vec3<float> u = X.linear().col(2).template cast<float>();
    const Vec3<float> moved = (X_.translation() - p).template cast<float>();
    const auto offset = static_cast<float>(touching_), share = static_cast<float>(extent);
    static_assert(kProfileLanes == ElementBlock::kSize);
    balls_.measure(shape, u, moved, blocks_.size());
    constexpr float kFar = std::numeric_limits<float>::max();
    float nearest = kFar;
    std::array<float, kProfileLanes> beyond;
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const NearBlock& block = blocks_[b];
      const ElementBlock& of = *block.elements;
      const float ball = balls_.distance(b) - of.radius - offset;
      if (ball > skipped_) {
        nearest = std::min(nearest, ball);
        continue;
      }
      const Vec3<float> shift = (block.corner - p).template cast<float>();
      distances_from(shape, u, shift, of.position[0].data(), of.position[1].data(), of.position[2].data(),
                     beyond.data());
      float least = kFar, free = kFar;
      for (std::size_t l = 0; l < kProfileLanes; ++l) beyond[l] -= share * of.spread[l] + offset;
      for (std::size_t l = 0; l < kProfileLanes; ++l) least = beyond[l] < least ? beyond[l] : least;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const float outside = beyond[l] < 0 ? kFar : beyond[l];
        free = outside < free ? outside : free;
      }
      nearest = std::min(nearest, free);
      if (least >= 0) continue;
      for (std::size_t i = 0; i < static_cast<std::size_t>(block.count); ++i)
        if (beyond[i] < 0) touches(block, i, shift);
    }
    const ToolMotion from = motion_between(X_, X);
    return {static_cast<double>(nearest),
            arm_ + from.shift,
            {std::max(0.0, reach_.shift - from.shift), std::max(0.0, reach_.turn - from.turn)},
            shape.bounds().arm()};
  }

  /// Counts the lists.
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

 private:
  static constexpr std::size_t kMostBricks = 16384;
  /// How far a list reaches beyond the tool [shortest spacings], and for turns of its axis [rad], so that most ticks
  /// need none anew.
  static constexpr double kLeastReach = 3, kMostReach = 8, kLeastTurn = 0.04, kMostTurn = 0.1;
  /// How much farther bricks are looked for [shortest spacings].
  static constexpr double kBrickReach = 16;
  /// Blocks that are farther from the tool than this are not looked into [shortest spacings].
  static constexpr double kSkipped = 0.5;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };

  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;

  std::vector<NearBlock> blocks_;
  BallLanes balls_;                     // about them, from the tool's origin where they were gathered
  std::vector<NearBrick> bricks_;       // that hold bone, in a wider reach
  BallLanes middles_;                   // of these, from the tool's origin where they were found
  Posed X_bricks_ = Posed::Identity();  // where bricks were found, and how far around
  ToolMotion brick_reach_{-1, 0};
  Posed X_ = Posed::Identity();  // where blocks were gathered, and how far around
  ToolMotion reach_;
  double arm_ = 0;       // of the blocks' farthest points, there [m]
  double touching_ = 0;  // [m]
  float skipped_ = 0;    // kSkipped [m]
  std::uint64_t stamp_ = 0;
  std::uint64_t edits_ = 0;
  std::uint64_t changes_ = 0;
  std::uint64_t generation_ = 0;
  bool valid_ = false;
};

/// Looks at boxes of 16³ bricks, at those of 4³ bricks that they consist of, then at the bricks of those that may be
/// near.
template <class View, ToolShape Shape>
void BroadPhase::find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  const auto& grid = view.grid();
  bricks_.clear();
  X_bricks_ = X;
  brick_reach_ = reach;
  const ToolBounds bounds = shape.bounds();
  const Vec3d size = BoneSurface<typename View::Density>::kBrick * grid.spacing();
  const Vec3d p = X.translation(), u = X.linear().col(2);
  // Elements reach beyond their edges' bricks by less than two voxels.
  const double margin = reach.shift + 2 * grid.spacing().maxCoeff();
  const Vec3d end_low = p + bounds.z_low * u, end_high = p + bounds.z_high * u;
  std::array<int, 3> lo, hi;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double last = grid.bricks()[i] - 1, pad = bounds.radius + margin + reach.turn * bounds.arm();
    lo[i] = static_cast<int>(std::clamp((std::min(end_low[a], end_high[a]) - pad) / size[a], 0.0, last));
    hi[i] = static_cast<int>(std::clamp((std::max(end_low[a], end_high[a]) + pad) / size[a], 0.0, last));
  }
  constexpr int kParts = 4;
  // Middles of parts in a layer [parts].
  constexpr std::array<float, kProfileLanes> kAlong{.5F, 1.5F, 2.5F, 3.5F, .5F, 1.5F, 2.5F, 3.5F,
                                                    .5F, 1.5F, 2.5F, 3.5F, .5F, 1.5F, 2.5F, 3.5F},
      kAcross{.5F, .5F, .5F, .5F, 1.5F, 1.5F, 1.5F, 1.5F, 2.5F, 2.5F, 2.5F, 2.5F, 3.5F, 3.5F, 3.5F, 3.5F};
  const Vec3<float> axis = u.template cast<float>();
  const auto turn = static_cast<float>(reach.turn);
  // Calls near(at) for those of the 4³ parts of a box, of `bricks` bricks along each side, that may be near.
  const auto for_each_near = [&](const std::array<int, 3>& box, int bricks, auto&& near) {
    const Vec3<float> part = (bricks * size).template cast<float>();
    const Vec3<float> from = (size.cwiseProduct(Vec3d(box[0], box[1], box[2])) - p).template cast<float>();
    const float most = 0.5F * part.norm() * (1 + turn) + static_cast<float>(margin);
    for (int k = 0; k < kParts; ++k) {
      std::array<float, kProfileLanes> x, y, z, d;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        x[l] = from.x() + kAlong[l] * part.x();
        y[l] = from.y() + kAcross[l] * part.y();
        z[l] = from.z() + (static_cast<float>(k) + 0.5F) * part.z();
      }
      distances_from(shape, axis, Vec3<float>::Zero(), x.data(), y.data(), z.data(), d.data());
      for (std::size_t l = 0; l < kProfileLanes; ++l) x[l] = x[l] * x[l] + y[l] * y[l] + z[l] * z[l];
      square_roots(x);
      for (std::size_t l = 0; l < kProfileLanes; ++l) d[l] -= most + turn * x[l];
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        if (d[l] > 0) continue;
        const auto i = static_cast<int>(l);
        near({box[0] + i % kParts * bricks, box[1] + i / kParts * bricks, box[2] + k * bricks});
      }
    }
  };
  const auto is_in = [&](const std::array<int, 3>& at) { return at[0] <= hi[0] && at[1] <= hi[1] && at[2] <= hi[2]; };
  const auto add_brick = [&](const std::array<int, 3>& at) {
    if (!is_in(at) || brick_reach_.shift < 0) return;
    const std::size_t brick = grid.brick_index(at[0], at[1], at[2]);
    // Air stays air until densities rise.
    if (!view.surface().has_bone(brick)) return;
    if (bricks_.size() == kMostBricks) {
      brick_reach_.shift = -1;
      return;
    }
    middles_.set(bricks_.size(), (view.surface().corner(brick) + 0.5 * size - p).template cast<float>());
    bricks_.push_back({brick, 0});
  };
  constexpr int kLarge = kParts * kParts;
  for (int k = lo[2]; k <= hi[2]; k += kLarge)
    for (int j = lo[1]; j <= hi[1]; j += kLarge)
      for (int i = lo[0]; i <= hi[0]; i += kLarge)
        for_each_near({i, j, k}, kParts, [&](const std::array<int, 3>& box) {
          if (is_in(box)) for_each_near(box, 1, add_brick);
        });
}

template <class View, ToolShape Shape>
bool BroadPhase::gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  const auto& grid = view.grid();
  auto& surface = view.surface();
  valid_ = false;
  blocks_.clear();
  ++generation_;
  X_ = X;
  reach_ = reach;
  arm_ = 0;
  stamp_ = grid.increase_stamp();
  edits_ = grid.edit_count();
  surface.begin_use();
  if (brick_reach_.shift < 0) return false;
  const std::uint64_t overruns = surface.overruns();
  const Vec3d p = X.translation();
  const Vec3<float> moved = (X_bricks_.translation() - p).template cast<float>();
  const Vec3<float> u = X.linear().col(2).template cast<float>();
  middles_.measure(shape, u, moved, bricks_.size());
  const auto turn = static_cast<float>(reach.turn), shift = static_cast<float>(reach.shift + touching_);
  const auto half = static_cast<float>(0.5 * (BoneSurface<typename View::Density>::kBrick * grid.spacing()).norm() +
                                       2 * grid.spacing().maxCoeff());
  const float most = half * (1 + turn) + shift + turn * moved.norm();
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    const std::size_t brick = bricks_[i].brick;
    bricks_[i].version = grid.brick_version(brick);
    if (!(middles_.distance(i) <= most + turn * middles_.arm(i)) || !surface.crosses(brick)) continue;
    if (!surface.provide(brick) || surface.overruns() != overruns) return false;
    const Vec3d corner = surface.corner(brick);
    surface.for_each_block(brick, [&](const ElementBlock& block, int count) {
      balls_.set(blocks_.size(), (corner - p).template cast<float>() + block.middle);
      blocks_.push_back({&block, count, brick, corner});
    });
  }
  // Balls about blocks are smaller than bricks.
  balls_.measure(shape, u, Vec3<float>::Zero(), blocks_.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const float arm = balls_.arm(i) + blocks_[i].elements->radius;
    if (balls_.distance(i) - blocks_[i].elements->radius > shift + turn * arm) continue;
    blocks_[kept] = blocks_[i];
    balls_.set(kept++, (blocks_[i].corner - p).template cast<float>() + blocks_[i].elements->middle);
    arm_ = std::max(arm_, static_cast<double>(arm));
  }
  blocks_.erase(blocks_.begin() + static_cast<std::ptrdiff_t>(kept), blocks_.end());
  changes_ = surface.changes();
  valid_ = true;
  return true;
}

}  // namespace trephine
