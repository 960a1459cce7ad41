// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/finite.hpp>
#include <trephine/core/refuse.hpp>
#include <trephine/render/stiffness_budget.hpp>

#include <cstdint>
#include <optional>

/// How a scene keeps tool and cuts from the structures of a segmentation.
namespace trephine::inline TREPHINE_ALIGNED {

/// What a guard does about one structure.
enum class GuardMode : std::uint8_t {
  kOff,   ///< nothing
  kWarn,  ///< warns within its margin
  kPush,  ///< also pushes the tool out of its margin
};

/// How a guard keeps the tool from one structure.
struct GuardedStructure {
  GuardMode mode = GuardMode::kPush;
  double margin = 1e-3;       ///< distance at which the push begins [m], >= 0
  double stiffness = 1000;    ///< of the push [N/m], > 0
  double greatest_force = 2;  ///< the push grows no further [N], > 0
  double damping = 2;         ///< of motion toward the structure, at the margin's full depth [N·s/m], >= 0

  /// Throws std::invalid_argument if a number is out of range.
  void validate() const {
    if (!(margin >= 0) || !(margin <= 0.05)) refuse("GuardedStructure", "margin must be 0 to 0.05 m", margin);
    if (!(stiffness > 0) || !is_finite(stiffness)) refuse("GuardedStructure", "stiffness must be > 0 N/m", stiffness);
    if (!(greatest_force > 0) || !is_finite(greatest_force))
      refuse("GuardedStructure", "greatest_force must be > 0 N", greatest_force);
    if (!(damping >= 0) || !is_finite(damping)) refuse("GuardedStructure", "damping must be >= 0 N·s/m", damping);
    if (!(mode <= GuardMode::kPush)) refuse("GuardedStructure", "mode must be a GuardMode", static_cast<int>(mode));
  }
};

/// Options of a GuardPotential for all structures.
struct GuardPotentialOptions {
  /// Spacing of the knots of the smooth distances [m]. The push turns over this length where the nearest part of a
  /// structure changes, by at most 2 · force / smoothing [N/m]. Distances near a surface of radius r read too long by
  /// smoothing² / (4 r).
  double smoothing = 0.6e-3;
  std::optional<StiffnessBudget> budget{};  ///< of the whole guard; contact's stiffness adds to it
};

/// Options of a StructureGuard.
struct GuardOptions {
  bool push = true;         ///< false: no force, but a report
  double ramp_time = 0.25;  ///< in which a push fades in and out [s], > 0

  /// Throws std::invalid_argument if an option is out of range.
  void validate() const {
    if (!(ramp_time > 0) || !is_finite(ramp_time)) refuse("StructureGuard", "ramp_time must be > 0 s", ramp_time);
  }
};

/// What cuts may do to one structure.
struct StructureVeto {
  enum class Mode : std::uint8_t {
    kFree,     ///< cuts take it, and nobody counts
    kWatch,    ///< cuts take it, and what they take of it is counted: a structure that may break
    kProtect,  ///< no cut takes bone in it or within its margin
    kKeepIn,   ///< no cut takes bone outside of it, or within its margin from inside: a planned cavity
  };
  Mode mode = Mode::kProtect;
  double margin = 0;  ///< [m], >= 0

  /// Throws std::invalid_argument if the margin is out of range.
  void validate() const {
    if (!(margin >= 0) || !(margin <= 0.05)) refuse("StructureVeto", "margin must be 0 to 0.05 m", margin);
    if (!(mode <= Mode::kKeepIn)) refuse("StructureVeto", "mode must be a StructureVeto::Mode", static_cast<int>(mode));
  }
};

/// One structure: what the guard and what cuts do about it.
struct ProtectedStructure {
  GuardedStructure guard{};
  StructureVeto veto{};
};

/// Options of a protection for all structures.
struct ProtectionOptions {
  GuardPotentialOptions potential{};
  GuardOptions guard{};
};

}  // namespace trephine
