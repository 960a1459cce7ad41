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
  Vec3d corner;  ///< position of the brick's voxel 0, in G [m]

  [[nodiscard]] SurfaceElement element(std::size_t i) const noexcept { return elements->element(i, corner); }
  /// Number of element i, which is the same in every list: its brick, voxel edge and part.
  [[nodiscard]] std::uint64_t key(std::size_t i) const noexcept { return brick << 20 | elements->edge[i]; }
};

/// Broad phase: lists the surface elements near a tool, each with a bounding ball. It finds bricks near the tool, then
/// their blocks, then these blocks' elements.
///
/// A list stays valid while the tool stays within its reach of the pose at which it was gathered, and no brick near the
/// tool is cut. Each tool has a list of its own.
class BroadPhase {
 public:
  /// Allocates room for all elements of the bone's surface, 38 bytes each. Contact begins `contact_offset` [m] outside
  /// the tool.
  template <class View>
  void reserve(const View& view, double contact_offset) {
    blocks_.reserve(view.surface().block_count());
    block_spheres_.reserve(view.surface().block_count());
    const double h = view.grid().spacing().minCoeff();
    near_reach_ = {Constants::kNearReach * h, 0};
    const std::size_t most = view.surface().block_count() * ElementBlock::kSize;
    kept_blocks_.resize(view.surface().block_count());
    elements_.resize(most);
    candidates_.resize(most);
    spread_.resize(most + kProfileLanes);
    near_.resize(most + kProfileLanes);
    spheres_.reserve(most);
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
    valid_ = is_measured_ = false;
    count_ = 0;
    brick_reach_ = {-1, 0};
  }

  /// Makes the list hold every element that may be in contact with a tool at X. A new list reaches as far as some ticks
  /// of a tool that moves by `motion` a tick, within the bounds of `CoupledConstants`. Returns false if the surface
  /// could not provide all bricks in this tick.
  template <class View, ToolShape Shape>
  [[nodiscard]] bool update(const View& view, const Shape& shape, const Posed& X, const ToolMotion& motion) noexcept {
    // Another tool may have had the surface make or release blocks: then the same list is gathered again.
    if (is_current(view) && motion_between(X_gathered_, X).is_within(reach_))
      return surface_changes_ == view.surface().changes() || gather(view, shape, X_gathered_, reach_);
    const double h = view.grid().spacing().minCoeff();
    const ToolMotion reach{
        std::clamp(Constants::kReachTicks * motion.shift, Constants::kMinReach * h, Constants::kMaxReach * h),
        std::clamp(Constants::kReachTicks * motion.turn, Constants::kMinReachAngle, Constants::kMaxReachAngle)};
    if (increase_stamp_ != view.grid().increase_stamp() ||
        !(motion_between(X_bricks_, X) + reach).is_within(brick_reach_))
      find_bricks(view, shape, X, {reach.shift + Constants::kBrickReach * h, reach.turn + Constants::kBrickReachAngle});
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
    if (count_ > 0 || !is_current(view)) return false;
    return (motion_between(X_gathered_, X) + motion).is_within(reach_);
  }

  /// Calls visit(block, i, shift, n) for each element that may have a point in contact with a tool at X, a pose that
  /// the list holds. Returns the clearance of the others. Points lie no farther from their element's position than the
  /// fraction `extent` of its corners. `shift` is the corner of the element's brick less T's origin, in G [m].
  ///
  /// The elements are found anew where the tool has moved by more than `kNearReach` since: Newton's steps become
  /// smaller within a tick. Until then those that `leave_out(n, …)` named are not visited again.
  template <ToolShape Shape, class Visit>
  Clearance for_each_candidate(const Shape& shape, const Posed& X, double extent, Visit&& visit) noexcept {
    if (!is_measured_ || extent != extent_ || !motion_between(X_measured_, X).is_within(near_reach_))
      measure(shape, X, extent);
    else
      drop_left_out();
    for (std::size_t n = 0; n < candidate_count_; ++n) {
      const NearElement& e = elements_[candidates_[n]];
      const NearBlock& block = blocks_[e.block];
      visit(block, std::size_t{e.i}, to_float(block.corner - X.translation()), n);
    }
    const ToolMotion from = motion_between(X_gathered_, X);
    const double arm = elements_arm_ + from.shift;
    return {static_cast<double>(nearest_) - motion_between(X_measured_, X).at(arm),
            arm,
            {std::max(0.0, reach_.shift - from.shift), std::max(0.0, reach_.turn - from.turn)},
            shape.bounds().arm()};
  }

  /// Leaves out element n of the last visits if a small motion cannot bring it into contact: its points begin contact
  /// after `gap` [m] more. Only visits that found the elements anew tell distances that hold.
  void leave_out(std::size_t n, float gap) noexcept {
    if (!is_new_ || gap < near_[candidates_[n]]) return;
    nearest_ = std::min(nearest_, gap);
    candidates_[n] = kLeftOut;
  }

