// SPDX-License-Identifier: MIT
#pragma once

#include "trouble.hpp"

#include <trephine/core/math.hpp>

#include <cstdint>
#include <string>
#include <string_view>

/// Messages of the Inverse Service's simulation channel, versions 3.1 to 3.5, and every check of a single message. None
/// of these functions throws for hostile text. They allocate, so the servo thread does not call them.
namespace haply {

/// A longer message is refused unread.
inline constexpr std::size_t kMessageLimit = 64 * 1024;

/// Identifiers of the devices that a session uses, from the service's first message.
struct Inventory {
  std::string device_id;
  std::string handle_id;     ///< empty: there is no handle, so rotation is not read
  std::string handle_kind;   ///< the list it stands in: "verse_grip" or "wireless_verse_grip"
  std::string force_key;     ///< "vector" from 3.5 on, "values" before
  std::string product_name;  ///< "inverse3", "minverse", ...
};

/// A state of the arm and the handle, as one message has it. D is the service's frame: x right, y forward, z up.
struct Reading {
  trephine::Vec3d position = trephine::Vec3d::Zero();  ///< [m], in D
  trephine::Vec3d velocity = trephine::Vec3d::Zero();  ///< [m/s], in D
  trephine::Quatd rotation = trephine::Quatd::Identity();
  std::uint32_t buttons = 0;  ///< bit 0: a, or a wired handle's only button; bits 1 and 2: b and c
};

/// Finds the device `wanted` (empty: the first) and the handle in the service's first message.
[[nodiscard]] Trouble parse_inventory(std::string_view message, const std::string& wanted, Inventory& inventory);

/// Reads a state. Anything but kNone leaves `reading` as it was.
[[nodiscard]] Trouble parse_state(std::string_view message, const Inventory& inventory, Reading& reading);

/// Writes the message that commands a force [N] in D and asks for the next state.
void write_force(const Inventory& inventory, const trephine::Vec3d& force, std::string& message);

/// A force that a message commands, for the simulated service.
struct Command {
  bool has_force = false;
  trephine::Vec3d force = trephine::Vec3d::Zero();
};
[[nodiscard]] Command parse_command(std::string_view message, const std::string& device_id);

}  // namespace haply
