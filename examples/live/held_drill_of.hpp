// SPDX-License-Identifier: MIT
#pragma once

#include "felt_structures.hpp"
#include "floor_switch.hpp"
#include "held_drill.hpp"

#include <trephine/stage/cutting.hpp>
#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/members.hpp>
#include <trephine/stage/motion.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/structure/tool_distance.hpp>
#include <trephine/voxel/pressure_cut.hpp>

#include <type_traits>
#include <utility>

namespace live {

template <class Scene>
class HeldDrillOf : public HeldDrill {
 public:
  template <class... Arguments>
  explicit HeldDrillOf(Arguments&&... arguments) : scene_(std::forward<Arguments>(arguments)...) {}
  trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept override {
    return scene_.tick(input, dt);
  }
  [[nodiscard]] trephine::Posed tool_W() const noexcept override { return scene_.visual_pose_W(); }
  std::size_t contacts_W(std::span<trephine::ContactPoint<double>> out) const noexcept override {
    return scene_.contacts_W(out);
  }
  void reset() noexcept override {
    scene_.reset();
    scene_.forget_wrench();
  }

 protected:
  Scene scene_;
};

/// What guard and floors of a scene say of structures after a tick. The distance is of the drawn tool: where bone holds
/// it, the device's pose is nearer.
template <class Scene>
[[nodiscard]] StructureReport structure_report(const Scene& scene) noexcept {
  const auto& guard = scene.template part<trephine::StructureGuard>();
  const auto& floors = scene.template part<FloorSwitch>();
  const trephine::GuardPotential& potential = guard.potential();
  const trephine::Posed X_ST = trephine::compose(trephine::inverse(potential.X_GS()),
                                                 trephine::relative_pose(scene.bone().X_WG(), scene.visual_pose_W()));
  const trephine::ToolDistance nearest = trephine::tool_distance(potential.field(), potential.burr(), X_ST);
  return {.nearest = nearest.structure,
          .distance = nearest.distance,
          .in_margin = nearest.structure >= 0 && nearest.distance < potential.widest_margin(),
          .push_N = guard.report().push.force.norm(),
          .refused_mm3 = floors.refused_mm3(),
          .taken_mm3 = floors.taken_mm3()};
}

/// Adds what the drill feels of soft structures.
inline void report_soft(const trephine::SoftStructures& soft, int structures, StructureReport& out) noexcept {
  out.pressed = soft.report().structure;
  out.pressed_N = soft.report().force;
  for (int s = structures - 1; s >= 0; --s)
    if (soft.tears().count(s) > 0) out.torn = s;
  if (out.pressed >= 0 && soft.tears().count(out.pressed) > 0) out.torn = out.pressed;
}

template <class Scene, bool kFeels>
class GuardedDrillOf final : public HeldDrillOf<Scene> {
 public:
  using HeldDrillOf<Scene>::HeldDrillOf;
  [[nodiscard]] StructureReport structures() const noexcept override {
    StructureReport report = structure_report(this->scene_);
    if constexpr (kFeels)
      if (const auto* const soft = this->scene_.template part<FeltStructures>().soft())
        report_soft(*soft, this->scene_.template part<trephine::StructureGuard>().potential().field().structures(),
                    report);
    return report;
  }
  [[nodiscard]] trephine::SoftStructures* soft() noexcept override {
    if constexpr (kFeels) return this->scene_.template part<FeltStructures>().soft();
    return nullptr;
  }
};

/// The stages that every drill here has, after its renderer, its `cutting` and stages of the renderer's own. Guard and
/// floors are only compiled into drills in bone with structures.
template <class ContactRenderer, class Cutting, class... Own>
[[nodiscard]] std::unique_ptr<HeldDrill> held_with(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                                   Inboxes& inboxes, ContactRenderer renderer, const Cutting& cutting,
                                                   const Own&... own) {
  using namespace trephine;
  // By the law its teeth vibrate.
  const MillingVibration::Options trembling =
      settings.mills_by_law() ? MillingVibration::Options{.per_force = 0} : settings.tuning.trembling();
  Remote vibration{MillingVibration{trembling}, inboxes.vibration};
  Remote damping{Damping{settings.tuning.damped()}, inboxes.damping};
  Remote limits{settings.tuning.limited(), inboxes.limits};
  if (settings.guarded == nullptr) {
    using Scene = HapticScene<std::int16_t, ContactRenderer, Cutting, Own..., decltype(vibration), decltype(damping),
                              decltype(limits)>;
    return std::make_unique<HeldDrillOf<Scene>>(bone, isovalue, std::move(renderer), cutting, own..., vibration,
                                                damping, limits);
  }
  const FloorSwitch floors(settings.guarded->watch, settings.guarded->refuse, settings.protection == Protection::kVeto,
                           inboxes);
  Remote guard{StructureGuard{settings.potential, guard_options(settings.protection)}, inboxes.guard};
  const auto guarded = [&](const auto&... felt) -> std::unique_ptr<HeldDrill> {
    using Scene =
        HapticScene<std::int16_t, ContactRenderer, Cutting, FloorSwitch, std::remove_cvref_t<decltype(felt)>..., Own...,
                    decltype(vibration), decltype(damping), decltype(guard), decltype(limits)>;
    return std::make_unique<GuardedDrillOf<Scene, sizeof...(felt) == 1>>(
        bone, isovalue, std::move(renderer), cutting, floors, felt..., own..., vibration, damping, guard, limits);
  };
  if constexpr (CutsByPressure<ContactRenderer>)  // the coupled tool, which alone carries loads
    return guarded(FeltStructures(settings.soft.get(), settings.felt_scale(), inboxes));
  else
    return guarded();
}

template <class ContactRenderer>
[[nodiscard]] std::unique_ptr<HeldDrill> held(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                              Inboxes& inboxes, ContactRenderer renderer) {
  using namespace trephine;
  if constexpr (CutsByPressure<ContactRenderer>)
    if (settings.mills_by_law()) {
      const Remote law{CuttingForce{settings.cutting()}, inboxes.law};
      const Remote teeth{Teeth{law, settings.tuning.teeth_passing()}, inboxes.teeth};
      return held_with(bone, isovalue, settings, inboxes, std::move(renderer), Cutting{PressureCut{}, teeth});
    }
  return held_with(bone, isovalue, settings, inboxes, std::move(renderer),
                   Remote{Cutting{settings.tuning.cut(settings.burr)}, inboxes.feed});
}

}  // namespace live