 private:
  using Constants = CoupledConstants;
  static constexpr float kFarAway = 1e6F;  // [m]
  static constexpr std::uint32_t kLeftOut = 0xFFFFFFFF;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };
  /// A block of which elements may be near, while the list is made.
  struct KeptBlock {
    std::uint32_t block;    // index in blocks_
    std::uint32_t is_near;  // bit i: its element i
    float arm;              // largest distance of its elements from the tool's origin [m]
    Vec3<float> origin;     // the brick's corner less the tool's origin [m]
  };
  struct NearElement {
    std::uint32_t block;  // index in blocks_
    std::uint32_t i;      // index in the block
  };

  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <ToolShape Shape>
  void list_elements(const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <ToolShape Shape>
  void measure(const Shape& shape, const Posed& X, double extent) noexcept;
  void drop_left_out() noexcept {
    if (!is_new_) return;
    is_new_ = false;
    const auto end = candidates_.begin() + static_cast<std::ptrdiff_t>(candidate_count_);
    candidate_count_ = static_cast<std::size_t>(std::remove(candidates_.begin(), end, kLeftOut) - candidates_.begin());
  }

  // Bricks that hold bone, within a reach of X_bricks_.
  std::vector<NearBrick> bricks_;
  SphereLanes brick_spheres_;  // about the tool's origin there
  Posed X_bricks_ = Posed::Identity();
  ToolMotion brick_reach_{-1, 0};  // a negative shift: no list

  // Their blocks, and the list of elements: within a reach of X_gathered_.
  std::vector<NearBlock> blocks_;
  SphereLanes block_spheres_;  // about the tool's origin there
  std::vector<KeptBlock> kept_blocks_;
  std::vector<NearElement> elements_;  // of which the first count_ are listed
  SphereLanes spheres_;                // of the elements, likewise
  std::vector<float> spread_;          // of each element's corners about its position [m]
  std::vector<float> near_;            // way of each element on a motion by near_reach_ [m]
  std::size_t count_ = 0;
  Posed X_gathered_ = Posed::Identity();
  ToolMotion reach_;
  double elements_arm_ = 0;    // largest distance of a listed element from T's origin there [m]
  double contact_offset_ = 0;  // [m]

  // Distances of the elements' points from a tool at X_measured_.
  std::vector<std::uint32_t> candidates_;  // elements near contact, of which the first candidate_count_ are set
  std::size_t candidate_count_ = 0;
  float nearest_ = 0;  // least distance of the others from contact [m]
  Posed X_measured_ = Posed::Identity();
  double extent_ = 0;         // of the points over their element
  bool is_measured_ = false;  // since the elements were gathered
  bool is_new_ = false;       // not reused yet: candidates may be left out
  ToolMotion near_reach_;     // motion after which they are measured anew

  std::uint64_t increase_stamp_ = 0;   // of the grid, when elements were gathered
  std::uint64_t edit_count_ = 0;       // of the grid, when the list was last found current
  std::uint64_t surface_changes_ = 0;  // of the surface, when elements were gathered
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

/// Makes the list for a tool at X: takes the blocks of the near bricks, and of these the elements within a reach of the
/// tool. Returns false if a brick could not be provided in this tick.
template <class View, ToolShape Shape>
bool BroadPhase::gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  const auto& grid = view.grid();
  auto& surface = view.surface();
  valid_ = false;
  blocks_.clear();
  count_ = 0;
  is_measured_ = false;
  X_gathered_ = X;
  reach_ = reach;
  elements_arm_ = 0;
  increase_stamp_ = grid.increase_stamp();
  edit_count_ = grid.edit_count();
  surface.begin_use();
  if (brick_reach_.shift < 0) return false;
  const std::uint64_t overruns = surface.overruns();
  const Vec3d p = X.translation();
  const Vec3<float> moved = to_float(X_bricks_.translation() - p);
  const Vec3<float> u = to_float(z_axis(X));
  const auto turn = static_cast<float>(reach.turn), shift = static_cast<float>(reach.shift + contact_offset_);
  brick_spheres_.measure(shape, u, moved, bricks_.size(), turn);
  const auto brick_radius =
      static_cast<float>(0.5 * (BoneSurface<typename View::Density>::kBrick * grid.spacing()).norm() +
                         Constants::kElementReach * grid.spacing().maxCoeff());
  const float max_distance = brick_radius * (1 + turn) + shift + turn * moved.norm();
  for (std::size_t i = 0; i < bricks_.size(); ++i) {
    const std::size_t brick = bricks_[i].brick;
    bricks_[i].version = grid.brick_version(brick);
    if (!(brick_spheres_.distance(i) <= max_distance) || !surface.crosses(brick)) continue;
    if (!surface.provide(brick) || surface.overruns() != overruns) return false;
    const Vec3d corner = surface.corner(brick);
    surface.for_each_block(brick, [&](const ElementBlock& block, int count) {
      block_spheres_.set_centre(blocks_.size(), to_float(corner - p) + block.middle);
      blocks_.push_back({&block, count, brick, corner});
    });
  }
  list_elements(shape, X, reach);
  surface_changes_ = surface.changes();
  valid_ = true;
  return true;
}

