// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/device/simulated_device.hpp>

#include <cstddef>
#include <cstdint>

#include <HD/hd.h>

#include <functional>
#include <map>
#include <string>
#include <vector>

/// What stands behind `HD/hd.h` where there is no SDK: simulated devices, and a scheduler that keeps the interface's
/// rules and reports who breaks them. For tests and dry runs. Not affiliated with OpenHaptics.
///
/// Rules that it keeps: one servo thread, higher priority first; force and torque are zero from the beginning of a
/// frame and sent at its end; one frame per device and tick (HD_ILLEGAL_BEGIN, HD_ILLEGAL_END), left open at the end of
/// a tick: HD_FRAME_ERROR; a set outside a frame: HD_FRAME_ERROR, a get there answers with the last frame's values;
/// errors stack up and are popped newest first; an unscheduled handle that has finished: HD_INVALID_OPERATION.
/// A trip (more force than the nominal maximum among its causes) takes the motors' power away for a while.
/// Stricter than any manual says: frames outside the servo thread are HD_ILLEGAL_BEGIN, torque on three degrees of
/// freedom is HD_INVALID_OPERATION, a command that is no number HD_INVALID_VALUE.
namespace hd_standin {

/// A device that can be opened. Units of the interface: mm, N, mN·m.
struct Model {
  std::string name = "Default Device";
  std::string type = "stand-in";
  int input_dof = 6;
  int output_dof = 6;               ///< 3: force; 6: force and torque
  double max_force_N = 3.3;         ///< 0: it does not know
  double max_torque_mNm = 100;      ///< 0: it does not know
  double max_stiffness_N_mm = 1.0;  ///< 0: it does not know
  HDenum calibration = HD_CALIBRATION_OK;
  int calibration_ticks = 0;        ///< how long an update takes
  double calibration_jump_mm = 0;   ///< how far off the position is before, along x
  HDerror open_error = HD_SUCCESS;  ///< what hdInitDevice fails with
  double trip_time = 0.05;          ///< without power after a trip [s]
  trephine::SimulatedDeviceOptions mechanics{};
  /// The hand that holds it: target pose [m, SI] and buttons at a time [s]; empty: a hand that keeps still.
  std::function<trephine::HandTarget(double)> hand{};
};

/// What one device went through. SI units; as of the last tick.
struct Witness {
  std::uint64_t frames = 0;
  trephine::Wrenchd felt;  ///< what the motors give now
  double most_force = 0;   ///< since it was opened [N]
  double most_torque = 0;  ///< [N·m]
  bool force_enabled = false;
  bool powered = true;  ///< false: after a trip
  trephine::Posed X_DH = trephine::Posed::Identity();
};

/// Replaces the devices there are, forgets all errors, injections and counts, and sets 1000 Hz. Throws std::logic_error
/// while a device is open or the scheduler runs.
void plug(std::vector<Model> models);

/// kTick: at the beginning of a servo tick, before any callback; needs a device's name.
enum class At { kTick, kBeginFrame, kEndFrame, kSchedule, kStartScheduler };

/// The next `times` calls push this error (after letting `after` calls pass). `device`: by name; empty: any.
struct Injection {
  HDerror code = HD_SUCCESS;
  At at = At::kEndFrame;
  int times = 1;
  int after = 0;
  std::string device{};
};
void inject(const Injection& injection);

/// The scheduler's thread lives on but calls nobody: a hung driver.
void hang(bool hung);
/// Calibrates what needed a hand.
void calibrate_by_hand(const std::string& device);
/// Makes the next poses of a device NaN.
void break_pose(const std::string& device, bool broken);
/// Puts the next poses of a device off along x, as a lost encoder count does.
void offset_pose(const std::string& device, double mm);

[[nodiscard]] Witness witness(const std::string& device);
/// How often each error was pushed since `plug`; what nobody pushed is absent.
[[nodiscard]] std::map<HDerror, int> errors();
[[nodiscard]] std::uint64_t ticks();
[[nodiscard]] bool scheduler_runs();
[[nodiscard]] int open_devices();
[[nodiscard]] int scheduled();

}  // namespace hd_standin
