// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/voxel/cut_policy.hpp>

#include <concepts>

namespace trephine::inline TREPHINE_ALIGNED {

template <VoxelDensity Density>
class CutFloor;  // voxel/cut_floor.hpp

/// Another cut that never lowers a voxel below its floor, whatever tool, pose, speed or policy. A scene's `Cutting`
/// makes one of its policy and the floor of its `Veto`; a program that calls `carve` itself makes its own.
///
/// The floor must outlive it. With a floor for other bone or another isovalue, `carve` cuts nothing. Haptic thread.
template <VoxelDensity Density, CutPolicy Policy>
struct ProtectedCut {
  static constexpr CutKind kKind = Policy::kKind;

  ProtectedCut(const Policy& cut, CutFloor<Density>& below) noexcept : policy(&cut), floor(&below) {}
  /// Without a floor it is the other cut.
  ProtectedCut(const Policy& cut, CutFloor<Density>* below) noexcept : policy(&cut), floor(below) {}
  ProtectedCut(Policy&&, CutFloor<Density>&) = delete;  // the policy must outlive it too

  const Policy* policy;
  CutFloor<Density>* floor;

  void validate() const { policy->validate(); }

  template <VoxelDensity Bone>
  struct Limit : Policy::template Limit<Bone> {
    CutFloor<Bone>* below;
    [[nodiscard]] CutFloor<Bone>* floor() const noexcept { return below; }
  };
  template <VoxelDensity Bone>
  [[nodiscard]] Limit<Bone> limit(const CutAllowance& allowance) const noexcept {
    static_assert(std::same_as<Bone, Density>, "trephine::ProtectedCut: the floor is for bone of another density type");
    return {policy->template limit<Bone>(allowance), floor};
  }
};

}  // namespace trephine