/// Lists the elements of the blocks that are within a reach of a tool at X, with bounding balls about its origin.
template <ToolShape Shape>
void BroadPhase::list_elements(const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept {
  const Vec3d p = X.translation();
  const Vec3<float> u = to_float(z_axis(X));
  const auto turn = static_cast<float>(reach.turn), shift = static_cast<float>(reach.shift + contact_offset_);
  block_spheres_.measure(shape, u, Vec3<float>::Zero(), blocks_.size(), turn);
  // No point of the tool's head goes farther than twice the same way.
  near_reach_.turn = near_reach_.shift / shape.bounds().radius;
  const auto [x, y, z] = spheres_.centres();
  float *const spread = spread_.data(), *const near_way = near_.data();
  const auto near_shift = static_cast<float>(near_reach_.shift), near_turn = static_cast<float>(near_reach_.turn);
  NearElement* const element = elements_.data();
  // The first two loops have no branches, so that a processor works on several blocks at once.
  std::size_t kept = 0;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const float radius = blocks_[b].elements->radius;
    kept_blocks_[kept].block = static_cast<std::uint32_t>(b);
    kept += block_spheres_.distance(b) - radius <= shift + turn * radius ? 1 : 0;
  }
  for (std::size_t i = 0; i < kept; ++i) {
    KeptBlock& k = kept_blocks_[i];
    const NearBlock& near_block = blocks_[k.block];
    const ElementBlock& block = *near_block.elements;
    k.origin = to_float(near_block.corner - p);
    // No element is farther from the tool's origin than this; while the list serves, than this and `shift`.
    k.arm = block_spheres_.arm(k.block) + block.radius;
    const float near = shift + turn * k.arm;
    ProfileLanes<float> distance;
    compute_distances(shape, u, k.origin, block.position[0].data(), block.position[1].data(), block.position[2].data(),
                      distance.data());
    for (std::size_t l = 0; l < kProfileLanes; ++l) distance[l] -= block.spread[l];
    k.is_near = detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return distance[l] <= near; }) &
                ((1U << near_block.count) - 1);
  }
  std::size_t n = 0;
  for (std::size_t i = 0; i < kept; ++i) {
    const KeptBlock& k = kept_blocks_[i];
    const ElementBlock& block = *blocks_[k.block].elements;
    if (k.is_near != 0) elements_arm_ = std::max(elements_arm_, static_cast<double>(k.arm));
    for (std::uint32_t is_near = k.is_near; is_near != 0; is_near &= is_near - 1, ++n) {
      const auto l = static_cast<std::size_t>(std::countr_zero(is_near));
      x[n] = block.position[0][l] + k.origin.x();
      y[n] = block.position[1][l] + k.origin.y();
      z[n] = block.position[2][l] + k.origin.z();
      spread[n] = block.spread[l];
      near_way[n] = near_shift + near_turn * (k.arm + shift);
      element[n] = {k.block, static_cast<std::uint32_t>(l)};
    }
  }
  // Lanes beyond the last element are far away.
  count_ = n;
  for (; n % kProfileLanes != 0; ++n) {
    x[n] = y[n] = z[n] = kFarAway;
    spread[n] = near_way[n] = 0;
  }
}

/// Measures the listed elements' distances from a tool at X, and finds those that may come into contact within
/// near_reach_.
template <ToolShape Shape>
void BroadPhase::measure(const Shape& shape, const Posed& X, double extent) noexcept {
  spheres_.measure(shape, to_float(z_axis(X)), to_float(X_gathered_.translation() - X.translation()), count_);
  X_measured_ = X;
  extent_ = extent;
  is_measured_ = is_new_ = true;
  candidate_count_ = 0;
  const auto offset = static_cast<float>(contact_offset_), fraction = static_cast<float>(extent);
  // Least distances of an element's points beyond the offset [m].
  ProfileLanes<float> gap, nearest;
  nearest.fill(std::numeric_limits<float>::max());
  for (std::size_t first = 0; first < count_; first += kProfileLanes) {
    const float* const distance = spheres_.distances() + first;
    const float* const spread = spread_.data() + first;
    const float* const near = near_.data() + first;
    for (std::size_t l = 0; l < kProfileLanes; ++l) gap[l] = distance[l] - fraction * spread[l] - offset;
    for (std::size_t l = 0; l < kProfileLanes; ++l) {
      const float free_gap = gap[l] < near[l] ? std::numeric_limits<float>::max() : gap[l];
      nearest[l] = free_gap < nearest[l] ? free_gap : nearest[l];
    }
    std::uint32_t is_near = detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return gap[l] < near[l]; });
    for (; is_near != 0; is_near &= is_near - 1)
      candidates_[candidate_count_++] =
          static_cast<std::uint32_t>(first) + static_cast<std::uint32_t>(std::countr_zero(is_near));
  }
  nearest_ = *std::min_element(nearest.begin(), nearest.end());
}

}  // namespace trephine
