// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/render/coupled/clearance.hpp>
#include <trephine/render/coupled/coupled_constants.hpp>
#include <trephine/render/coupled/tool_distances.hpp>
#include <trephine/tool/tool_shape.hpp>
#include <trephine/voxel/lane_bits.hpp>
#include <trephine/voxel/surface_element.hpp>

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

namespace trephine::inline TREPHINE_ALIGNED {

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

/// List of the surface elements within a reach of a tool, each with a bounding ball. At a pose within the reach it
/// finds the candidates: those that may be in contact there.
class ElementList {
 public:
  /// Allocates room for the elements of `blocks` blocks, 28 bytes each.
  void reserve(std::size_t blocks) {
    blocks_.reserve(blocks);
    block_spheres_.reserve(blocks);
    kept_blocks_.resize(blocks);
    const std::size_t most = blocks * ElementBlock::kSize;
    elements_.resize(most);
    spread_.resize(most + kProfileLanes);
    spheres_.reserve(most);
  }

  /// Contact begins `offset` [m] outside the tool. Empties the list.
  void set_contact_offset(double offset) noexcept {
    contact_offset_ = offset;
    clear();
  }
  [[nodiscard]] double contact_offset() const noexcept { return contact_offset_; }
  void clear() noexcept { begin(X_, reach_); }

  /// Starts a list for a tool at X, which serves while the tool moves by no more than `reach`.
  void begin(const Posed& X, const ToolMotion& reach) noexcept {
    X_ = X;
    reach_ = reach;
    blocks_.clear();
    count_ = 0;
    arm_ = 0;
  }
  /// Takes a block that may have elements within the reach.
  void add(const NearBlock& block) noexcept {
    block_spheres_.set_centre(blocks_.size(), to_float(block.corner - X_.translation()) + block.elements->middle);
    blocks_.push_back(block);
  }
  /// Ends a list: takes those elements of the blocks that are within the reach of the tool.
  template <ToolShape Shape>
  void make(const Shape& shape) noexcept;

  [[nodiscard]] bool is_empty() const noexcept { return count_ == 0; }
  /// Pose for which the list was made, and motion from there that it serves.
  [[nodiscard]] const Posed& pose() const noexcept { return X_; }
  [[nodiscard]] const ToolMotion& reach() const noexcept { return reach_; }

  /// Calls visit(block, i, shift) for each element that may have a point in contact with a tool at X, a pose that the
  /// list holds. Returns the clearance of the others. Points lie no farther from their element's position than the
  /// fraction `extent` of its corners. `shift` is the corner of the element's brick less T's origin, in G [m].
  template <ToolShape Shape, class Visit>
  Clearance for_each_candidate(const Shape& shape, const Posed& X, double extent, Visit&& visit) noexcept {
    spheres_.measure(shape, to_float(z_axis(X)), to_float(X_.translation() - X.translation()), count_);
    const auto offset = static_cast<float>(contact_offset_) + Constants::kSinglePrecision,
               fraction = static_cast<float>(extent);
    // Least distances of an element's points beyond the offset [m].
    ProfileLanes<float> gap, nearest;
    nearest.fill(std::numeric_limits<float>::max());
    for (std::size_t first = 0; first < count_; first += kProfileLanes) {
      const ProfileLanes<float>& distance = spheres_.distances(first);
      const float* const spread = spread_.data() + first;
      for (std::size_t l = 0; l < kProfileLanes; ++l) gap[l] = distance[l] - fraction * spread[l] - offset;
      for (std::size_t l = 0; l < kProfileLanes; ++l) {
        const float free_gap = gap[l] < 0 ? std::numeric_limits<float>::max() : gap[l];
        nearest[l] = free_gap < nearest[l] ? free_gap : nearest[l];
      }
      std::uint32_t is_near = detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return gap[l] < 0; });
      for (; is_near != 0; is_near &= is_near - 1) {
        const NearElement& e = elements_[first + static_cast<std::size_t>(std::countr_zero(is_near))];
        const NearBlock& block = blocks_[e.block];
        visit(block, std::size_t{e.i}, to_float(block.corner - X.translation()));
      }
    }
    const ToolMotion from = motion_between(X_, X);
    return {*std::min_element(nearest.begin(), nearest.end()),
            arm_ + from.shift,
            {std::max(0.0, reach_.shift - from.shift), std::max(0.0, reach_.turn - from.turn)},
            shape.bounds().arm()};
  }

 private:
  using Constants = CoupledConstants;
  static constexpr float kFarAway = 1e6F;  // [m]
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

  Posed X_ = Posed::Identity();
  ToolMotion reach_;
  double contact_offset_ = 0;  // [m]
  double arm_ = 0;             // largest distance of a listed element from T's origin at X_ [m]
  std::vector<NearBlock> blocks_;
  SphereLanes block_spheres_;  // about T's origin at X_
  std::vector<KeptBlock> kept_blocks_;
  std::vector<NearElement> elements_;  // of which the first count_ are listed
  SphereLanes spheres_;                // of the elements, about T's origin at X_
  std::vector<float> spread_;          // of each element's corners about its position [m]
  std::size_t count_ = 0;
};

template <ToolShape Shape>
void ElementList::make(const Shape& shape) noexcept {
  const Vec3d p = X_.translation();
  const Vec3<float> u = to_float(z_axis(X_));
  const auto turn = static_cast<float>(reach_.turn), shift = static_cast<float>(reach_.shift + contact_offset_);
  block_spheres_.measure(shape, u, Vec3<float>::Zero(), blocks_.size(), turn);
  const auto [x, y, z] = spheres_.centres();
  float* const spread = spread_.data();
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
    // No element is farther from the tool's origin.
    k.arm = block_spheres_.arm(k.block) + block.radius;
    const float range = shift + turn * k.arm;
    ProfileLanes<float> distance;
    compute_distances(shape, u, k.origin, block.position[0].data(), block.position[1].data(), block.position[2].data(),
                      distance);
    for (std::size_t l = 0; l < kProfileLanes; ++l) distance[l] -= block.spread[l];
    k.is_near = detail::lane_bits<float, kProfileLanes>([&](std::size_t l) { return distance[l] <= range; }) &
                ((1U << near_block.count) - 1);
  }
  std::size_t n = 0;
  for (std::size_t i = 0; i < kept; ++i) {
    const KeptBlock& k = kept_blocks_[i];
    const ElementBlock& block = *blocks_[k.block].elements;
    if (k.is_near != 0) arm_ = std::max(arm_, static_cast<double>(k.arm));
    for (std::uint32_t is_near = k.is_near; is_near != 0; is_near &= is_near - 1, ++n) {
      const auto l = static_cast<std::size_t>(std::countr_zero(is_near));
      x[n] = block.position[0][l] + k.origin.x();
      y[n] = block.position[1][l] + k.origin.y();
      z[n] = block.position[2][l] + k.origin.z();
      spread[n] = block.spread[l];
      element[n] = {k.block, static_cast<std::uint32_t>(l)};
    }
  }
  // Lanes beyond the last element are far away.
  count_ = n;
  for (; n % kProfileLanes != 0; ++n) {
    x[n] = y[n] = z[n] = kFarAway;
    spread[n] = 0;
  }
}

}  // namespace trephine
