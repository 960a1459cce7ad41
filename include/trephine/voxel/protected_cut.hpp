// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_floor.hpp>

#include <concepts>
#include <memory>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// A cut policy that never lowers a voxel below its floor, whatever tool, pose, speed or policy.
/// \code
/// auto floor = std::make_shared<CutFloor<std::int16_t>>(bone, 300);   // bodies, then seal
/// HapticScene{bone, 300, renderer, Milling{ProtectedCut{RateLimitedCut<>{.rate = 2e5}, floor}}}
/// \endcode
/// The floor must be made for the same bone and isovalue: a scene refuses another one, and `carve` then cuts nothing.
/// Copies share the floor. Haptic thread; no allocation.
template <VoxelDensity Density, CutPolicy Policy>
struct ProtectedCut {
  using Options = CutOptionsOf<Policy>;

  ProtectedCut(const Policy& cut, std::shared_ptr<CutFloor<Density>> below) : policy(cut), floor(std::move(below)) {
    validate();
  }

  Policy policy;
  std::shared_ptr<CutFloor<Density>> floor;

  /// Throws std::invalid_argument.
  void validate() const {
    policy.validate();
    if (floor == nullptr) refuse("ProtectedCut", "it needs a CutFloor", "none");
  }
  /// Throws std::invalid_argument if the floor was made for another grid or isovalue.
  template <VoxelDensity Bone>
  void validate_for(const VoxelGrid<Bone>& bone, double isovalue) const {
    static_assert(std::same_as<Bone, Density>, "trephine::ProtectedCut: the floor is for bone of another density type");
    if (!floor->fits(bone, isovalue))
      refuse("ProtectedCut", "the floor must be made for the scene's bone and isovalue", isovalue);
    if constexpr (requires { policy.validate_for(bone, isovalue); }) policy.validate_for(bone, isovalue);
  }
  /// Replaces the inner policy's options, which must be valid. The floor stays.
  void adopt(const Options& options) noexcept { adopt_cut_options(policy, options); }

  /// Voxels that all cuts with this floor were refused and took of watched bodies; and the volume of one [mm³].
  [[nodiscard]] FloorCounts counts() const noexcept { return floor->counts(); }
  [[nodiscard]] double voxel_mm3() const noexcept { return floor->voxel_mm3(); }

  template <VoxelDensity Bone>
  struct Limit : Policy::template Limit<Bone> {
    CutFloor<Bone>* below;
    [[nodiscard]] CutFloor<Bone>& floor() const noexcept { return *below; }
  };
  template <VoxelDensity Bone>
  [[nodiscard]] Limit<Bone> limit(const CutAllowance& allowance) const noexcept {
    if constexpr (std::same_as<Bone, Density>)
      return {policy.template limit<Bone>(allowance), floor.get()};
    else
      static_assert(std::same_as<Bone, Density>,
                    "trephine::ProtectedCut: the floor is for bone of another density type");
  }
};

}  // namespace trephine
