// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/clearance.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/tool_distances.hpp>
#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/bone_surface.hpp>
#include <trephine/voxel/lane_bits.hpp>

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace trephine {

/// A block of surface elements near the tool.
struct NearBlock {
  const ElementBlock* elements;
  int count;  ///< elements of the block that are set
  std::uint64_t brick;
  Vec3d corner;   ///< position of the brick's voxel 0, in G [m]
  float arm = 0;  ///< no element is farther than this from T's origin at the pose of the list [m]

  [[nodiscard]] SurfaceElement element(std::size_t i) const noexcept { return elements->element(i, corner); }
  /// Number of element i, which is the same in every list: its brick, voxel edge and part.
  [[nodiscard]] std::uint64_t key(std::size_t i) const noexcept { return brick << 20 | elements->edge[i]; }
};

/// Broad phase: lists the blocks of surface elements near a tool.
///
/// A list stays valid while the tool stays within its reach of the pose at which it was gathered, and no brick near the
/// tool is cut. Each tool has a list of its own.
class BroadPhase {
 public:
  /// Allocates room for all blocks of the bone's surface. Contact begins `contact_offset` [m] outside the tool.
  template <class View>
  void reserve(const View& view, double contact_offset) {
    const double h = view.grid().spacing().minCoeff();
    skipped_distance_ = static_cast<float>(Constants::kSkippedDistance * h);
    near_reach_ = Constants::kNearReach * h;
    blocks_.reserve(view.surface().block_count());
    block_spheres_.reserve(view.surface().block_count());
    bricks_.reserve(Constants::kMaxBricks);
    brick_spheres_.reserve(Constants::kMaxBricks);
    set_contact_offset(contact_offset);
  }

  /// Contact begins `offset` [m] outside the tool. Empties the lists.
  void set_contact_offset(double offset) noexcept {
    contact_offset_ = offset;
    invalidate();
  }

  /// Empties the lists, so that the next `update` gathers them anew.
  void invalidate() noexcept {
    valid_ = false;
    blocks_.clear();
    brick_reach_ = {-1, 0};
  }

  /// Makes the list hold every element that may be in contact with a tool at X. A new list reaches as far as a motion
  /// by `ahead` from there, within the bounds of `CoupledConstants`. Returns false if the surface could not provide all
  /// bricks in this tick.
  template <class View, ToolShape Shape>
  [[nodiscard]] bool update(const View& view, const Shape& shape, const Posed& X, const ToolMotion& ahead) noexcept {
    // Another tool may have had the surface make or release blocks: then the same list is gathered again.
    if (is_current(view) && motion_between(X_gathered_, X).is_within(reach_))
      return surface_changes_ == view.surface().changes() || gather(view, shape, X_gathered_, reach_);
    const double h = view.grid().spacing().minCoeff();
    const ToolMotion reach{std::clamp(ahead.shift, Constants::kMinReach * h, Constants::kMaxReach * h),
                           std::clamp(ahead.turn, Constants::kMinReachAngle, Constants::kMaxReachAngle)};
    const ToolMotion moved = motion_between(X_bricks_, X);
    if (increase_stamp_ != view.grid().increase_stamp() || !(moved + reach).is_within(brick_reach_))
      find_bricks(view, shape, X, {reach.shift + Constants::kBrickReach * h, reach.turn + Constants::kMaxReachAngle});
    return gather(view, shape, X, reach);
  }

  /// Returns true if no brick near the tool was cut since the blocks were gathered.
  template <class View>
  [[nodiscard]] bool is_current(const View& view) noexcept {
    const auto& grid = view.grid();
    if (!valid_ || increase_stamp_ != grid.increase_stamp()) return false;
    if (edit_count_ == grid.edit_count()) return true;
    for (const NearBrick& b : bricks_)
      if (grid.brick_version(b.brick) != b.version) return false;
    edit_count_ = grid.edit_count();
    return true;
  }

  /// Returns true if the list proves that a tool at X stays free of contact on a motion by `motion`.
  template <class View>
  [[nodiscard]] bool is_empty_around(const View& view, const Posed& X, const ToolMotion& motion) noexcept {
    if (!blocks_.empty() || !is_current(view)) return false;
    return (motion_between(X_gathered_, X) + motion).is_within(reach_);
  }

  /// Reach of a list of elements (`NearElements`): no point of the tool's head goes farther than twice the same way.
  template <ToolShape Shape>
  [[nodiscard]] ToolMotion near_reach(const Shape& shape) const noexcept {
    return {near_reach_, near_reach_ / shape.bounds().radius};
  }

  /// Clearance of a tool at X, as far as the list's reach tells; without the distance of listed elements.
  template <ToolShape Shape>
  [[nodiscard]] Clearance clearance(const Shape& shape, const Posed& X) const noexcept {
    const ToolMotion from = motion_between(X_gathered_, X);
    return {0,
            blocks_arm_ + from.shift,
            {std::max(0.0, reach_.shift - from.shift), std::max(0.0, reach_.turn - from.turn)},
            shape.bounds().arm()};
  }

  /// Calls visit(block, i, shift) for each element that may have a point in contact with a tool within `reach` of X.
  /// Returns the clearance of the others at X. Points lie no farther from their element's position than the fraction
  /// `extent` of its corners. `shift` is the corner of the element's brick less T's origin, in G [m].
  template <ToolShape Shape, class Visit>
  Clearance for_each_candidate(const Shape& shape, const Posed& X, double extent, const ToolMotion& reach,
                               Visit&& visit) noexcept {
    const Vec3d p = X.translation();
    const Vec3<float> u = to_float(z_axis(X));
    const Vec3<float> moved = to_float(X_gathered_.translation() - p);
    const auto offset = static_cast<float>(contact_offset_), fraction = static_cast<float>(extent);
    static_assert(kProfileLanes == ElementBlock::kSize);
    block_spheres_.measure(shape, u, moved, blocks_.size());
    constexpr float kFar = std::numeric_limits<float>::max();
    float nearest_block = kFar;
    // Least distances of an element's points beyond the offset [m]: of a block, and of all elements left out.
    std::array<float, kProfileLanes> gap, nearest;
    nearest.fill(kFar);
    const auto turn = static_cast<float>(reach.turn),
               reach_here = static_cast<float>(reach.shift) + turn * moved.norm();
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const NearBlock& block = blocks_[b];
      const ElementBlock& elements = *block.elements;
      const float block_gap = block_spheres_.distance(b) - elements.radius - offset;
      const float near = reach_here + turn * block.arm;
      if (block_gap > std::max(skipped_distance_, near)) {
        nearest_block = std::min(nearest_block, block_gap);
        continue;
      }
      const Vec3<float> shift = to_float(block.corner - p);
      compute_distances(shape, u, shift, elements.position[0].data(), elements.position[1].data(),
                        elements.position[2].data(), gap.data());
      for (std::size_t l = 0; l < kProfileLanes; ++l) gap[l] -= fraction * elements.spread[l] + offset;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const float free_gap = gap[l] < near ? kFar : gap[l];
        nearest[l] = free_gap < nearest[l] ? free_gap : nearest[l];
      }
      std::uint32_t is_near = detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return gap[l] < near; });
      for (is_near &= (1U << block.count) - 1; is_near != 0; is_near &= is_near - 1)
        visit(block, static_cast<std::size_t>(std::countr_zero(is_near)), shift);
    }
    Clearance others = clearance(shape, X);
    others.listed_distance =
        static_cast<double>(std::min(nearest_block, *std::min_element(nearest.begin(), nearest.end())));
    return others;
  }

  /// Number of lists gathered so far.
  [[nodiscard]] std::uint64_t generation() const noexcept { return generation_; }

 private:
  using Constants = CoupledConstants;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };

  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;

  std::vector<NearBlock> blocks_;
  SphereLanes block_spheres_;             // about the tool's origin at X_gathered_
  std::vector<NearBrick> bricks_;         // that hold bone, within brick_reach_
  SphereLanes brick_spheres_;             // about the tool's origin at X_bricks_
  Posed X_bricks_ = Posed::Identity();    // pose at which bricks were found
  ToolMotion brick_reach_{-1, 0};         // reach of that list; a negative shift: no list
  Posed X_gathered_ = Posed::Identity();  // pose at which blocks were gathered
  ToolMotion reach_;                      // reach of that list
  double blocks_arm_ = 0;                 // largest distance of a listed element from T's origin there [m]
  double contact_offset_ = 0;             // [m]
  float skipped_distance_ = 0;            // [m]
  double near_reach_ = 0;                 // [m]
  std::uint64_t increase_stamp_ = 0;      // of the grid, when blocks were gathered
  std::uint64_t edit_count_ = 0;          // of the grid, when the list was last found current
  std::uint64_t surface_changes_ = 0;     // of the surface, when blocks were gathered
  std::uint64_t generation_ = 0;
  bool valid_ = false;
};

