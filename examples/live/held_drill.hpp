// SPDX-License-Identifier: MIT
#pragma once

#include "../drill/bone.hpp"
#include "guarded_bone.hpp"
#include "protection.hpp"

#include <trephine/core/tick.hpp>
#include <trephine/stage/cutting_force.hpp>
#include <trephine/stage/cutting_vibration.hpp>
#include <trephine/stage/damping.hpp>
#include <trephine/stage/device_limits.hpp>
#include <trephine/stage/mailbox.hpp>
#include <trephine/stage/milling_vibration.hpp>
#include <trephine/stage/remote.hpp>
#include <trephine/structure/soft_structures.hpp>
#include <trephine/structure/structure_guard.hpp>
#include <trephine/tool/motors.hpp>
#include <trephine/tool/revolved_tool.hpp>
#include <trephine/voxel/cut_policy.hpp>

#include <memory>
#include <optional>
#include <span>
#include <string>

namespace live {

enum class Renderer { kCoupled, kLine, kSurface };
[[nodiscard]] constexpr const char* to_string(Renderer r) {
  return r == Renderer::kCoupled ? "coupled" : r == Renderer::kLine ? "line" : "surface";
}

/// The law of cutting with teeth that vibrate.
using Teeth = trephine::CuttingVibration<trephine::Remote<trephine::CuttingForce>>;

/// Options that change while the drill runs: the window posts, the haptic thread takes.
struct Inboxes {
  trephine::Mailbox<trephine::AdvancingCut> feed;
  trephine::Mailbox<trephine::MillingVibration::Options> vibration;
  trephine::Mailbox<trephine::Damping::Options> damping;
  trephine::Mailbox<trephine::DeviceLimits> limits;
  trephine::Mailbox<trephine::CuttingForce::Options> law;
  trephine::Mailbox<Teeth::Options> teeth;
  // For bone with structures.
  trephine::Mailbox<trephine::StructureGuard::Options> guard;
  trephine::Mailbox<bool> refuses;  ///< cuts take nothing of structures
  trephine::Mailbox<double> felt;   ///< share of soft structures' true forces that the device gets
};

/// Largest force and torque of the simulated device [N, N·m].
inline constexpr double kMaxForce = 8.5, kMaxTorque = 0.188;
/// The surface recedes by the burr's radius in this time [s], as in the other drilling examples.
inline constexpr double kRadiusTime = 0.2;

/// What the sliders set while a drill runs.
struct Tuning {
  double feed = 0;           ///< speed at which the surface recedes [m/s]; 0: by the burr's radius in kRadiusTime
  double damping = 1;        ///< in contact [N s/m]
  double vibration = 0.08;   ///< amplitude by contact force, without the law of cutting [N/N]
  double force = kMaxForce;  ///< largest [N]
  // Of the law of cutting.
  double teeth = 0.3;      ///< share of the ripple of teeth that cut one by one
  double turns = 0;        ///< of the spindle without load [1/min]; 0: by the tool
  double force_scale = 0;  ///< share of the true forces that the device gets; 0: by the tool
  friend bool operator==(const Tuning&, const Tuning&) = default;

  [[nodiscard]] trephine::AdvancingCut cut(const trephine::Burr& burr) const {
    return {.speed = feed > 0 ? feed : burr.tip_radius / kRadiusTime};
  }
  [[nodiscard]] trephine::MillingVibration::Options trembling() const {
    return {.frequency = 180, .per_force = vibration};
  }
  [[nodiscard]] Teeth::Options teeth_passing() const { return {.depth = teeth, .pattern = {}}; }
  [[nodiscard]] trephine::Damping::Options damped() const {
    return {.linear = damping, .angular = 1e-4, .only_in_contact = true};
  }
  [[nodiscard]] trephine::DeviceLimits limited() const { return {.force = force, .torque = kMaxTorque}; }
};

/// What is fixed while a drill runs, and what its sliders show.
struct DrillSettings {
  Renderer renderer = Renderer::kCoupled;
  trephine::Burr burr{};    ///< or a burr of the tool's size
  std::string tool_name{};  ///< of `tool`; empty: the burr
  std::optional<trephine::RevolvedTool> tool{};
  double stiffness = 800;                  ///< [N/m]
  bool law = false;                        ///< the coupled tool mills by the law of cutting
  trephine::BoneStrength strength{};       ///< of the bone, for the law
  std::optional<trephine::Motor> motor{};  ///< that slows under load, for the law; none: a steady speed
  Tuning tuning{};
  // Only with structures.
  std::shared_ptr<const GuardedBone> guarded{};
  std::shared_ptr<const trephine::GuardPotential> potential{};  ///< for this tool
  std::shared_ptr<const trephine::SoftStructures> soft{};       ///< for this tool; the coupled one feels them
  Protection protection = Protection::kWarn;                    ///< at the start

  /// The tool that this renderer drills with, or nullptr: its burr.
  [[nodiscard]] const trephine::RevolvedTool* shape() const {
    return renderer == Renderer::kCoupled && tool ? &*tool : nullptr;
  }
  [[nodiscard]] bool mills_by_law() const { return renderer == Renderer::kCoupled && law; }
  /// Returns the law for this tool. Not for the haptic thread.
  [[nodiscard]] trephine::CuttingForce::Options cutting() const;
  /// Returns the share of soft structures' true forces that the device gets: the law's. Likewise.
  [[nodiscard]] double felt_scale() const { return mills_by_law() ? cutting().force_scale : 1; }
};

[[nodiscard]] constexpr trephine::StructureGuard::Options guard_options(Protection p) {
  return {.push = p >= Protection::kPush};
}

/// A scene of any renderer. Haptic thread.
class HeldDrill {
 public:
  HeldDrill() = default;
  HeldDrill(const HeldDrill&) = delete;
  HeldDrill& operator=(const HeldDrill&) = delete;
  virtual ~HeldDrill() = default;
  virtual trephine::TickResult tick(const trephine::TickInput& input, double dt) noexcept = 0;
  /// Pose of the tool to draw, of the last good tick.
  [[nodiscard]] virtual trephine::Posed tool_W() const noexcept = 0;
  virtual std::size_t contacts_W(std::span<trephine::ContactPoint<double>> out) const noexcept = 0;
  /// Forgets contact, velocities and the wrench that acted, as before the first tick. Between ticks.
  virtual void reset() noexcept = 0;
  /// What the last tick says of structures; nothing where there are none.
  [[nodiscard]] virtual StructureReport structures() const noexcept { return {}; }
  /// The structures that are felt as soft ones, or nullptr.
  [[nodiscard]] virtual trephine::SoftStructures* soft() noexcept { return nullptr; }
};

/// Scenes in translation units of their own: each is a tree of templates. The bone and the inboxes must outlive them.
/// Each throws std::invalid_argument as its renderer does.
[[nodiscard]] std::unique_ptr<HeldDrill> coupled_drill(drill::Grid& bone, double isovalue,
                                                       const DrillSettings& settings, Inboxes& inboxes);
[[nodiscard]] std::unique_ptr<HeldDrill> line_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                                    Inboxes& inboxes);
[[nodiscard]] std::unique_ptr<HeldDrill> surface_drill(drill::Grid& bone, double isovalue,
                                                       const DrillSettings& settings, Inboxes& inboxes);
[[nodiscard]] std::unique_ptr<HeldDrill> make_drill(drill::Grid& bone, double isovalue, const DrillSettings& settings,
                                                    Inboxes& inboxes);

}  // namespace live
