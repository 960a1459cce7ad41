// SPDX-License-Identifier: MIT
#pragma once

#include "held_drill.hpp"

#include <trephine/stage/milling.hpp>
#include <trephine/voxel/protected_cut.hpp>

#include <concepts>
#include <memory>
#include <utility>

namespace live {

/// A carver over one of two floors of the same bone: one watches structures, the other refuses to cut them. Feed and
/// choice come from inboxes at the start of a tick. Both floors are of the bone as loaded, and stay allocated, so a
/// switch takes no memory.
template <trephine::CutPolicy Policy>
class GuardedMilling {
  using Milling = trephine::Milling<trephine::ProtectedCut<std::int16_t, Policy>>;

 public:
  static constexpr bool kCutsUnderPressure = Milling::kCutsUnderPressure;
  using Floor = trephine::CutFloor<std::int16_t>;

  GuardedMilling(const Policy& cut, std::shared_ptr<Floor> watch, std::shared_ptr<Floor> refuse, bool refuses,
                 Inboxes& inboxes)
      : watch_(std::move(watch)),
        refuse_(std::move(refuse)),
        milling_(trephine::ProtectedCut{cut, refuses ? refuse_ : watch_}),
        inboxes_(&inboxes) {}

  void validate() const { milling_.validate(); }
  void validate_for(const trephine::VoxelGrid<std::int16_t>& bone, double isovalue) const {
    milling_.validate_for(bone, isovalue);
  }
  void reset() noexcept { milling_.reset(); }

  void begin_tick() noexcept {
    const Policy* cut = nullptr;
    if constexpr (std::same_as<Policy, trephine::AdvancingCut>) cut = inboxes_->feed.take();
    const bool* const refuses = inboxes_->refuses.take();
    if (cut == nullptr && refuses == nullptr) return;
    auto policy = milling_.policy();
    if (cut != nullptr) policy.policy = *cut;
    if (refuses != nullptr) policy.floor = *refuses ? refuse_ : watch_;
    milling_.set_policy(policy);
  }

  template <class Head>
  double carve(trephine::VoxelGrid<std::int16_t>& bone, double isovalue, const trephine::Posed& X_GT_previous,
               const trephine::Posed& X_GT, const Head& head, const trephine::CarveContext& context) noexcept {
    return milling_.carve(bone, isovalue, X_GT_previous, X_GT, head, context);
  }

  [[nodiscard]] double taken_mm3() const noexcept { return watch_->taken_mm3(); }
  [[nodiscard]] double refused_mm3() const noexcept { return refuse_->refused_mm3(); }

 private:
  std::shared_ptr<Floor> watch_, refuse_;
  Milling milling_;
  Inboxes* inboxes_;
};

}  // namespace live