/// Lists the bricks of bone within a reach of the tool: finds the boxes of 4³ bricks that may be near, then those of
/// their bricks that hold bone and may be near.
template <class View, ToolShape Shape>
void BroadPhase::find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  using Surface = BoneSurface<typename View::Density>;
  using Index = std::array<int, 3>;
  const auto& grid = view.grid();
  auto& surface = view.surface();
  bricks_.clear();
  X_bricks_ = X;
  brick_reach_ = reach;
  const Vec3d p = X.translation(), u = z_axis(X);
  const Vec3<float> axis = to_float(u);
  const double margin = reach.shift + Constants::kElementReach * grid.spacing().maxCoeff();
  const auto turn = static_cast<float>(reach.turn);
  // Centres of the part at an index of parts with these sides [m], and the distance of such parts that are near.
  const Vec3<float> brick_size = to_float(Surface::kBrick * grid.spacing());
  const Vec3<float> box_size = static_cast<float>(Surface::kBox) * brick_size, corner = to_float(-p);
  const auto centre = [&](const Index& at, const Vec3<float>& size) {
    return Vec3<float>(corner.x() + (static_cast<float>(at[0]) + 0.5F) * size.x(),
                       corner.y() + (static_cast<float>(at[1]) + 0.5F) * size.y(),
                       corner.z() + (static_cast<float>(at[2]) + 0.5F) * size.z());
  };
  const auto max_distance = [&](const Vec3<float>& size) {
    return 0.5F * size.norm() * (1 + turn) + static_cast<float>(margin);
  };

  SphereBatch<Index> boxes, bricks;
  const auto flush_bricks = [&] {
    bricks.flush(shape, axis, max_distance(brick_size), turn, [&](const Index& at, const Vec3<float>& middle) {
      const std::size_t brick = grid.brick_index(at[0], at[1], at[2]);
      // A brick of air stays air until densities rise, and then bricks are found anew.
      if (brick_reach_.shift < 0 || !surface.has_bone(brick)) return;
      if (bricks_.size() == Constants::kMaxBricks) {
        brick_reach_.shift = -1;
        return;
      }
      brick_spheres_.set_centre(bricks_.size(), middle);
      bricks_.push_back({brick, 0});
    });
  };
  const auto flush_boxes = [&] {
    boxes.flush(shape, axis, max_distance(box_size), turn, [&](const Index& box, const Vec3<float>&) {
      surface.for_each_brick_of_bone(box, [&](const Index& at) {
        bricks.add(centre(at, brick_size), at);
        if (bricks.is_full()) flush_bricks();
      });
    });
  };

  const ToolBounds bounds = shape.bounds();
  const double pad = bounds.radius + margin + reach.turn * bounds.arm();
  const Vec3d end_low = p + bounds.z_low * u, end_high = p + bounds.z_high * u;
  Index first, last;
  for (int a = 0; a < 3; ++a) {
    const auto i = static_cast<std::size_t>(a);
    const double size = Surface::kBox * Surface::kBrick * grid.spacing()[a],
                 end = (grid.bricks()[i] - 1) / Surface::kBox;
    first[i] = static_cast<int>(std::clamp((std::min(end_low[a], end_high[a]) - pad) / size, 0.0, end));
    last[i] = static_cast<int>(std::clamp((std::max(end_low[a], end_high[a]) + pad) / size, 0.0, end));
  }
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) {
        boxes.add(centre({i, j, k}, box_size), {i, j, k});
        if (boxes.is_full()) flush_boxes();
      }
  flush_boxes();
  flush_bricks();
}

