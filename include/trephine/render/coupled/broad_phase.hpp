// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/element_list.hpp>
#include <trephine/render/coupled/tool_distances.hpp>
#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/bone_surface.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <numbers>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

/// Upper bound on the bricks of bone's surface about a tool's head: a cut, or motion into new bone, leaves no more to
/// compute anew. They meet a layer about the head's bounding cylinder, as thick as the reach of a list and a brick with
/// its halo.
[[nodiscard]] inline int bricks_about_head(const ToolBounds& tool, const Vec3d& spacing) noexcept {
  constexpr int kBrick = VoxelGrid<std::uint8_t>::kBrick;
  const double layer = (0.5 * kBrick + 1) * spacing.norm() + CoupledConstants::kMaxReach * spacing.minCoeff();
  const auto volume = [&](double more) {
    const double radius = std::max(0.0, tool.radius + more), height = tool.head_top - tool.z_low + 2 * more;
    return std::numbers::pi * radius * radius * std::max(0.0, height);
  };
  const double bricks = (volume(layer) - volume(-layer)) / (std::pow(kBrick, 3) * spacing.prod());
  return static_cast<int>(std::min(std::ceil(bricks), 1e9));
}

/// Broad phase: finds the bricks of bone near a tool, then their blocks, and has these blocks' elements listed.
///
/// A list stays valid while the tool stays within its reach of the pose at which it was gathered, and no brick near the
/// tool is cut. Each tool has a list of its own.
class BroadPhase {
 public:
  /// Allocates room for all bricks of the bone and all elements of its surface. Contact begins `contact_offset` [m]
  /// outside the tool, with elements of level 0.
  template <class View>
  void reserve(const View& view, double contact_offset) {
    elements_.reserve(view.surface().block_count());
    bricks_.reserve(view.grid().brick_count());
    brick_spheres_.reserve(view.grid().brick_count());
    set_contact(contact_offset, 0);
  }

  /// Contact begins `offset` [m] outside the tool, with elements of a level (`ElementSize`). Empties the lists.
  void set_contact(double offset, int level) noexcept {
    elements_.set_contact_offset(offset);
    level_ = level;
    invalidate();
  }

  /// Empties the lists, so that the next `update` gathers them anew.
  void invalidate() noexcept {
    valid_ = false;
    elements_.clear();
    brick_reach_ = {-1, 0};
  }

  /// Takes the lists of a broad phase in other bone with the same densities, of which `view` is this one's. The tool is
  /// the same.
  template <class View, ToolShape Shape>
  void take(const BroadPhase& other, const View& other_view, const View& view, const Shape& shape) {
    bricks_ = other.bricks_;
    brick_spheres_.take_centres(other.brick_spheres_, bricks_.size());
    X_bricks_ = other.X_bricks_;
    brick_reach_ = other.brick_reach_;
    elements_.set_contact_offset(other.elements_.contact_offset());
    level_ = other.level_;
    elements_.begin(other.elements_.pose(), other.elements_.reach());
    const bool same = other.increase_stamp_ == other_view.grid().increase_stamp();
    increase_stamp_ = same ? view.grid().increase_stamp() : 0;
    valid_ = false;
    if (!other.waits_ && other.is_unchanged(other_view)) {
      view.surface().begin_tick(std::numeric_limits<int>::max());
      if (!gather(view, shape, other.elements_.pose(), other.elements_.reach())) invalidate();
    }
    view.surface().take_waiting(other_view.surface());
  }

  /// Makes the list hold every element that may be in contact with a tool at X. A new list reaches as far as some ticks
  /// of a tool that moves by `motion` a tick, within the bounds of `CoupledConstants`. Returns false if the surface
  /// could not provide all bricks in this tick.
  template <class View, ToolShape Shape>
  [[nodiscard]] bool update(const View& view, const Shape& shape, const Posed& X, const ToolMotion& motion) noexcept {
    // Another tool may have had the surface make or release blocks: then the same list is gathered again.
    if (is_current(view) && motion_between(elements_.pose(), X).is_within(elements_.reach()))
      return elements_.is_empty() || surface_changes_ == view.surface().changes() ||
             gather(view, shape, elements_.pose(), elements_.reach());
    const double h = view.grid().spacing().minCoeff();
    const double least = Constants::kMinReach * std::ldexp(h, level_);
    const ToolMotion reach{
        std::clamp(Constants::kReachTicks * motion.shift, least, std::max(least, Constants::kMaxReach * h)),
        std::clamp(Constants::kReachTicks * motion.turn, Constants::kMinReachAngle, Constants::kMaxReachAngle)};
    if (increase_stamp_ != view.grid().increase_stamp() ||
        !(motion_between(X_bricks_, X) + reach).is_within(brick_reach_))
      find_bricks(view, shape, X, {reach.shift + Constants::kBrickReach * h, reach.turn + Constants::kBrickReachAngle});
    return gather(view, shape, X, reach);
  }

