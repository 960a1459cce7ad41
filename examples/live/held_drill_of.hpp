// SPDX-License-Identifier: MIT
#pragma once

#include "held_drill.hpp"

#include <trephine/stage/haptic_scene.hpp>
#include <trephine/stage/milling.hpp>
#include <trephine/stage/remote.hpp>

#include <utility>

namespace live {

template <class Scene>
class HeldDrillOf final : public HeldDrill {
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

 private:
  Scene scene_;
};

/// The stages that every drill here has, after its renderer.
template <class ContactRenderer>
[[nodiscard]] std::unique_ptr<HeldDrill> held(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                              Inboxes& inboxes, ContactRenderer renderer) {
  using namespace trephine;
  Remote milling{Milling{AdvancingCut{.speed = settings.burr.tip_radius / kRadiusTime}}, inboxes.feed};
  Remote vibration{MillingVibration{{.frequency = 180, .per_force = 0.08}}, inboxes.vibration};
  Remote damping{Damping{{.linear = 1, .angular = 1e-4, .only_in_contact = true}}, inboxes.damping};
  Remote limits{DeviceLimits{.force = kMaxForce, .torque = kMaxTorque}, inboxes.limits};
  using Scene = HapticScene<std::int16_t, ContactRenderer, decltype(milling), decltype(vibration), decltype(damping),
                            decltype(limits)>;
  return std::make_unique<HeldDrillOf<Scene>>(bone, isovalue, std::move(renderer), milling, vibration, damping, limits);
}

}  // namespace live
