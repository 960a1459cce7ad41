// SPDX-License-Identifier: MIT
#pragma once

#include "stability/places.hpp"

#include <functional>
#include <string>
#include <vector>

/// A tool in the simulated device's hand, and the figures of its motion; the devices and hands that close the loop.
namespace trephine::bench {

/// Pose in, wrench out: a scene, or an analytic wall.
using Law = std::function<Wrenchd(const Posed& X_WT, double dt)>;
[[nodiscard]] Law law_of(AnyTool& tool, bool spindle = false);

struct LoopOptions {
  SimulatedDeviceOptions device{};
  std::function<HandTarget(double)> hand{};  ///< empty: stays where the device starts
  Vec3d bias = Vec3d::Zero();                ///< a constant force of the hand [N]
  double seconds = 2;
  double dt = 1e-3;
  Vec3d along = Vec3d::UnitZ();  ///< amplitudes are taken along it
  double settle = 0.5;           ///< the last part in which amplitudes are taken [s]
  double escape = 0.05;          ///< farther from the start than this is unstable [m]
  double stiffness = 0;          ///< for Rule E: the largest tangent stiffness [N/m]; 0: as found
  double angular_stiffness = 0;  ///< [N·m/rad]; 0: as found
  std::function<void(double time, const Wrenchd& sent, double energy, double allowed)> trace{};
};

struct LoopReport {
  bool escaped = false;
  double amplitude = 0;        ///< peak to peak at the end [m]
  double turn = 0;             ///< the same of the rotation, of its largest component [rad]
  double tremble = 0;          ///< peak to peak about a straight way, in the median eighth of a second at the end [m]
  double early = 0, late = 0;  ///< rms about the mean in a window near the start and at the end [m]
  double energy = 0;           ///< most that was given to the hand in all [J]
  double beyond = 0;           ///< most beyond Rule E [J]
  double force_step = 0;       ///< greatest change a tick [N]
  double most_force = 0;       ///< [N]
  double ripple = 0;           ///< rms of the force about its mean at the end [N]
  Vec3d mean_force = Vec3d::Zero();
  Posed last = Posed::Identity();
};

[[nodiscard]] LoopReport run_loop(const Law& law, const LoopOptions& options);

/// Devices and hands by name: "none", "light", "firm" (evaluation of haptic hands: 0, 100, 400 N/m).
[[nodiscard]] SimulatedDeviceOptions device_of(double mass, double damping, const std::string& hand);

/// Whether a motion has died down to `amplitude` [m], or halved between the start and the end of the run.
[[nodiscard]] bool comes_to_rest(const LoopReport& report, double amplitude);

/// Largest x in [low, high] up to which `stable` holds, to the ratio `within`; low where it never, high where it always
/// does. Looks upward in strides, then bisects.
[[nodiscard]] double largest_stable(double low, double high, double within, const std::function<bool(double)>& stable);

inline constexpr double kDeviceMass = 0.045;  // [kg] a desktop device

/// What a closed loop is swept over.
struct Case {
  double damping = 0.5;  ///< of the device [N s/m]
  int delay = 0;         ///< [ticks]
  std::string hand = "none";
  double friction = 0;  ///< the device's, Coulomb [N]
  double quantum = 0;   ///< of its encoders [m]

  [[nodiscard]] std::string text() const;
  [[nodiscard]] SimulatedDeviceOptions device() const;
  /// Greatest stable stiffness of a linear wall: (b + b_h) / (T/2 + dT) [N/m].
  [[nodiscard]] double theory() const;
  bool operator==(const Case&) const = default;
};

/// A light hand, one factor changed at a time, then `count` combinations of all of them from a fixed seed.
[[nodiscard]] std::vector<Case> swept_cases(int count);

/// The hand presses the tool into a place with about `newton`; nobody's hand is a constant force there.
[[nodiscard]] LoopOptions press(const Place& place, const Setup& setup, const SimulatedDeviceOptions& device,
                                double newton = 1);

/// The way in that it presses along: of a slot toward floor and side, of a hole to its side.
[[nodiscard]] Vec3d way_in(const Place& place);

/// The force that presses: 1 N, less where the wall would be so soft that the ball sinks in beyond half its radius.
[[nodiscard]] double bias_for(double K);

/// Only what acts along n: nothing slides away, as in one dimension.
[[nodiscard]] Law along(Law law, Vec3d n);

}  // namespace trephine::bench