  /// Makes an empty list: no element is within `reach` of a tool at X.
  template <class View>
  void set_empty(const View& view, const Posed& X, const ToolMotion& reach) noexcept {
    begin_list(view, X, reach);
    bricks_.clear();
    brick_reach_ = {-1, 0};
    valid_ = true;
  }

  /// Returns true if no brick near the tool was cut since the blocks were gathered.
  template <class View>
  [[nodiscard]] bool is_current(const View& view) noexcept {
    if (!is_unchanged(view)) return false;
    edit_count_ = view.grid().edit_count();
    return true;
  }

  /// Returns true if the list proves that a tool at X stays free of contact on a motion by `motion`.
  template <class View>
  [[nodiscard]] bool is_empty_around(const View& view, const Posed& X, const ToolMotion& motion) noexcept {
    if (!elements_.is_empty() || !is_current(view)) return false;
    return (motion_between(elements_.pose(), X) + motion).is_within(elements_.reach());
  }

  /// Returns the list that `update` made.
  [[nodiscard]] ElementList& elements() noexcept { return elements_; }

 private:
  using Constants = CoupledConstants;
  struct NearBrick {
    std::size_t brick;
    std::uint32_t version;
  };
  template <class View>
  [[nodiscard]] bool is_unchanged(const View& view) const noexcept {
    const auto& grid = view.grid();
    if (!valid_ || increase_stamp_ != grid.increase_stamp()) return false;
    // What waits in this tick waits to its end.
    if (edit_count_ == grid.edit_count() && (!waits_ || tick_ == view.surface().tick())) return true;
    return std::none_of(bricks_.begin(), bricks_.end(),
                        [&](const NearBrick& b) { return grid.brick_version(b.brick) != b.version; });
  }
  /// Empties the list of elements, which is then for a tool at X and the grid as it is.
  template <class View>
  void begin_list(const View& view, const Posed& X, const ToolMotion& reach) noexcept {
    valid_ = false;
    elements_.begin(X, reach);
    increase_stamp_ = view.grid().increase_stamp();
    edit_count_ = view.grid().edit_count();
    tick_ = view.surface().tick();
    waits_ = false;
  }
  template <class View, ToolShape Shape>
  void find_bricks(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;
  template <class View, ToolShape Shape>
  [[nodiscard]] bool gather(const View& view, const Shape& shape, const Posed& X, const ToolMotion& reach) noexcept;

  // Bricks that hold bone, within a reach of X_bricks_.
  std::vector<NearBrick> bricks_;
  SphereLanes brick_spheres_;  // about the tool's origin there
  Posed X_bricks_ = Posed::Identity();
  ToolMotion brick_reach_{-1, 0};  // a negative shift: no list

  ElementList elements_;
  int level_ = 0;                      // of the elements
  std::uint64_t increase_stamp_ = 0;   // of the grid, when elements were gathered
  std::uint64_t edit_count_ = 0;       // of the grid, when the list was last found current
  std::uint64_t surface_changes_ = 0;  // of the surface, when elements were gathered
  std::uint64_t tick_ = 0;             // of the surface, when elements were gathered
  bool waits_ = false;                 // a brick was then not up to date
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
      if (!surface.has_bone(brick)) return;
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
  begin_list(view, X, reach);
  surface.begin_use(level_);
  const std::uint64_t overruns = surface.overruns();
  const Vec3d p = X.translation();
  const Vec3<float> moved = to_float(X_bricks_.translation() - p);
  const Vec3<float> u = to_float(z_axis(X));
  const auto turn = static_cast<float>(reach.turn),
             shift = static_cast<float>(reach.shift + elements_.contact_offset());
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
    // A list with a brick that waits for its turn serves this tick alone, though nothing be cut.
    bricks_[i].version = surface.provided_version(brick);
    waits_ = waits_ || bricks_[i].version != grid.brick_version(brick);
    const Vec3d corner = surface.corner(brick);
    surface.for_each_block(brick, [&](const ElementBlock& block, int count) {
      elements_.add({&block, count, brick, corner});
    });
  }
  elements_.make(shape);
  surface_changes_ = surface.changes();
  valid_ = true;
  return true;
}

}  // namespace trephine
