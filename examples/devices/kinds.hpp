// SPDX-License-Identifier: MIT
#pragma once

#include "any_device.hpp"

#include <trephine/device/simulated_device.hpp>

namespace haply {
class Service;
}

#include <functional>
#include <span>
#include <stdexcept>
#include <string>

namespace devices {

/// What was found of a kind of device on this computer, without opening it.
struct Finding {
  bool usable = false;
  std::string found;  ///< what is here, or what is missing
  std::string to_do;  ///< where it is not usable: driver, rights, service, port, SDK
};

/// The hand that holds a simulated device: targets of the tool in the user's axes about the middle of the workspace.
using Hand = std::function<trephine::HandTarget(double time)>;

/// A kind of device: an adapter, or a counterpart of one that needs no hardware.
struct Kind {
  const char* name;        ///< as --device has it
  const char* what;        ///< in a few words
  bool simulated = false;  ///< a hand that the program brings holds it
  Finding (*look)();
  /// Opens it, with `hand` if it is simulated. Throws std::runtime_error: what is wrong, and what to do.
  Opened (*open)(const Hand& hand);
};

/// All kinds that this project has an adapter for, whether or not they were built in.
[[nodiscard]] std::span<const Kind> kinds();

/// A wrong name, in one line with the right ones.
class UnknownDevice : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};
/// Throws UnknownDevice.
[[nodiscard]] const Kind& kind_named(const std::string& name);

// The kinds, each in a file of its own.
[[nodiscard]] Kind simulated_kind();
[[nodiscard]] Kind openhaptics_kind();
[[nodiscard]] Kind openhaptics_simulated_kind();
[[nodiscard]] Kind haply_kind();
[[nodiscard]] Kind haply_simulated_kind();
[[nodiscard]] Kind force_dimension_kind();
[[nodiscard]] Kind force_dimension_simulated_kind();
[[nodiscard]] Kind spacemouse_kind();

/// A hand's targets as a device's base frame has them.
[[nodiscard]] std::function<trephine::HandTarget(double)> in_base(const Hand& hand, const Opened& frames);

/// Opens haply-simulated, and tells its service, which lives as long as what is opened.
[[nodiscard]] Opened haply_with_service(const Hand& hand, haply::Service*& service);

/// A finding of an adapter that was left out of this build, for want of a package.
[[nodiscard]] Finding left_out(const std::string& for_want_of, const std::string& to_do);

}  // namespace devices
