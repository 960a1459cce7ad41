// SPDX-License-Identifier: MIT
#pragma once

#include "any_device.hpp"
#include "kinds.hpp"

#include <array>
#include <memory>
#include <string>
#include <vector>

namespace devices {

/// What can go wrong between a program and its device.
enum class Fault { kLate, kSilent, kStale, kNoNumber, kJump, kUnplugged, kWrongMessage, kFewerAxes };
inline constexpr std::array kFaultNames{"late", "silent",    "stale",         "NaN",
                                        "jump", "unplugged", "wrong message", "fewer axes"};

/// An adapter opened on its counterpart, which the conformance program drives from the other side.
class Counterpart {
 public:
  Counterpart() = default;
  Counterpart(const Counterpart&) = delete;
  Counterpart& operator=(const Counterpart&) = delete;
  virtual ~Counterpart() = default;
  [[nodiscard]] virtual Opened& opened() = 0;
  /// The force that the motors give now, in D, as the counterpart has it.
  [[nodiscard]] virtual Vec3d felt() const = 0;
  /// Why this fault cannot befall this kind of device; empty: it can.
  [[nodiscard]] virtual std::string cannot(Fault fault) const = 0;
  virtual void inject(Fault fault) = 0;
  virtual void heal() = 0;
};

/// A kind of adapter that has a counterpart in this build, by the name of its kind.
struct Testable {
  std::string name;
  Vec3d right_D, up_D;  ///< the user's axes, as the vendor's documents have them
  std::unique_ptr<Counterpart> (*open)(const Hand& hand);
};
[[nodiscard]] std::vector<Testable> testable_kinds();

}  // namespace devices
