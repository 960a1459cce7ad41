// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/depth_field.hpp>

namespace trephine {

/// Where renderers that ask how deep a point is get it from: a DepthMap kept beside the densities …
class FromDepthMap {
 public:
  static constexpr bool kUsesDepthMap = true;
  explicit FromDepthMap(DepthMap& map) noexcept : map_(&map) {}
  template <RealScalar Scalar, VoxelDensity Density>
  [[nodiscard]] DepthField<Scalar> field(const VoxelGrid<Density>&, double) const noexcept {
    return DepthField<Scalar>(*map_);
  }
  [[nodiscard]] DepthMap& map() const noexcept { return *map_; }

 private:
  DepthMap* map_;
};

/// … or the densities themselves, above the isovalue: no map to make and to cut; but stiffness varies with the bone's
/// contrast, and below a plateau there is no way out.
struct FromDensities {
  static constexpr bool kUsesDepthMap = false;
  template <RealScalar Scalar, VoxelDensity Density>
  [[nodiscard]] DensityField<Density, Scalar> field(const VoxelGrid<Density>& grid, double isovalue) const noexcept {
    return {grid, isovalue};
  }
};

template <class D>
concept DepthSource = std::same_as<D, FromDepthMap> || std::same_as<D, FromDensities>;

/// What a scene asks of a renderer that reads depths: the base of those.
template <RealScalar Scalar, DepthSource Depth>
class DepthReader {
 public:
  explicit DepthReader(const Depth& depth) noexcept : depth_(depth) {}

  /// The field that this renderer reads.
  template <VoxelDensity Density>
  [[nodiscard]] auto field(const VoxelGrid<Density>& grid, double isovalue) const noexcept {
    return depth_.template field<Scalar>(grid, isovalue);
  }
  /// The map that carving must keep up with.
  [[nodiscard]] DepthMap& depth_map() const noexcept requires(Depth::kUsesDepthMap) { return depth_.map(); }

 private:
  [[no_unique_address]] Depth depth_;
};

}  // namespace trephine
