// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/simulated_device.hpp>

#include <dhdc.h>
#include <drdc.h>

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

/// What stands behind dhdc.h and drdc.h where there is no SDK: simulated devices with the behaviour that public
/// documentation tells, and faults on demand. For tests and dry runs. Not affiliated with Force Dimension.
///
/// - TimeGuard: a pose asked for again too soon is the old one, and the answer is DHD_TIMEGUARD.
/// - The weight of the arm is compensated in each command, and the motors hold the last command. Without a command for
///   the watchdog's time, or above the speed limit, the device brakes: no force until it is enabled again.
/// - An uncalibrated device reads 30 mm off along x and refuses to enable forces.
/// - A left-handed device's gripper opens to negative angles.
/// Figures of documentation that is not public (TimeGuard's interval, the speed limit) are assumptions.
namespace dhd_standin {

inline constexpr double kMassOfArm = 0.2;  ///< [kg] whose weight is compensated
inline constexpr double kOffset = 0.03;    ///< [m] of an uncalibrated pose
inline constexpr double kStandardGravity = 9.81;

struct Model {
  std::string name;
  bool left = false;
  bool wrist = false;
  bool active_wrist = false;
  bool gripper = false;
  bool robotic = true;         ///< DRD supports it
  bool calibrated = true;      ///< at power-on
  double max_force = 12;       ///< of the motors [N]
  double max_torque = 0.2;     ///< [N·m]
  double time_guard = 250e-6;  ///< [s]
  double speed_limit = 1.5;    ///< [m/s]
  trephine::SimulatedDeviceOptions mechanics{};
  /// The hand that holds it: target pose and buttons at a time [s]; empty: a hand that keeps still.
  std::function<trephine::HandTarget(double)> hand{};
};

/// Returns omega.3, omega.6, sigma.7, lambda.7 or lambda.7 left. Throws std::invalid_argument for any other name.
[[nodiscard]] Model model(const std::string& name);
[[nodiscard]] std::vector<std::string> model_names();

/// What one device went through, as of now.
struct Witness {
  trephine::Wrenchd felt;     ///< what the motors give, without the compensation of weight
  double compensation = 0;    ///< of the arm's weight, in the motors [N]
  trephine::Wrenchd command;  ///< the last that was sent, in effect or not
  std::uint64_t commands = 0;
  double most_force = 0;   ///< felt since it was opened [N]
  double most_torque = 0;  ///< [N·m]
  double felt_until = 0;   ///< when a force was felt last [s]
  bool enabled = false;
  int cause = DHD_FORCEOFF_SOFTWARE;  ///< of the last loss of force
  trephine::Posed X_DH = trephine::Posed::Identity();
};

enum class Fault {
  kNone,
  kUnplugged,      ///< no call works, the motors have no current
  kCommunication,  ///< no call works, the motors hold the last command
  kNoNumber,       ///< poses are NaN
  kNoRotation,     ///< frames are zeros
  kMirrored,       ///< frames are a mirror's
  kJump,           ///< poses are 50 mm off
  kStale,          ///< each pose is the old one
  kUncalibrated,   ///< the device lost its calibration
  kError,          ///< the status says that there is an error
};

/// Replaces the devices that there are and ends faults. Throws std::logic_error while one is open.
void plug(std::vector<Model> models);
/// Befalls all devices from now on; kNone ends it. Calibration does not come back by itself.
void inject(Fault fault);
/// Puts the poles into their pits.
void calibrate_by_hand();
/// Opens the grippers to this angle [rad]; they are wide open at first.
void open_gripper(double angle);
/// Presses the devices' force buttons: off, and on again.
void press_force_button();

/// Time passes by `pass` alone from now on, or by the steady clock again.
void hold_clock(bool held);
void pass(double seconds);
[[nodiscard]] double now() noexcept;  ///< [s]

[[nodiscard]] Witness witness(std::size_t index = 0);
[[nodiscard]] int open_devices();

}  // namespace dhd_standin
