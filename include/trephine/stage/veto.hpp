// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/refuse.hpp>
#include <trephine/core/tick.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/voxel/cut_floor.hpp>

#include <concepts>
#include <memory>
#include <utility>

namespace trephine::inline TREPHINE_ALIGNED {

/// The part of a scene that keeps its cuts above a floor, whatever tool, pose, speed or policy.
/// \code
/// auto floor = std::make_shared<CutFloor<std::int16_t>>(bone, 300);   // bodies, then seal; or make_cut_floor
/// HapticScene{bone, 300, renderer, Cutting{}, Veto{floor}}
/// \endcode
/// The floor must be made for the scene's bone and isovalue: a scene refuses another one. Several scenes of one thread
/// may share it. Haptic thread; no allocation.
template <VoxelDensity Density>
class Veto {
 public:
  /// Throws std::invalid_argument for no floor.
  explicit Veto(std::shared_ptr<CutFloor<Density>> floor) : floor_(std::move(floor)) {
    if (floor_ == nullptr) refuse("Veto", "it needs a CutFloor", "none");
  }

  /// Throws std::invalid_argument if the floor was made for another grid or isovalue.
  template <VoxelDensity Bone>
  void validate_for(const VoxelGrid<Bone>& bone, double isovalue) const {
    static_assert(std::same_as<Bone, Density>, "trephine::Veto: the floor is for bone of another density type");
    if (!floor_->fits(bone, isovalue))
      refuse("Veto", "the floor must be made for the scene's bone and isovalue", isovalue);
  }

  [[nodiscard]] const std::shared_ptr<CutFloor<Density>>& floor() const noexcept { return floor_; }
  [[nodiscard]] CutFloor<Density>* cut_floor() const noexcept { return floor_.get(); }

  /// Returns a veto with a copy of the floor.
  [[nodiscard]] Veto with_own_floor() const {
    Veto made(std::make_shared<CutFloor<Density>>(*floor_));
    made.before_ = before_;
    return made;
  }
  /// Takes the counts of a veto in a copy of the bone. The floors stay apart.
  void take(const Veto& other, const TakenBone&) {
    if (floor_ != other.floor_) floor_->take(*other.floor_);
    before_ = other.before_;
  }

  void begin_tick() noexcept { before_ = floor_->counts(); }
  /// Adds the volumes that the floor refused and watched in the last tick.
  void add_to(StructureSummary& summary) const noexcept {
    const FloorCounts now = floor_->counts();
    summary.refused_mm3 += floor_->voxel_mm3() * static_cast<double>(now.refused - before_.refused);
    summary.taken_mm3 += floor_->voxel_mm3() * static_cast<double>(now.taken - before_.taken);
  }

 private:
  std::shared_ptr<CutFloor<Density>> floor_;
  FloorCounts before_;  // at this tick's start
};

}  // namespace trephine