/// Lists the blocks of the near bricks that are within a reach of the tool. Returns false if a brick could not be
/// provided in this tick.
template <class View, ToolShape Shape>
bool BroadPhase::gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  const auto& grid = view.grid();
  auto& surface = view.surface();
  valid_ = false;
  blocks_.clear();
  ++generation_;
  X_gathered_ = X;
  reach_ = reach;
  blocks_arm_ = 0;
  increase_stamp_ = grid.increase_stamp();
  edit_count_ = grid.edit_count();
  surface.begin_use();
  if (brick_reach_.shift < 0) return false;
  const std::uint64_t overruns = surface.overruns();
  const Vec3d p = X.translation();
  const Vec3<float> moved = to_float(X_bricks_.translation() - p);
  const Vec3<float> u = to_float(z_axis(X));
  brick_spheres_.measure(shape, u, moved, bricks_.size());
  const auto turn = static_cast<float>(reach.turn), shift = static_cast<float>(reach.shift + contact_offset_);
  const auto brick_radius =
      static_cast<float>(0.5 * (BoneSurface<typename View::Density>::kBrick * grid.spacing()).norm() +
                         Constants::kElementReach * grid.spacing().maxCoeff());
  const float max_distance = brick_radius * (1 + turn) + shift + turn * moved.norm();
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    const std::size_t brick = bricks_[i].brick;
    bricks_[i].version = grid.brick_version(brick);
    if (!(brick_spheres_.distance(i) <= max_distance + turn * brick_spheres_.arm(i)) || !surface.crosses(brick))
      continue;
    if (!surface.provide(brick) || surface.overruns() != overruns) return false;
    const Vec3d corner = surface.corner(brick);
    surface.for_each_block(brick, [&](const ElementBlock& block, int count) {
      block_spheres_.set_centre(blocks_.size(), to_float(corner - p) + block.middle);
      blocks_.push_back({&block, count, brick, corner, 0});
    });
  }
  // Keeps blocks whose own spheres are within reach: these are smaller than their bricks'.
  block_spheres_.measure(shape, u, Vec3<float>::Zero(), blocks_.size());
  std::size_t kept = 0;
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const float arm = block_spheres_.arm(i) + blocks_[i].elements->radius;
    if (block_spheres_.distance(i) - blocks_[i].elements->radius > shift + turn * arm) continue;
    blocks_[kept] = blocks_[i];
    blocks_[kept].arm = arm;
    block_spheres_.set_centre(kept++, to_float(blocks_[i].corner - p) + blocks_[i].elements->middle);
    blocks_arm_ = std::max(blocks_arm_, static_cast<double>(arm));
  }
  blocks_.erase(blocks_.begin() + static_cast<std::ptrdiff_t>(kept), blocks_.end());
  surface_changes_ = surface.changes();
  valid_ = true;
  return true;
}

}  // namespace trephine
