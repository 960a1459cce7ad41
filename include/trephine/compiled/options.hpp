// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/contact/friction.hpp>
#include <trephine/core/units.hpp>
#include <trephine/render/coupled/coupled_options.hpp>
#include <trephine/render/stiffness_budget.hpp>
#include <trephine/tool/cutting_edges.hpp>

#include <cstdint>
#include <limits>
#include <optional>

/// Options of a compiled scene: plain structs, each named after the part of a header scene that it describes.
namespace trephine::inline TREPHINE_ALIGNED::compiled {

enum class RendererKind : std::uint8_t { kCoupled, kLine, kSurface };

/// See `trephine::LineOptions` and `LineCounts`; the laws and searches are the defaults of the headers.
struct LineOptions {
  double stiffness = 800;                   ///< of the tip [N/m], > 0
  std::optional<double> shaft_stiffness{};  ///< of the shaft's spring [N/m]; `stiffness` unless given
  int vertices = 50;                        ///< along the shaft's centreline
  std::optional<StiffnessBudget> budget{};  ///< largest tangent stiffness of tip and shaft together
};

/// See `trephine::SurfaceOptions` and `SurfaceCounts`; the weighting and the deep contact are the headers' defaults.
struct SurfaceOptions {
  double stiffness = 800;                   ///< secant stiffness of the tip at a depth of half its radius [N/m], > 0
  int sphere = 260;                         ///< vertices on the ball
  int slices = 70;                          ///< along the shaft
  int per_slice = 8;                        ///< vertices round each slice
  std::optional<StiffnessBudget> budget{};  ///< largest tangent stiffness of all groups together
};

/// Which renderer, and its options; those of the other renderers are not read.
struct RendererOptions {
  RendererKind renderer = RendererKind::kCoupled;
  std::optional<Coulomb> friction{};  ///< of the coupled tool and Line; absent: frictionless. Surface has none
  CoupledOptions coupled{};           ///< an infinite rotational stiffness: translation alone, without torque
  LineOptions line{};
  SurfaceOptions surface{};
};

/// The policy of a cut.
enum class Cut : std::uint8_t {
  kGeometric,    ///< at once (`GeometricCut`)
  kRateLimited,  ///< voxels fall at a rate (`RateLimitedCut`)
  kAdvancing,    ///< the surface recedes at a speed (`AdvancingCut`)
  kPressure,     ///< as `StageOptions::cutting` says, which must be given: coupled tool alone (`PressureCut`)
};

/// Removes bone with the burr's ball while the spindle turns.
struct Milling {
  Cut cut = Cut::kGeometric;
  double rate = 1e5;             ///< kRateLimited: of a wholly covered voxel [densities/s], > 0
  double speed = 1e-3;           ///< kAdvancing: of the surface [m/s], > 0
  double reference_force = 0;    ///< [N]: rate and speed hold at this force; 0: force plays no part
  double most_force_factor = 4;  ///< bound of force / reference_force, > 0
  double slope = 0;              ///< of the cut [densities per voxel]; 0: automatic
  bool follow_probe = false;     ///< cut along the device's pose instead of the renderer's cutting pose
};

/// Impact: the wrench times (1 + λ ẋ).
struct HuntCrossley {
  double lambda = 1.0;      ///< [s/m], >= 0
  double max_factor = 2.0;  ///< >= 1
  double lever = 0.040;     ///< longest lever arm of a contact [m], > 0
};

/// Forces of cutting: torque about the spindle, pull sideways and, with `Cut::kPressure`, a feed by the thrust. Each
/// tick tells the true forces (`TickResult::cutting`). Edges are the tool's (`tool_by_name`).
struct CuttingForce {
  CuttingEdges edges{};
  double speed = rpm(30'000);                                     ///< of the spindle without load [rad/s], > 0
  bool clockwise = true;                                          ///< teeth turn clockwise, seen from the handle
  double stall_torque = std::numeric_limits<double>::infinity();  ///< at which the spindle stands [N·m], > 0
  double felt = 1;         ///< share of the true forces that the device gets, in (0, 1]
  double soft = 0;         ///< density without strength: of water, 0 HU
  double cortical = 1700;  ///< density of cortical bone, > `soft`
};

/// The tremble of a burr that bites.
struct MillingVibration {
  double frequency = 180;        ///< [Hz], in (0, 300]
  double per_force = 0.08;       ///< amplitude by contact force [N/N], >= 0
  double per_removal = 0;        ///< amplitude by removal rate [N/(mm³/s)], >= 0
  double amplitude_limit = 0.5;  ///< [N], >= 0
};

/// Viscous damping.
struct Damping {
  double linear = 0;   ///< [N·s/m], >= 0
  double angular = 0;  ///< [N·m·s/rad], >= 0
  bool only_in_contact = false;
};

/// Low-pass of first order.
struct FirstOrderFilter {
  double cutoff = 200;  ///< [Hz], > 0
};

/// Takes energy out that the scene would give to the hand beyond what the device bears.
struct PassivityController {
  double stiffness = 800;                ///< what the device bears [N/m], >= 0
  double angular_stiffness = 0.3;        ///< the same for rotation [N·m/rad], >= 0
  double delay = 0;                      ///< of the loop beside the hold [s], >= 0
  double quantum = 0;                    ///< of position readings [m], >= 0
  double angular_quantum = 0;            ///< [rad], >= 0
  double contact_stiffness = 0;          ///< largest tangent stiffness of the law [N/m]; 0: unknown
  double contact_angular_stiffness = 0;  ///< [N·m/rad]; 0: torque stores nothing
  double damping = 5;                    ///< most that is injected [N·s/m], >= 0
  double angular_damping = 5e-3;         ///< [N·m·s/rad], >= 0
  double force = 1.5;                    ///< longest injected force [N], >= 0
  double torque = 0.03;                  ///< [N·m], >= 0
  double force_rate = 300;               ///< fastest change of the injected force [N/s], > 0
  double torque_rate = 6;                ///< [N·m/s], > 0
  double reserve = 10e-3;                ///< largest credit, and largest debt [J], >= 0
  double memory = 0.2;                   ///< time constant in which a debt is forgotten [s], > 0
};

/// Force and torque of Line fall no faster than this where bone gives way (`trephine::ReleaseLimit`). The coupled tool
/// has `CoupledOptions::release`.
struct ReleaseLimit {
  double stiffness = 1600;            ///< twice Line's, as tip and shaft add up [N/m], > 0
  double rotational_stiffness = 0.3;  ///< weighs torque against force [N·m/rad], > 0
  double release = 60;                ///< fastest fall of the force [N/s], > 0
};

/// The wrench changes by at most this a second.
struct WrenchRateLimit {
  double force = 600;  ///< [N/s], > 0
  double torque = 20;  ///< [N·m/s], > 0
};

/// Largest force and torque that leave the scene; unlimited unless given.
struct DeviceLimits {
  double force = std::numeric_limits<double>::infinity();   ///< [N], >= 0
  double torque = std::numeric_limits<double>::infinity();  ///< [N·m], >= 0
};

/// What a scene's guard does about a structure (`trephine::GuardMode`).
enum class GuardMode : std::uint8_t { kOff, kWarn, kPush };

/// What cuts may do to a structure (`trephine::StructureVeto::Mode`).
enum class VetoMode : std::uint8_t {
  kFree,     ///< cuts take it
  kWatch,    ///< cuts take it, and what they take is counted
  kProtect,  ///< no cut takes bone in it or within `veto_margin`
  kKeepIn,   ///< no cut takes bone outside of it, or within `veto_margin` from inside: a planned cavity
};

/// How a scene keeps tool and cuts from one structure; see `trephine::GuardedStructure` and `StructureVeto`.
struct Structure {
  GuardMode guard = GuardMode::kPush;
  double margin = 1e-3;       ///< distance at which the push begins [m], >= 0
  double stiffness = 1000;    ///< of the push [N/m], > 0
  double greatest_force = 2;  ///< the push grows no further [N], > 0
  double damping = 2;         ///< of motion toward the structure [N·s/m], >= 0
  VetoMode veto = VetoMode::kProtect;
  double veto_margin = 0;  ///< [m], >= 0
};

/// Options of a scene's guard for all structures; see `trephine::StructureGuard` and `GuardPotential`.
struct GuardOptions {
  bool push = true;                         ///< false: no force, but distances and warnings
  double ramp_time = 0.25;                  ///< in which a push fades in and out [s], > 0
  double smoothing = 0.6e-3;                ///< of distances [m]
  std::optional<StiffnessBudget> budget{};  ///< of the whole guard; contact's stiffness adds to it
};

/// What was counted of a structure since its protection came into the scene.
struct StructureTotals {
  int breaches = 0;        ///< times that the tool went into it while it was guarded (`StructureGuard::breaches`)
  double refused_mm3 = 0;  ///< protected bone that cuts would have taken [mm³]
  double taken_mm3 = 0;    ///< bone that cuts took of it while it was watched [mm³]
};

/// The stages of a scene, in the order in which they run; an absent stage changes no bit of the wrench. The guard of
/// `set_structures` runs between filter and passivity control.
struct StageOptions {
  std::optional<Milling> milling{};
  std::optional<ReleaseLimit> release_limit{};
  std::optional<HuntCrossley> hunt_crossley{};
  std::optional<CuttingForce> cutting{};
  std::optional<MillingVibration> vibration{};
  std::optional<Damping> damping{};
  std::optional<FirstOrderFilter> filter{};
  std::optional<PassivityController> passivity{};
  std::optional<WrenchRateLimit> rate_limit{};
  std::optional<DeviceLimits> limits{};
};

}  // namespace trephine::compiled
