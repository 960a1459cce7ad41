// SPDX-License-Identifier: MIT
#pragma once

#include <trephine/core/spatial.hpp>

#include <concepts>
#include <limits>

namespace trephine::inline TREPHINE_ALIGNED {

/// What a load does to a tool at one pose, besides bone: its energy, and the derivatives of it by a small motion
/// (δp, δθ) about T's origin, in G axes.
struct LoadSum {
  double energy = 0;                ///< E [J], >= 0; 0 without contact
  Vec6d wrench = Vec6d::Zero();     ///< −∂E: force [N] and torque [N·m] on the tool
  Mat6d stiffness = Mat6d::Zero();  ///< positive semidefinite part of ∂²E
  double depth = 0;                 ///< largest depth of contact [m]
};

/// Something besides bone that presses on the virtual tool, with an energy of the tool's pose: a renderer that carries
/// loads adds this energy to that of its contact. All calls are on the haptic thread, in G, and take no memory.
/// - `press(X_GT)` gives the load at a pose. Between two calls of `settle` it is a function of the pose alone.
/// - `clearance(X_GT)` is a distance [m] by which every point of the tool may move without touching; <= 0: unknown.
/// - `settle(X_GT, dt)` receives the pose that the tool took in a tick of dt [s]. It may lower the energy of poses,
/// never
///   raise it: so what is lost is dissipated, and none goes to the hand.
template <class L>
concept ToolLoad = requires(L& load, const Posed& X_GT, double dt) {
  { load.press(X_GT) } noexcept -> std::same_as<LoadSum>;
  { load.clearance(X_GT) } noexcept -> std::same_as<double>;
  { load.settle(X_GT, dt) } noexcept;
};

/// No load: compiles to nothing.
struct NoLoad {
  [[nodiscard]] LoadSum press(const Posed&) const noexcept { return {}; }
  [[nodiscard]] double clearance(const Posed&) const noexcept { return std::numeric_limits<double>::infinity(); }
  void settle(const Posed&, double) const noexcept {}
};

}  // namespace trephine
